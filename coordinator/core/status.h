/* SPDX-License-Identifier: Apache-2.0 */
/* What is asked of a farm. Pointers inside are valid until its next step. Nothing here changes it. */
#ifndef COORDINATOR_CORE_STATUS_H
#define COORDINATOR_CORE_STATUS_H

#include "common/estimate/forecast.h"
#include "coordinator/core/event.h"
#include "coordinator/core/update.h"

struct farm;

struct job_status {
	uint64_t id;
	const char *name, *owner;
	int priority;
	bool mixed;
	double verify;
	const struct plan *plan;
	enum job_state state;
	enum job_end end;
	const char *fingerprint;	  /* "" while it belongs to none */
	double submitted, started, ended; /* started: the first lease sent; NAN when it has not come yet */
	double progress;		  /* [0,1], never falls */
	double rate;		  /* merged mutations (bootstrap: samples) a second, over the last half minute */
	double eta;		  /* s; NAN: unknown */
	bool disagrees;		  /* the chains of its final image do */
	double eta_low, eta_high; /* its 90 % interval */
	double rel_error;	  /* last evaluated; NAN: none */
	uint64_t rel_error_rounds;
	double bootstrap_seconds;	      /* wall clock from the first lease to the first round; NAN: not yet */
	const struct forecast_history *looks; /* at the error, oldest first */
	struct forecast_range error_now;      /* these three only where there are looks */
	struct forecast_range halving_cpu, halving_seconds;  /* what it costs from now on to halve the error */
	uint64_t rounds;				     /* complete */
	uint64_t bootstrap_merged, leases_merged, mutations; /* leases_merged: render leases, open rounds too */
	uint32_t leases_out;
	uint32_t workers, machines; /* that hold its leases, that might */
	double share;		    /* machines that it would have by its priority: coordinator/core/share.h */
	char place[160];	    /* both, and who comes first */
	struct job_counts counts;
	char text[256];				     /* why it failed, or the last failure of a lease */
	char waiting[256];			     /* why nothing is being done for it; "" when something is */
	char owners_place[160], owners_waiting[256]; /* for its owner: without the ids of other owners' jobs */
};

struct peer_status {
	uint64_t id;
	uint64_t who; /* the same for each of its connections */
	uint64_t restarts;
	const char *name, *fingerprint;
	uint32_t threads, want, leases;
	enum peer_state state;
	double joined, last_seen;
	uint64_t merged, repeats, refused, faults, failures, timeouts;
	char text[256]; /* its last fault or failure */
};

struct lease_status {
	struct lease_key key;
	uint64_t peer;
	double sent, deadline;
	bool overdue; /* handed out again; an answer still counts if it is the first */
};

/* The smallest id above `after` (start with 0); 0: no more. */
uint64_t farm_next_peer(const struct farm *f, uint64_t after);
/* A result of this lease must come with its digest. */
bool farm_verifies(const struct farm *f, const struct lease_key *k);
/* Is a result of this lease that cannot be looked at yet worth keeping? Awaited: the worker holds the lease and has not
 * delivered one (EVENT_DELIVERED). Open: it might be merged, and the worker may have held the lease before it called
 * again. Useless: EVENT_BATCH says why, whatever is in it. */
enum farm_delivery farm_awaits(const struct farm *f, uint64_t peer, const struct lease_key *k);
/* What is known of a worker, here or not. */
struct worker_status {
	uint64_t who, restarts;
	const char *certificate, *name, *home, *text;
	uint32_t wrong; /* results */
	bool quarantined;
};
/* Who made the chain states that go with this lease, for the log; "?": it is not the next one of its group and part. */
const char *farm_maker(const struct farm *f, const struct lease_key *k);
/* The smallest id above `after` (start with 0) of those that are quarantined; 0: no more. */
uint64_t farm_next_quarantined(const struct farm *f, uint64_t after);
bool farm_worker(const struct farm *f, uint64_t who, struct worker_status *s);	    /* false: unknown */
bool farm_job(const struct farm *f, uint64_t id, double now, struct job_status *s); /* false: unknown */
bool farm_counts(const struct farm *f, uint64_t id, struct job_counts *c);	    /* false: unknown */
/* s since the job's first lease, less those that it was held; NAN: none yet, unknown */
double farm_elapsed(const struct farm *f, uint64_t id, double now);
bool farm_peer(const struct farm *f, uint64_t id, struct peer_status *s);
bool farm_lease(const struct farm *f, uint64_t peer, uint32_t i, struct lease_status *s); /* i-th lease of a worker */

const char *job_state_name(enum job_state s); /* as in the status: "queued" ... */
const char *job_end_name(enum job_end e);     /* "mutations" ... */
/* Of a program that waited for the job: 0 done, 3 failed or cancelled, 5 its chains disagree, 4 a bound came before the
 * target error: the first of them that holds. */
int job_exit_code(const struct job_status *s);

#endif
