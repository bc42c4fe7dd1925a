/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A farm under load: the real coordinator in a process of its own, the real protocol over TLS, and workers that do not
 * render: they say hello, fetch the job's files, ask for leases, wait as long as a lease would take, and send a batch
 * that was made once. One process, one thread and one loop for all workers. An error in the generator itself ends it.
 */
#ifndef TESTS_LOAD_LOAD_H
#define TESTS_LOAD_LOAD_H

#include "common/net/conn.h"
#include "common/wire/batch_wire.h"

#include <stdbool.h>

/* What a worker does. Those that misbehave are the last ones of the crowd. */
enum load_behaviour {
	LOAD_HONEST,
	LOAD_DYING,    /* in a third of its leases it hangs up without a word, and connects again */
	LOAD_LYING,    /* every result contains values that are not numbers */
	LOAD_HOARDING, /* claims 4,096 threads, takes the leases that it gets, and sends only heartbeats */
	LOAD_HANGING,  /* in a third of its leases it falls silent, without heartbeats; once disconnected it connects
			* again */
	LOAD_BEHAVIOURS
};

struct load_settings {
	unsigned misbehaving[LOAD_BEHAVIOURS]; /* number of workers of each kind; LOAD_HONEST: all others */
	unsigned workers, width, height, groups, parts, jobs;	  /* jobs: 0: as many as keep all workers busy */
	double minutes, interval_seconds, connections_per_second; /* interval_seconds: between batches */
	double heartbeat_seconds;
	unsigned leases_per_worker; /* leases that a worker holds: one in work, the others waiting */
	bool insecure, only_losses; /* only_losses: only lost and wrong results are judged */
	const char *bin, *spool, *coordinator_options;
};

/* ---- measurements ---- */

struct load_times { /* ms */
	float *ms;
	size_t count, capacity;
};
void load_times_add(struct load_times *t, double ms);
double load_times_quantile(struct load_times *t, double fraction); /* sorts; NAN: there are none */

/* ---- content: one batch of each kind, sent under every key ---- */

struct load_content;
struct load_content *load_content_new(const struct plan *p);
void load_content_free(struct load_content *c);
size_t load_content_payload_bytes(const struct load_content *c); /* payload of the result of a render lease */
unsigned char *load_content_frame(const struct load_content *c, const struct lease_key *k, size_t *size);

/* ---- the crowd ---- */

struct load_worker;
struct load_job {
	uint64_t id;
	struct plan plan;
	bool has_plan; /* a JobInfo with its plan has arrived */
	struct blob_file {
		unsigned char hash[32];
		uint64_t size;
	} file;
	uint64_t *acknowledged_epochs; /* [slot]: epochs acknowledged so far; one out of order counts in out_of_order */
};

struct load {
	struct load_settings settings;
	uv_loop_t loop;
	struct net_addr address;
	struct tls *tls;
	struct load_content *content;
	struct load_job *jobs;
	unsigned job_count;
	struct load_worker *workers;
	unsigned connecting, connected_count, disconnected; /* disconnected: by the coordinator, unexpectedly */
	bool is_measuring, is_leaving;
	uint64_t random;
	/* counted from start to end */
	uint64_t grants, granted_again, merged, bootstrap_merged, repeated, refused, revoked, returned, out_of_order,
		faults;
	uint64_t deaths, lies, lies_refused, lies_merged, hoarded, hangs;
	/* counted only while measuring */
	uint64_t batches, bytes;
	struct load_times grant_times, first_grant_times, ack_times, send_times, heartbeat_times, timer_delays;
	char first_fault[256];
};

double load_now(void);				      /* s */
double load_uniform(struct load *l);		      /* [0,1) */
struct load_worker *load_workers_new(unsigned count); /* NULL: out of memory */
void load_connect(struct load *l, unsigned index);
/* Asks for no more leases; gives back those in work, and waits for the acknowledgement of sent results. */
void load_wind_down(struct load *l);
unsigned load_unacknowledged_count(const struct load *l); /* results that were sent and are not acknowledged */
void load_disconnect_all(struct load *l);

/* ---- the coordinator, its certificates and jobs ---- */

void load_die(const char *format, ...) __attribute__((format(printf, 1, 2), noreturn));
/* Submits a job as a client would, and sets its id. */
void load_submit(struct load *l, const char *host_port, const char *tls, unsigned index);
/* Returns the mutations that the coordinator has counted for the job, from the status socket. */
double load_counted_mutations(const struct load *l, const char *socket, uint64_t job);

#endif
