/* SPDX-License-Identifier: Apache-2.0 */
/* Waiting times before something is tried again, spread so that a hundred workers or clients do not try at once. */
#ifndef COMMON_NET_JITTER_H
#define COMMON_NET_JITTER_H

/* Between half and one and a half of that time, at random. Any thread. */
double jitter(double seconds);

#endif
