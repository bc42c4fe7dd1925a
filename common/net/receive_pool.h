/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bounds the memory of frames that many connections receive at the same time. Each frame's size is taken from the pool
 * before it arrives; when the pool has not enough left, frames wait, and their senders with them. Owners take turns, so
 * that many connections of one do not keep others waiting. A frame larger than the pool is received alone. The loop's
 * thread.
 */
#ifndef COMMON_NET_RECEIVE_POOL_H
#define COMMON_NET_RECEIVE_POOL_H

#include <stdbool.h>
#include <stdint.h>

/* A connection's place; zeroed but for its owner: it has nothing and does not wait. */
struct receive_turn {
	uint64_t owner;
	struct receive_turn *next;
	uint64_t round; /* in which each owner that waits has one turn */
	uint64_t bytes;
	bool has, waits;
	void (*go)(struct receive_turn *); /* it no longer waits, it has */
};

/* Zeroed but for the limit: empty. */
struct receive_pool {
	uint64_t limit, used;	    /* bytes */
	struct receive_turn *first; /* of those that wait, by rounds */
};

/* false: it waits. */
bool receive_pool_take(struct receive_pool *p, struct receive_turn *t, uint64_t bytes);
/* Gives back what it has, or no longer waits. Others may go. */
void receive_pool_give(struct receive_pool *p, struct receive_turn *t);

#endif
