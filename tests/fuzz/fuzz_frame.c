/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bytes from a peer, cut into frames whose limits the fuzzer chooses, and the handling of messages that carry payloads.
 * The bytes arrive in pieces, as from a network.
 */
#include "common/wire/batch_wire.h"
#include "common/wire/frame.h"
#include "tests/fuzz/messages.h"
#include "tests/support/checksummed_frame.h"

#include <stdlib.h>
#include <string.h>

static void exercise_message(const struct frame_reader *r)
{
	struct envelope env;
	struct error e;
	if (envelope_unpack(&env, r->header.bytes, r->header.size, &e))
		return;
	const Farm__Envelope *m = env.message;
	struct plan plan;
	struct plan_request request;
	struct batch batch;
	struct grant grant;
	if (m->body_case == FARM__ENVELOPE__BODY_JOB_INFO)
		plan_from_wire(m->job_info->plan, &plan, &e);
	if (m->body_case == FARM__ENVELOPE__BODY_SUBMIT && !plan_request_from_wire(m->submit->plan, &request, &e))
		plan_make(&request, &plan, &e);
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_GRANT &&
	    !grant_unpack(&grant, m->lease_grant, r->payload.bytes, r->payload.size, &e))
		grant_fini(&grant);
	if (m->body_case == FARM__ENVELOPE__BODY_LEASE_RESULT) {
		struct plan_request small = {.integrator = "pssmlt",
					     .kind = PLAN_CHAINS,
					     .width = 70,
					     .height = 70,
					     .spp = 1,
					     .max_depth = 4,
					     .chains = 16,
					     .groups = 4,
					     .bootstrap = 64,
					     .epoch = 4,
					     .mixture = "independent=0.1,hslt=0.9"};
		if (!plan_make(&small, &plan, &e) &&
		    !batch_unpack(&batch, &plan, m->lease_result, r->payload.bytes, r->payload.size, &e))
			batch_fini(&batch);
	}
	envelope_fini(&env);
}

static void read_frames(const uint8_t *bytes, size_t size)
{
	struct frame_reader r;
	struct error e;
	frame_reader_init(&r, (struct frame_limits){1 << 20, 1 << 20});
	for (size_t offset = 0, used; offset < size; offset += used) {
		size_t piece = 1 + (offset * 2654435761u >> 7) % 4096;
		int rc =
			frame_reader_feed(&r, bytes + offset, piece < size - offset ? piece : size - offset, &used, &e);
		if (rc < 0)
			break;
		if (rc)
			exercise_message(&r);
	}
	frame_reader_fini(&r);
}

/* Returns the frames of an input with correct checksums, so that the code behind the check is reached. The caller frees
 * it. */
static uint8_t *add_checksums(const uint8_t *bytes, size_t size, size_t *out_size)
{
	uint8_t *all = NULL;
	*out_size = 0;
	for (size_t offset = 0; size - offset >= FRAME_PREFIX_SIZE;) {
		uint32_t header, payload;
		size_t n;
		frame_prefix_read(bytes + offset, &header, &payload);
		offset += FRAME_PREFIX_SIZE;
		header = header < size - offset ? header : (uint32_t)(size - offset);
		payload = payload < size - offset - header ? payload : (uint32_t)(size - offset - header);
		uint8_t *frame = checksummed_frame_from_parts(bytes + offset, header, bytes + offset + header, payload,
							      !all, &n);
		all = realloc(all, *out_size + n);
		if (!all)
			abort();
		memcpy(all + *out_size, frame, n);
		*out_size += n;
		free(frame);
		offset += header + payload;
	}
	return all;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	size_t out_size;
	uint8_t *checked = add_checksums(bytes, size, &out_size);
	read_frames(checked, out_size);
	free(checked);
	read_frames(bytes, size); /* with the input's own checksums, which are hardly ever right */
	return 0;
}
