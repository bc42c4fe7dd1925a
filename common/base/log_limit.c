/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/log_limit.h"

static void refill_bucket(struct log_bucket *b, double now)
{
	double refilled = now > b->last_time ? (now - b->last_time) * LOG_PER_SECOND : 0;
	b->used_tokens = b->used_tokens > refilled ? b->used_tokens - refilled : 0;
	b->last_time = now > b->last_time ? now : b->last_time;
}

bool log_bucket_take(struct log_bucket *b, double now)
{
	refill_bucket(b, now);
	if (b->used_tokens + 1 > LOG_BURST) {
		b->withheld_count++;
		return false;
	}
	b->used_tokens++;
	return true;
}

uint64_t log_bucket_take_withheld(struct log_bucket *b, double now)
{
	uint64_t n = b->withheld_count;
	refill_bucket(b, now);
	if (!n || b->used_tokens + 1 > LOG_BURST)
		return 0;
	b->used_tokens++; /* the line that reports this */
	b->withheld_count = 0;
	return n;
}
