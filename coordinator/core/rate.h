/* SPDX-License-Identifier: Apache-2.0 */
/* A rate per second, averaged over the last RATE_BUCKETS x RATE_WIDTH seconds. Pure; allocates nothing. */
#ifndef COORDINATOR_CORE_RATE_H
#define COORDINATOR_CORE_RATE_H

#include <stdint.h>

enum { RATE_BUCKETS = 15, RATE_WIDTH = 2 };

struct rate {
	double since;
	int64_t index[RATE_BUCKETS]; /* number of the period of RATE_WIDTH s that the bucket counts */
	double sum[RATE_BUCKETS];
};

void rate_init(struct rate *r, double now);
void rate_add(struct rate *r, double now, double amount);
double rate_value(const struct rate *r, double now);

#endif
