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
	double used_tokens;	 /* tokens used at time `last_time`; zeroed: a full bucket */
	double last_time;	 /* time of the last call, s */
	uint64_t withheld_count; /* lines suppressed since log_bucket_take_withheld last reported any */
};

/* Returns whether the line may be written; if not, it is counted. `now` is in s and never decreases. */
bool log_bucket_take(struct log_bucket *b, double now);
/* Once lines are allowed again, returns how many were suppressed, resets that count and takes a token for the line that
 * reports it; otherwise returns 0. */
uint64_t log_bucket_take_withheld(struct log_bucket *b, double now);

#endif
