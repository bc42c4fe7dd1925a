/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/log_limit.h"

static void refill_bucket(struct log_bucket *b, double now)
{
	double back = now > b->at ? (now - b->at) * LOG_PER_SECOND : 0;
	b->used = b->used > back ? b->used - back : 0;
	b->at = now > b->at ? now : b->at;
}

bool log_bucket_take(struct log_bucket *b, double now)
{
	refill_bucket(b, now);
	if (b->used + 1 > LOG_BURST) {
		b->withheld++;
		return false;
	}
	b->used++;
	return true;
}

uint64_t log_bucket_withheld(struct log_bucket *b, double now)
{
	uint64_t n = b->withheld;
	refill_bucket(b, now);
	if (!n || b->used + 1 > LOG_BURST)
		return 0;
	b->used++; /* the line that reports this */
	b->withheld = 0;
	return n;
}
