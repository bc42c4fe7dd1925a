/* SPDX-License-Identifier: Apache-2.0 */
/* A rate per second, averaged over the last RATE_BUCKETS x RATE_BUCKET_SECONDS seconds. Pure; allocates nothing. */
#ifndef COORDINATOR_CORE_RATE_H
#define COORDINATOR_CORE_RATE_H

#include <stdint.h>

enum { RATE_BUCKETS = 15, RATE_BUCKET_SECONDS = 2 };

struct rate {
	double start;
	int64_t periods[RATE_BUCKETS]; /* number of the period of RATE_BUCKET_SECONDS s that the bucket counts */
	double sums[RATE_BUCKETS];
};

void rate_init(struct rate *r, double now);
void rate_add(struct rate *r, double now, double amount);
double rate_value(const struct rate *r, double now);

#endif
