/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One peer's conversation: hello, then as a worker or as a client. Limits depend on where the conversation is. The
 * session belongs to its connection and goes with it.
 */
#ifndef COORDINATOR_PEERS_SESSION_H
#define COORDINATOR_PEERS_SESSION_H

#include "coordinator/peers/peers.h"

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
	struct fetch {	       /* a file of which it has not got all yet */
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

extern const struct conn_events session_events; /* user: the session */

void session_send(struct session *p, const Farm__Envelope *m, const void *payload, size_t size);
/* What the peer says. May take the envelope. */
void session_message(struct session *p, struct envelope *env, const unsigned char *payload, size_t size);
/* Says why and hangs up. */
__attribute__((format(printf, 2, 3))) void session_fault(struct session *p, const char *format, ...);

#endif
