/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The sessions: what is known of each peer that is connected, and all of them by number. What is said in one is in
 * conversation.h. A session belongs to its connection and goes with it. The loop's thread.
 */
#ifndef COORDINATOR_PEERS_SESSION_H
#define COORDINATOR_PEERS_SESSION_H

#include "common/net/conn.h"
#include "coordinator/job/jobs.h"

enum { SESSION_BUCKETS = 4096 };

enum { /* bytes */
       SESSION_HELLO_HEADER = 4096,
       SESSION_HEADER = 1 << 20,
       /* What may wait for a peer to read it: a word to a stranger, answers; for a worker the leases beside that it
	  may hold. */
       SESSION_HELLO_SEND = 1 << 16,
       SESSION_SEND = 1 << 23,
};

enum session_state { SESSION_NEW, SESSION_WORKER, SESSION_CLIENT, SESSION_LEAVING };

struct upload;
struct worker_request;

struct session {
	struct session *next, **place; /* all; where they point to this one */
	struct session *alike;	       /* of the same bucket */
	struct peers *peers;
	struct jobs *jobs;
	struct conn *conn;
	uint64_t id; /* the core's peer id, and the tag of its requests */
	enum session_state state;
	bool joined; /* the core knows it */
	char name[128], address[64];
	struct tls_peer who; /* by its certificate; TLS_NOBODY without TLS, and then everybody may do everything */
	uint32_t payload_limit;
	size_t leases_most;	     /* bytes of as many leases as it wanted */
	struct worker_request *asks; /* that wait for it to read */
	unsigned ask_count;
	double heard;	       /* s on the loop's clock: when it was last told so amid a message */
	struct upload *upload; /* a submission that waits for blobs */
	uint64_t watched;      /* job; 0: none */
	struct fetching {      /* a file of which it has not got all yet */
		uint64_t job;  /* 0: none */
		Farm__What what;
		int fd;
		uint64_t size; /* when it was opened: a log grows */
		double at;     /* s on the loop's clock: its last piece */
	} fetch;
	uint64_t wants_preview;		/* job whose preview is being made for it; 0: none */
	struct job_view *shown;		/* what the watcher saw last */
	struct held *held, **held_last; /* what waits until the jobs are read */
	size_t held_bytes;
	double told;	    /* s on the loop's clock: that we are here, meanwhile */
	char rejected[256]; /* why the core refused; "" it did not */
};

/* All sessions, and what limits all of them together. */
struct peers {
	struct jobs *jobs;
	struct tls *tls;   /* NULL: plaintext */
	uv_tcp_t listener; /* its loop is the jobs' */
	struct session *sessions, *by_id[SESSION_BUCKETS];
	unsigned session_count, fetches;
	size_t held_bytes; /* of what they ask for while jobs are read */
	uint64_t last_peer;
	uint64_t garbled;  /* connections on which bytes were changed */
	bool caller_waits; /* nobody could be let in: to be tried again */
};

struct session *peers_find(const struct peers *s, uint64_t id); /* NULL: it has gone */
void peers_enlist(struct peers *s, struct session *p);
void peers_delist(struct peers *s, struct session *p); /* its connection has closed */

void session_send(struct session *p, const Farm__Envelope *m, const void *payload, size_t size);
/* Says why and hangs up. */
__attribute__((format(printf, 2, 3))) void session_fault(struct session *p, const char *format, ...);

#endif
