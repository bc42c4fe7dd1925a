/* SPDX-License-Identifier: Apache-2.0 */
/* Reads messages of proto/stored.proto from stored bytes. Any thread. */
#ifndef COORDINATOR_STORE_MESSAGE_H
#define COORDINATOR_STORE_MESSAGE_H

#include "common/base/error.h"

#include "proto/stored.pb-c.h"

/* For message_free. NULL, and rc is -ENOMEM, or -EPROTO: the bytes are not such a message. */
ProtobufCMessage *message_unpack(const ProtobufCMessageDescriptor *d, const unsigned char *bytes, size_t size, int *rc,
				 struct error *e);
void message_free(ProtobufCMessage *m); /* m may be NULL */
/* -EPROTO: it has an unknown field. Checks its own fields, not those of nested messages. */
int message_check_known(const ProtobufCMessage *m, struct error *e);

#endif
