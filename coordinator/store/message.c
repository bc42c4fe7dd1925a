/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/store/message.h"

#include "common/base/mem.h"

#include <stdbool.h>

/* Notes in *out that memory ran out, to distinguish this from a damaged message. */
static void *allocate_block(void *out, size_t size)
{
	void *p = mem_alloc(size, 1);
	if (!p)
		*(bool *)out = true;
	return p;
}

static void release_block(void *out, void *p)
{
	(void)out;
	mem_free(p);
}

ProtobufCMessage *message_unpack(const ProtobufCMessageDescriptor *d, const unsigned char *bytes, size_t size, int *rc,
				 struct error *e)
{
	bool out_of_memory = false;
	ProtobufCAllocator memory = {allocate_block, release_block, &out_of_memory};
	ProtobufCMessage *m = protobuf_c_message_unpack(d, &memory, size, bytes);
	*rc = m		      ? 0
	      : out_of_memory ? error_set(e, ENOMEM, "no memory for %s", d->short_name)
			      : error_set(e, EPROTO, "%zu bytes are not a %s", size, d->short_name);
	return m;
}

void message_free(ProtobufCMessage *m)
{
	ProtobufCAllocator memory = {allocate_block, release_block, NULL};
	if (m)
		protobuf_c_message_free_unpacked(m, &memory);
}

int message_check_fields(const ProtobufCMessage *m, struct error *e)
{
	return m->n_unknown_fields
		       ? error_set(e, EPROTO, "%s with an unknown field, of another version", m->descriptor->short_name)
		       : 0;
}
