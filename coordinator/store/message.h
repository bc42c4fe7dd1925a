/* SPDX-License-Identifier: Apache-2.0 */
/* Reads messages of proto/stored.proto from stored bytes. Any thread. */
#ifndef COORDINATOR_STORE_MESSAGE_H
#define COORDINATOR_STORE_MESSAGE_H

#include "common/base/error.h"

#include "proto/stored.pb-c.h"

/* Unpacks a message; free it with message_free. Returns NULL and sets *rc to -ENOMEM, or to -EPROTO if the bytes are
 * not a message of this type. */
ProtobufCMessage *message_unpack(const ProtobufCMessageDescriptor *d, const unsigned char *bytes, size_t size, int *rc,
				 struct error *e);
void message_free(ProtobufCMessage *m); /* m may be NULL */
/* Returns -EPROTO if the message has an unknown field. Checks the message itself, not nested ones. */
int message_check_fields(const ProtobufCMessage *m, struct error *e);

#endif
