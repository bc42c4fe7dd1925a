/* SPDX-License-Identifier: Apache-2.0 */
/* Random waiting times before a retry, so that a hundred workers or clients do not retry at the same time. */
#ifndef COMMON_NET_JITTER_H
#define COMMON_NET_JITTER_H

/* Returns a random time between 0.5 and 1.5 times `seconds`. Any thread. */
double jitter_seconds(double seconds);

#endif
