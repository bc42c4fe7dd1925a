/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/chain/chain.h"

#include "common/base/mem.h"
#include "common/base/bytes.h"

#include <string.h>

void chain_count_decision(struct chain *c, bool accepted)
{
	uint64_t *counters = c->context->counters;
	if (accepted) {
		counters[COUNT_ACCEPTED]++;
		c->rejected_in_a_row = 0;
		return;
	}
	c->rejected_in_a_row++;
	if (c->rejected_in_a_row > counters[COUNT_LONGEST_STUCK])
		counters[COUNT_LONGEST_STUCK] = c->rejected_in_a_row;
}

void chain_write_header(const struct chain *c, uint8_t *bytes)
{
	put64(bytes, c->id);
	put64(bytes + 8, c->step);
	put64(bytes + 16, c->rejected_in_a_row);
}

bool chain_read_header(struct chain *c, const uint8_t *bytes, size_t size)
{
	if (size < CHAIN_STATE_HEADER_BYTES || get64(bytes) != c->id || get64(bytes + 8) != c->step ||
	    get64(bytes + 16) > c->step)
		return false;
	c->rejected_in_a_row = get64(bytes + 16);
	return true;
}

int chain_state_copy_bytes(const uint8_t *bytes, size_t size, struct chain_state *out)
{
	out->size = (uint32_t)size;
	out->bytes = mem_alloc(size, 1);
	if (!out->bytes)
		return -ENOMEM;
	memcpy(out->bytes, bytes, size);
	return 0;
}
