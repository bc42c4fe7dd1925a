/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bounds the memory of frames that many connections receive at the same time. Each frame takes its size from the pool
 * before it arrives; if the pool does not have enough left, the frame waits, and its sender with it. Owners take turns,
 * so that one owner with many connections does not keep the others waiting. A frame larger than the pool is received
 * alone. The loop's thread.
 */
#ifndef COMMON_NET_RECEIVE_POOL_H
#define COMMON_NET_RECEIVE_POOL_H

#include <stdbool.h>
#include <stdint.h>

/* The place of a connection in the pool. Initially zeroed except for `owner` and `on_granted`. */
struct receive_turn {
	uint64_t owner;
	struct receive_turn *next;
	uint64_t round;				   /* in each round, each owner that waits has one turn */
	uint64_t bytes;				   /* taken, or waited for */
	bool is_granted, is_waiting;		   /* the bytes have been taken; they are waited for */
	void (*on_granted)(struct receive_turn *); /* called when bytes that were waited for have been taken */
};

/* Initially zeroed except for max_bytes. */
struct receive_pool {
	uint64_t max_bytes, used_bytes;
	struct receive_turn *queue; /* those that wait, in order of rounds */
};

/* Takes bytes from the pool. Returns false if the turn has to wait; `on_granted` is called later. */
bool receive_pool_acquire(struct receive_pool *p, struct receive_turn *t, uint64_t bytes);
/* Gives back the bytes, or stops waiting. May call `on_granted` of others. */
void receive_pool_release(struct receive_pool *p, struct receive_turn *t);

#endif
