/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/rate.h"

#include <math.h>

static int64_t period_at(double now)
{
	return (int64_t)floor(now / RATE_BUCKET_SECONDS);
}

static int bucket_of_period(int64_t index)
{
	return (int)((index % RATE_BUCKETS + RATE_BUCKETS) % RATE_BUCKETS);
}

void rate_init(struct rate *r, double now)
{
	r->start = now;
	for (int i = 0; i < RATE_BUCKETS; i++) {
		r->periods[i] = INT64_MIN;
		r->sums[i] = 0;
	}
}

void rate_add(struct rate *r, double now, double amount)
{
	int64_t index = period_at(now);
	int i = bucket_of_period(index);
	if (r->periods[i] != index) {
		r->periods[i] = index;
		r->sums[i] = 0;
	}
	r->sums[i] += amount;
}

double rate_value(const struct rate *r, double now)
{
	int64_t last = period_at(now);
	double sum = 0;
	for (int64_t index = last - RATE_BUCKETS + 1; index <= last; index++) {
		int i = bucket_of_period(index);
		if (r->periods[i] == index)
			sum += r->sums[i];
	}
	double begin = (double)(last - RATE_BUCKETS + 1) * RATE_BUCKET_SECONDS;
	double seconds = now - fmax(begin, r->start);
	return seconds > 0 ? sum / seconds : 0;
}
