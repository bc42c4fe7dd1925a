/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One peer's conversation: hello, then as a worker or as a client. Limits depend on where the conversation is. The
 * session belongs to its connection and goes with it.
 */
#ifndef COORDINATOR_SHELL_SESSION_H
#define COORDINATOR_SHELL_SESSION_H

#include "coordinator/shell/extend.h"
#include "coordinator/shell/server.h"

enum session_state { SESSION_NEW, SESSION_WORKER, SESSION_CLIENT, SESSION_LEAVING };

struct upload;
struct worker_request;

struct session {
	struct session *next, **place; /* all; where they point to this one */
	struct session *alike;	       /* of the same bucket */
	struct server *server;
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
	uint64_t wants_preview; /* job whose preview is being made for it; 0: none */
	struct job_view *shown; /* what the watcher saw last */
	struct extension wants; /* not answered yet: it waits until the job's films are free, or read; job 0: none */
	struct session *behind; /* of those that wait for that */
	struct held *held, **held_last; /* what waits until the jobs are read */
	size_t held_bytes;
	double told;	       /* s on the loop's clock: that we are here, meanwhile */
	char rejected[256];    /* why the core refused; "" it did not */
	uint64_t answered_job; /* SUBMITTED or CANCELLED came for it */
};

void session_accept(struct server *s);
struct session *session_find(const struct server *s, uint64_t id);
void session_send(struct session *p, const Farm__Envelope *m, const void *payload, size_t size);
/* What the peer says. May take the envelope. */
void session_message(struct session *p, struct envelope *env, const unsigned char *payload, size_t size);
/* Says why and hangs up. */
__attribute__((format(printf, 2, 3))) void session_fault(struct session *p, const char *format, ...);

/* Results of this job may come from now on, and they may be so long. */
void session_allow_results(struct session *p, const struct live_job *o);

/* What the core wants said to workers. */
/* A lease that a worker could not do; p is one. */
void session_lease_failed(struct session *p, const Farm__LeaseFailed *f);
void session_send_lease(struct session *p, const struct live_job *o, const struct lease_key *k,
			bool anew); /* with seeds */
void session_send_revoke(struct session *p, const struct lease_key *k);
void session_send_ack(struct session *p, const struct lease_key *k, enum ack ack, const char *text);
void session_send_job_end(struct session *p, uint64_t job);

/* Watchers hear of what changed. */
void session_tick(struct session *p);

/* client.c */
/* false: no such job for this client, who sees the own jobs alone. */
bool session_finds_job(const struct session *p, uint64_t job, struct job_view *v);
void session_send_done(struct session *p, const char *text); /* p->rejected says why not; text: what was done, or "" */
/* -EDQUOT. job: 0, or one that is there already. */
int session_within_quota(const struct session *p, uint64_t job, const struct plan *plan, const Farm__Submit *m,
			 struct error *e);
/* control.c */
void session_cancel(struct session *p, uint64_t job);
void session_control(struct session *p, const Farm__Control *c);

/* client.c again */
void session_client_message(struct session *p, struct envelope *env, const unsigned char *payload, size_t size);
void session_upload_abort(struct session *p);
/* fetch.c */
void session_fetch(struct session *p, const Farm__Fetch *f);
void session_fetch_end(struct session *p);
/* The order's canvas is free, or the order has ended: who waits for its preview gets it, or it is made now. */
void session_previews(struct server *s, uint64_t job);

#endif
