/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/job/stored_frame.h"

#include "common/wire/frame.h"

int stored_frame_unpack(struct envelope *env, Farm__Envelope__BodyCase want, const unsigned char *frame, size_t size,
			const unsigned char **payload, size_t *payload_size, struct error *e)
{
	uint32_t header = 0, rest = 0;
	*payload = NULL;
	*payload_size = 0;
	if (size >= FRAME_PREFIX)
		frame_prefix_read(frame, &header, &rest);
	if (size < FRAME_PREFIX || (uint64_t)header + rest != size - FRAME_PREFIX)
		return error_set(e, EBADMSG, "a frame of another length");
	int rc = envelope_unpack(env, frame + FRAME_PREFIX, header, e);
	if (!rc && env->message->body_case != want) {
		envelope_fini(env);
		rc = error_set(e, EBADMSG, "another message than was expected");
	}
	*payload = frame + FRAME_PREFIX + header;
	*payload_size = rest;
	return rc;
}
