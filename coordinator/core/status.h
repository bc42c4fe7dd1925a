/* SPDX-License-Identifier: Apache-2.0 */
/* Questions about a farm. Nothing here changes it. Pointers in the answers are valid until the farm's next step. */
#ifndef COORDINATOR_CORE_STATUS_H
#define COORDINATOR_CORE_STATUS_H

#include "common/estimate/forecast.h"
#include "coordinator/core/event.h"
#include "coordinator/core/update.h"

struct farm;

/* State of a job. The members that the macros below add are the BY_CORE fields of job_fields.h. */
struct job_status {
	uint64_t id;
	const char *owner;
	const struct plan *plan;
	enum job_state state;
	enum job_end end;
	const char *fingerprint;		   /* "": not pinned */
	double submitted_at, started_at, ended_at; /* s; started_at: when the first lease was sent. NAN: not yet */
	bool chains_disagree;			   /* the chains of its final image disagree */
	double rel_error;			   /* as last estimated; NAN: no estimate */
	const struct forecast_history *looks;	   /* estimates of the error, oldest first */
	/* Cost of halving the error: CPU seconds and seconds; valid if there are estimates. */
	struct forecast_range halving_cpu, halving_seconds;
	uint64_t bootstrap_merged;
	struct job_counts counts;
#define BY_CORE(member) member;
#define BY_JOBS(member)
#define TEXT(member, size, in, by, key, shown, wire) by(char member[size])
#define NUMBER(kind, member, in, by, key, shown, wire) by(field_##kind member)
#define COUNT(member, by, key, shown, wire) by(uint64_t member)
	JOB_FIELDS(TEXT, NUMBER, COUNT, JOB_NO_FIELD)
#undef BY_CORE
#undef BY_JOBS
#undef TEXT
#undef NUMBER
#undef COUNT
};

struct peer_status {
	uint64_t id;
	uint64_t worker_id; /* the worker's identity: equal for all of its connections */
	uint64_t restarts;
	const char *name, *fingerprint;
	uint32_t threads, wanted_leases, held_leases;
	enum peer_state state;
	double joined_at, last_seen;
	uint64_t merged, repeats, refused, faults, failures;
	char last_fault[256]; /* the worker's last fault or failure */
};

struct lease_status {
	struct lease_key key;
	double sent_at;
	bool is_overdue; /* handed out again; this worker's answer still counts if it is the first */
};

/* Returns the smallest id of a connected worker above `after` (start with 0); 0: no more. */
uint64_t farm_next_peer(const struct farm *f, uint64_t after);
/* Whether a result of this lease must come with its digest, because the lease is verified. */
bool farm_lease_is_verified(const struct farm *f, const struct lease_key *k);
/* State of a worker, connected or not. */
struct worker_status {
	uint64_t worker_id, restarts;
	const char *certificate, *name, *home, *last_fault;
	uint32_t wrong_results;
	bool is_quarantined;
};
/* Returns the smallest id of a quarantined worker above `after` (start with 0); 0: no more. */
uint64_t farm_next_quarantined(const struct farm *f, uint64_t after);
bool farm_worker_status(const struct farm *f, uint64_t worker_id, struct worker_status *s); /* false: unknown id */
bool farm_job_status(const struct farm *f, uint64_t id, double now, struct job_status *s);  /* false: unknown id */
bool farm_job_counts(const struct farm *f, uint64_t id, struct job_counts *c);		    /* false: unknown id */
/* Seconds since the job's first lease, not counting the time it was held; NAN: no lease was sent yet, or unknown id. */
double farm_job_elapsed(const struct farm *f, uint64_t id, double now);
/* Whether results of this job may arrive: it is neither held by a user nor for its files, and has leases out or is
 * held only because results cannot be stored. Also returns its priority. */
bool farm_job_expects_results(const struct farm *f, uint64_t id, int *priority);
bool farm_peer_status(const struct farm *f, uint64_t id, struct peer_status *s);
/* i-th lease of a worker; false: no more */
bool farm_lease_status(const struct farm *f, uint64_t peer, uint32_t i, struct lease_status *s);

const char *job_state_name(enum job_state s);	/* name in the status: "queued" ... */
const char *peer_state_name(enum peer_state s); /* "active", "silent", "quarantined" */
const char *job_end_name(enum job_end e);	/* "mutations" ... */
/* The exit code of a program that waited for the job; the first that applies of: 3 failed or cancelled, 5 its chains
 * disagree, 4 another bound came before the target error, 0 done. */
int job_exit_code(const struct job_status *s);

#endif
