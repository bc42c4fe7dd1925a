/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Counts the bytes that a client sends: a thread passes one connection at a time on to a port on loopback. Ends the
 * bench if it cannot be set up.
 */
#ifndef TESTS_BENCH_RELAY_H
#define TESTS_BENCH_RELAY_H

#include <stdint.h>

struct relay;

/* Starts the relay; *port becomes its port. */
struct relay *relay_start(uint16_t target, uint16_t *port);
/* Returns the bytes that clients have sent on all connections so far. */
uint64_t relay_sent_bytes(const struct relay *r);
void relay_stop(struct relay *r); /* call it after the last connection has ended */

#endif
