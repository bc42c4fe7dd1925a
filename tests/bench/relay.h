/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Counts the bytes that a client sends: passes one connection at a time on to a port of loopback, by a thread of its
 * own. A failure to set it up ends the bench.
 */
#ifndef TESTS_BENCH_RELAY_H
#define TESTS_BENCH_RELAY_H

#include <stdint.h>

struct relay;

/* port: of the relay. */
struct relay *relay_start(uint16_t target, uint16_t *port);
/* Of all connections so far, from the client. */
uint64_t relay_sent(const struct relay *r);
void relay_stop(struct relay *r); /* after the last connection has ended */

#endif
