/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Bounds the memory of the bytes that wait to be sent on many connections at the same time. If more bytes would exceed
 * the limit, connections are closed ("give way") until they fit. Of the connections whose backlog is at least the
 * average, the one whose peer has taken nothing for the longest time is closed first. A peer that reads is therefore
 * the last to be closed, and one that holds little never is. A single amount above the limit may wait while nothing
 * else does. The loop's thread.
 */
#ifndef COMMON_NET_SEND_POOL_H
#define COMMON_NET_SEND_POOL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/queue.h>

/* The share of one connection. Initially zeroed except for the first three members. */
struct send_share {
	struct send_pool *pool; /* NULL: no limit */
	/* bytes that the kernel has not taken; called at any time */
	uint64_t (*unsent_bytes)(const struct send_share *);
	void (*evict)(struct send_share *); /* must close the connection */
	LIST_ENTRY(send_share) next;	    /* in the list of shares that hold something */
	uint64_t bytes, last_unsent_bytes;  /* bytes held; result of unsent_bytes() when it was last called */
	uint64_t progress_ms;		    /* when the peer last took something, or nothing waited */
	bool is_closing;		    /* the connection is being closed */
};

/* Initially zeroed except for max_bytes. */
struct send_pool {
	uint64_t max_bytes, used_bytes; /* bytes */
	uint64_t closing_bytes;		/* bytes of connections being closed, freed in the loop's next iteration */
	LIST_HEAD(, send_share) waiting_shares; /* shares that hold something */
};

/* Adds bytes to a share; closes connections if necessary. now: ms of the loop's clock. Returns false if this connection
 * itself had to give way; its share is then unchanged. */
bool send_pool_add(struct send_share *s, uint64_t bytes, uint64_t now);
/* Subtracts bytes that the kernel has taken or that were dropped. */
void send_pool_subtract(struct send_share *s, uint64_t bytes, uint64_t now);
/* Corrects a share, while it is not empty, by memory that is used in addition (or no longer). Unlike send_pool_add and
 * send_pool_subtract, this does not count as activity of the peer and closes no connection. */
void send_pool_adjust(struct send_share *s, int64_t bytes);
/* Notes whether the peer has taken something since the last call. */
void send_pool_note_progress(struct send_share *s, uint64_t now);
/* Call when the connection is being closed: its bytes no longer count as used, and none may be added. */
void send_pool_close_share(struct send_share *s);

#endif
