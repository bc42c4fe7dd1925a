/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A rate limit for log lines of one kind: a token bucket, one token per line. Pure: the caller provides the clock and
 * one bucket per kind.
 */
#ifndef COMMON_BASE_LOG_LIMIT_H
#define COMMON_BASE_LOG_LIMIT_H

#include <stdbool.h>
#include <stdint.h>

enum { LOG_BURST = 100, LOG_PER_SECOND = 5 };

struct log_bucket {
	double used, at;   /* tokens used, and as of when; zeroed: a full bucket */
	uint64_t withheld; /* lines left out since the last log_bucket_withheld */
};

/* true: write the line. `now` in s, never decreasing. false: leave it out; it is counted. */
bool log_bucket_take(struct log_bucket *b, double now);
/* How many lines were left out, once lines are allowed again, and resets the count; otherwise 0. */
uint64_t log_bucket_withheld(struct log_bucket *b, double now);

#endif
