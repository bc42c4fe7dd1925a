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
	/* Limits on the bytes of a message without its payload: before hello, and after it. */
	SESSION_HELLO_HEADER_MAX = 4096,
	SESSION_HEADER_MAX = 1 << 20,
	/* Limits on the bytes that may wait for a peer to read them: before hello (an error), and after it (answers).
	 * For a worker, the size of the leases that it may hold is added. */
	SESSION_HELLO_SEND_MAX = 1 << 16,
	SESSION_SEND_MAX = 1 << 23,
};

enum session_state { SESSION_NEW, SESSION_WORKER, SESSION_CLIENT, SESSION_LEAVING };

struct upload;
struct worker_request;

struct session {
	LIST_ENTRY(session) next;	  /* in the list of all sessions */
	LIST_ENTRY(session) bucket_entry; /* in the hash bucket of its id */
	struct peers *peers;
	struct jobs *jobs;
	struct conn *conn;
	uint64_t id; /* the core's id of the peer, and the tag of its orders */
	enum session_state state;
	bool is_known_to_core; /* the core knows the peer */
	char name[128], address[64];
	/* Name and role in its certificate; TLS_NO_ROLE without TLS, in which case it may do everything. */
	struct tls_peer tls_peer;
	uint32_t payload_limit;
	size_t max_lease_bytes; /* bytes of as many leases as the worker wants */
	/* Requests that wait until the worker has read what was sent, or until a file has been checked. */
	STAILQ_HEAD(, worker_request) requests;
	unsigned request_count;
	/* s of the loop's clock: when the last heartbeat was sent during a long message. */
	double partial_heartbeat_at;
	struct upload *upload;	     /* the submission that is being received; NULL: none */
	size_t submit_message_bytes; /* bytes of the submission's message */
	uint64_t watched_job;	     /* job being watched; 0: none */
	struct {
		uint64_t job;
		double notified_at; /* s of the loop's clock: when the client was told */
	} ended_watch;		    /* the watched job whose end the client has been told: it will fetch the result */
	struct file_fetch {	    /* a file that the client is receiving */
		uint64_t job;	    /* 0: none */
		Farm__What file_kind;
		int fd;
		uint64_t size;	/* size of the file when it was opened; a log may grow */
		double sent_at; /* s of the loop's clock: when the last chunk was sent */
	} fetch;
	uint64_t preview_job;			       /* job whose preview the client waits for; 0: none */
	struct job_view *last_sent_status;	       /* status last sent to the client that watches */
	STAILQ_HEAD(, queued_request) queued_requests; /* requests that wait, see request_queue.h */
	size_t queued_request_bytes;
	/* Number of the client's last request, in the order of the requests of all sessions; clients with lower
	 * numbers come first. */
	uint64_t turn_number;
	double waiting_heartbeat_at; /* s of the loop's clock: when the last heartbeat was sent to the waiting peer */
};

/* All sessions, and their common limits. */
struct peers {
	struct jobs *jobs;
	struct tls *tls;		/* NULL: plaintext */
	struct listener {		/* listening sockets, on the loop of the jobs */
		uv_tcp_t tcp;		/* first member, so that libuv's pointer to it is one to the listener */
		bool is_accept_pending; /* a connection could not be accepted; try again at the next tick */
	} listeners[NET_ADDRS_MAX];
	unsigned listener_count;
	LIST_HEAD(, session) sessions;
	LIST_HEAD(, session) buckets[SESSION_BUCKETS];
	uv_idle_t lookup_idle; /* runs while submissions look for their files */
	unsigned session_count, fetch_count;
	size_t queued_request_bytes;
	uint64_t last_turn_number;   /* number of requests of clients so far */
	double request_ms_this_tick; /* ms that requests of clients have taken since the last tick */
	size_t submit_message_bytes; /* bytes of the messages of all submissions being received */
	struct receive_pool receive_pool;
	struct send_pool send_pool;
	uint64_t last_peer_id;
	uint64_t bad_checksum_count; /* connections closed because of a wrong checksum */
};

struct session *peers_find_session(const struct peers *s, uint64_t id); /* NULL: no such session */
void peers_add_session(struct peers *s, struct session *p);
void peers_remove_session(struct peers *s, struct session *p); /* call when its connection has closed */

/* Sends a Fault with the reason and closes the connection. */
__attribute__((format(printf, 2, 3))) void session_fault(struct session *p, const char *format, ...);

#endif
