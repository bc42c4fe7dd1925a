/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/rate.h"

#include <math.h>

static int64_t bucket_at(double now)
{
	return (int64_t)floor(now / RATE_WIDTH);
}

static int slot_of(int64_t index)
{
	return (int)((index % RATE_BUCKETS + RATE_BUCKETS) % RATE_BUCKETS);
}

void rate_init(struct rate *r, double now)
{
	r->since = now;
	for (int i = 0; i < RATE_BUCKETS; i++) {
		r->index[i] = INT64_MIN;
		r->sum[i] = 0;
	}
}

void rate_add(struct rate *r, double now, double amount)
{
	int64_t index = bucket_at(now);
	int i = slot_of(index);
	if (r->index[i] != index) {
		r->index[i] = index;
		r->sum[i] = 0;
	}
	r->sum[i] += amount;
}

double rate_value(const struct rate *r, double now)
{
	int64_t last = bucket_at(now);
	double sum = 0;
	for (int64_t index = last - RATE_BUCKETS + 1; index <= last; index++) {
		int i = slot_of(index);
		if (r->index[i] == index)
			sum += r->sum[i];
	}
	double begin = (double)(last - RATE_BUCKETS + 1) * RATE_WIDTH;
	double width = now - fmax(begin, r->since);
	return width > 0 ? sum / width : 0;
}
