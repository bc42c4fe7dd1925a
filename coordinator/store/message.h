/* SPDX-License-Identifier: Apache-2.0 */
/* Messages of proto/stored.proto, out of bytes that a disk gave back. Any thread. */
#ifndef COORDINATOR_STORE_MESSAGE_H
#define COORDINATOR_STORE_MESSAGE_H

#include "common/base/error.h"

#include "proto/stored.pb-c.h"

/* For message_free. NULL, and rc is -ENOMEM, or -EPROTO: the bytes are no such message. */
ProtobufCMessage *message_unpack(const ProtobufCMessageDescriptor *d, const unsigned char *bytes, size_t size, int *rc,
				 struct error *e);
void message_free(ProtobufCMessage *m); /* NULL: nothing */
/* -EPROTO: it has a field that is not known here. Of its own fields, not of those of messages in it. */
int message_check_known(const ProtobufCMessage *m, struct error *e);

#endif
