/* SPDX-License-Identifier: Apache-2.0 */
/* Stored messages: results in journals, submissions and plans in the ledger. Any thread. */
#ifndef COORDINATOR_JOB_STORED_FRAME_H
#define COORDINATOR_JOB_STORED_FRAME_H

#include "common/wire/envelope.h"

/* A stored frame with this message. -EBADMSG, -ENOMEM. The payload points into the frame. */
int stored_frame_unpack(struct envelope *env, Farm__Envelope__BodyCase want, const unsigned char *frame, size_t size,
			const unsigned char **payload, size_t *payload_size, struct error *e);

#endif
