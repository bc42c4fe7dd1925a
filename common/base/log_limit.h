/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How many log lines of one kind are said: a bucket of tokens, one a line, filled again as time goes by. Pure: the
 * caller has the clock, and one bucket a kind.
 */
#ifndef COMMON_BASE_LOG_LIMIT_H
#define COMMON_BASE_LOG_LIMIT_H

#include <stdbool.h>
#include <stdint.h>

enum { LOG_BURST = 100, LOG_PER_SECOND = 5 };

struct log_bucket {
	double used, at;   /* tokens that are not there, and when that was; zeroed: full */
	uint64_t withheld; /* lines since this was asked for last */
};

/* A line is to be said at `now` (s, never falls); false: it is withheld, and counted. */
bool log_bucket_take(struct log_bucket *b, double now);
/* How many were withheld, once a line could be said again; 0: none, or the rush goes on. Then counted anew. */
uint64_t log_bucket_withheld(struct log_bucket *b, double now);

#endif
