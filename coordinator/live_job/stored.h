/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The data stored of a job besides its results, packed as messages of proto/stored.proto, and unpacked also from the
 * formats of earlier versions. Any thread.
 */
#ifndef COORDINATOR_LIVE_JOB_STORED_H
#define COORDINATOR_LIVE_JOB_STORED_H

#include "common/base/error.h"
#include "common/estimate/forecast.h"
#include "coordinator/core/job_fields.h"
#include "coordinator/live_job/live_job.h"

/* The contents of a checkpoint besides seeds, chain states and films. */
struct checkpoint_head {
	uint64_t job, generation;
	uint32_t worker_count;
	double cpu_seconds, bootstrap_cpu_seconds, look_written;
	struct live_job_times times;
	struct bootstrap_result bootstrap_result;
	struct forecast_history looks;
	struct job_counts counts;
	char fingerprint[256];
};

enum {
	STORED_NOTE_MAX = 1024,	   /* limit on the bytes of one estimate of the error ("look"), or of the counters */
	STORED_HEAD_MAX = 1 << 16, /* limit on the bytes of a checkpoint's head */
	/* Bytes of a head of version 004, after magic number, size of the head and worker_count. */
	STORED_OLD_HEAD_SIZE = 4512,
};

/* Each returns the number of bytes packed. */
size_t stored_pack_look(const struct forecast_look *l, unsigned char bytes[STORED_NOTE_MAX]);
size_t stored_pack_counts(const struct job_counts *c, unsigned char bytes[STORED_NOTE_MAX]);
size_t stored_pack_head(const struct checkpoint_head *h, unsigned char bytes[STORED_HEAD_MAX]);

/* Each returns -EPROTO if the bytes are not such a message or of another version, -ENOMEM if out of memory. */
int stored_unpack_look(const unsigned char *bytes, size_t size, struct forecast_look *l, struct error *e);
int stored_unpack_counts(const unsigned char *bytes, size_t size, struct job_counts *c, struct error *e);
int stored_unpack_head(const unsigned char *bytes, size_t size, struct checkpoint_head *h, struct error *e);

/*
 * Like the functions above, for data of earlier versions, little endian. Return -EPROTO if the size is wrong.
 *
 * A look: six doubles in the order of struct forecast_look, and the last member in 8 bytes. Counters, 8 bytes each:
 * repeats, refused, faults, failures, timeouts, duplicates, verified, mismatched. A head:
 *
 * offset  bytes  contents
 * 0       16     job, generation
 * 16      24     doubles: cpu_seconds, bootstrap_cpu_seconds, look_written
 * 40      24     doubles: elapsed, opened, completed
 * 64      512    doubles: b of 64 groups
 * 576     16     doubles: b_pooled, beyond_share
 * 592     1      black
 * 600     4      number of looks
 * 608     3584   64 looks
 * 4192    64     counters
 * 4256    256    fingerprint, a string
 */
int stored_unpack_old_look(const unsigned char *bytes, size_t size, struct forecast_look *l, struct error *e);
int stored_unpack_old_counts(const unsigned char *bytes, size_t size, struct job_counts *c, struct error *e);
void stored_unpack_old_head(const unsigned char bytes[STORED_OLD_HEAD_SIZE], uint32_t worker_count,
			    struct checkpoint_head *h);

#endif
