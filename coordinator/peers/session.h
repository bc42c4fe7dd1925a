/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The sessions: the state of each connected peer, and all of them by number. The protocol is in conversation.h. A
 * session belongs to its connection and is freed with it. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_SESSION_H
#define COORDINATOR_PEERS_SESSION_H

#include "common/net/conn.h"
#include "coordinator/live_job/jobs.h"

enum { SESSION_BUCKETS = 4096 };

enum {
	/* Bytes of a message, without payload: before hello, and after it. */
	SESSION_HELLO_HEADER = 4096,
	SESSION_HEADER = 1 << 20,
	/* Bytes that may wait for a peer to read them: before hello, an error; after it, answers. For a worker, the
	 * leases that it may hold are added. */
	SESSION_HELLO_SEND = 1 << 16,
	SESSION_SEND = 1 << 23,
};

enum session_state { SESSION_NEW, SESSION_WORKER, SESSION_CLIENT, SESSION_LEAVING };

struct upload;
struct worker_request;

struct session {
	LIST_ENTRY(session) next;  /* of all */
	LIST_ENTRY(session) alike; /* in the same hash bucket */
	struct peers *peers;
	struct jobs *jobs;
	struct conn *conn;
	uint64_t id; /* the core's id of the peer, and the tag of its requests */
	enum session_state state;
	bool joined; /* the core knows the peer */
	char name[128], address[64];
	struct tls_peer who; /* role in its certificate; TLS_NOBODY without TLS, when everybody may do everything */
	uint32_t payload_limit;
	size_t leases_most;			/* bytes of as many leases as it wants */
	STAILQ_HEAD(, worker_request) requests; /* that wait until it has read what was sent, or until a file is read */
	unsigned request_count;
	double heard;	       /* s of the loop's clock: the last heartbeat sent during a long message */
	struct upload *upload; /* a submission that waits for blobs */
	size_t upload_bytes;   /* its message */
	uint64_t watched;      /* job being watched; 0: none */
	struct {
		uint64_t job;
		double at;    /* s of the loop's clock */
	} ended;	      /* the watched job of whose end the client knows: it will fetch the result */
	struct fetching {     /* a file being received */
		uint64_t job; /* 0: none */
		Farm__What what;
		int fd;
		uint64_t size; /* its size when it was opened: a log grows */
		double at;     /* s of the loop's clock: the last chunk */
	} fetch;
	uint64_t wants_preview;	  /* job whose preview is being made for it; 0: none */
	struct job_view *shown;	  /* what was last sent to the watcher */
	STAILQ_HEAD(, held) held; /* requests that wait until the jobs are read */
	size_t held_bytes;
	uint64_t turn; /* the number of its last request; all sessions share one counter */
	double told;   /* s of the loop's clock: the last heartbeat sent meanwhile */
};

/* All sessions, and their common limits. */
struct peers {
	struct jobs *jobs;
	struct tls *tls;	   /* NULL: plaintext */
	struct listener {	   /* their loop is that of the jobs */
		uv_tcp_t tcp;	   /* first: libuv's pointer to it is one to this */
		bool caller_waits; /* a connection could not be accepted: try again */
	} listeners[NET_ADDRS_MOST];
	unsigned listener_count;
	LIST_HEAD(, session) sessions;
	LIST_HEAD(, session) by_id[SESSION_BUCKETS];
	uv_idle_t looks; /* while submissions look for their files */
	unsigned session_count, fetches;
	size_t held_bytes;   /* bytes of waiting requests */
	uint64_t requests;   /* of clients: number of the last one */
	double request_ms;   /* which they have taken since the last tick */
	size_t upload_bytes; /* of all submissions that wait for blobs */
	struct receive_pool receiving;
	struct send_pool sending;
	uint64_t last_peer;
	uint64_t garbled; /* connections closed because of a wrong checksum */
};

struct session *peers_find(const struct peers *s, uint64_t id); /* NULL: it is gone */
void peers_enlist(struct peers *s, struct session *p);
void peers_delist(struct peers *s, struct session *p); /* its connection has closed */

/* Sends the reason and closes. */
__attribute__((format(printf, 2, 3))) void session_fault(struct session *p, const char *format, ...);

#endif
