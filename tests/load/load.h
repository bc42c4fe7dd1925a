/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A farm under load: the real coordinator in a process of its own, its real protocol over TLS, and workers that render
 * nothing: they say hello, fetch the job's files, ask for leases, wait as long as a lease would take, and send a batch
 * that was made once. One process, one thread, one loop for all of them. What goes wrong in the generator itself ends
 * it.
 */
#ifndef TESTS_LOAD_LOAD_H
#define TESTS_LOAD_LOAD_H

#include "common/net/conn.h"
#include "common/wire/batch_wire.h"

#include <stdbool.h>

/* What becomes of a worker, from the last ones of the crowd on. */
enum load_kind {
	LOAD_HONEST,
	LOAD_DIES,   /* in a third of its leases: hangs up without a word, and calls again */
	LOAD_LIES,   /* every result holds what is no number */
	LOAD_HOARDS, /* claims 4,096 threads, takes what it gets, and says nothing but heartbeats */
	LOAD_HANGS,  /* in a third of its leases: says nothing more, not even heartbeats; when it is disconnected it
			connects again */
	LOAD_KINDS
};

struct load_settings {
	unsigned bad[LOAD_KINDS];			      /* how many; LOAD_HONEST is the rest */
	unsigned workers, width, height, groups, parts, jobs; /* jobs 0: as many as keep all of them busy */
	double minutes, interval, ramp;			      /* s between a worker's batches; connections a second */
	double heartbeat;
	unsigned want;	       /* leases that a worker holds: one in work, the others at hand */
	bool insecure, losses; /* losses: nothing else is judged */
	const char *bin, *spool, *options;
};

/* ---- what was measured ---- */

struct load_times { /* ms */
	float *v;
	size_t count, room;
};
void load_times_add(struct load_times *t, double ms);
double load_times_at(struct load_times *t, double share); /* sorts; NAN: none */

/* ---- content: one batch of each kind, sent under every key ---- */

struct load_content;
struct load_content *load_content_new(const struct plan *p);
void load_content_free(struct load_content *c);
size_t load_content_bytes(const struct load_content *c); /* a render batch's payload */
unsigned char *load_content_frame(const struct load_content *c, const struct lease_key *k, size_t *size);

/* ---- the crowd ---- */

struct load_worker;
struct load_job {
	uint64_t id;
	struct plan plan;
	bool known; /* a JobInfo with its plan has come */
	struct blob_file {
		unsigned char hash[32];
		uint64_t size;
	} file;
	uint64_t *acknowledged; /* [slot]: epochs of it that were; a bit beyond for each out of order is an error */
};

struct load {
	struct load_settings s;
	uv_loop_t loop;
	struct net_addr address;
	struct tls *tls;
	struct load_content *content;
	struct load_job *jobs;
	unsigned job_count;
	struct load_worker *workers;
	unsigned connecting, connected, closed; /* closed: against our will */
	bool measuring, leaving;
	uint64_t random;
	/* counted from the first to the last moment */
	uint64_t grants, again, merged, bootstrap_merged, repeated, refused, revoked, given_back, disordered, faults;
	uint64_t deaths, lies, lies_refused, lies_merged, hoarded, hangs;
	/* counted while measuring */
	uint64_t batches, bytes;
	struct load_times grant, first_grant, ack, send, beat, late;
	char fault[256]; /* the first one */
};

double load_now(void);				      /* s */
double load_uniform(struct load *l);		      /* [0,1) */
struct load_worker *load_workers_new(unsigned count); /* NULL: no memory */
void load_connect(struct load *l, unsigned index);
/* No more leases; what is being worked on is given back, what was sent is waited for. */
void load_leave(struct load *l);
unsigned load_unanswered(const struct load *l); /* results that were sent and not acknowledged */
void load_close(struct load *l);

/* ---- the coordinator, its certificates and jobs ---- */

void load_die(const char *format, ...) __attribute__((format(printf, 1, 2), noreturn));
/* Submits a job as a client would; fills in its id. */
void load_submit(struct load *l, const char *host_port, const char *tls, unsigned index);
/* Mutations that the coordinator has counted for the job, by the status socket. */
double load_counted(const struct load *l, const char *socket, uint64_t job);

#endif
