/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bounds the memory of what waits to be sent on many connections at the same time. When something more does not fit,
 * connections give way until it does: of those that hold at least the average of all that hold something, the one whose
 * peer has taken nothing for longest. So a peer that reads is the last to go, and one that holds little never goes.
 * What exceeds the limit alone may wait while nothing else does. The loop's thread.
 */
#ifndef COMMON_NET_SEND_POOL_H
#define COMMON_NET_SEND_POOL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/queue.h>

/* What one connection holds; zeroed but for the first three: nothing. */
struct send_share {
	struct send_pool *pool;			     /* NULL: no limit */
	uint64_t (*left)(const struct send_share *); /* bytes that the kernel has not taken; called at any time */
	void (*give_way)(struct send_share *);	     /* the connection must be closed */
	LIST_ENTRY(send_share) next;		     /* of those that hold something */
	uint64_t bytes, seen;			     /* what it holds, and what was left when last looked at */
	uint64_t moved;				     /* ms: when its peer last took something, or nothing waited */
	bool leaves;				     /* its connection is being closed */
};

/* Zeroed but for the limit: empty. */
struct send_pool {
	uint64_t limit, used; /* bytes */
	uint64_t leaving;     /* bytes of connections that are being closed: the loop frees them when it comes round */
	LIST_HEAD(, send_share) waiting;
};

/* `now`: ms of the loop's clock. false: it gave way itself, and holds no more than before. */
bool send_pool_add(struct send_share *s, uint64_t bytes, uint64_t now);
/* The kernel has taken them, or they were dropped. */
void send_pool_sub(struct send_share *s, uint64_t bytes, uint64_t now);
/* It holds so much more (or less) in memory than was added, which is no sign of its peer, and nobody gives way before
 * something is added. Only while something else of it is held. */
void send_pool_adjust(struct send_share *s, int64_t bytes);
/* Notes whether its peer has taken something. */
void send_pool_look(struct send_share *s, uint64_t now);
/* Its connection is being closed: it may only give back. */
void send_pool_leave(struct send_share *s);

#endif
