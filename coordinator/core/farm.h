/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's core: a pure state machine. No I/O, clock, threads; time is a field of the event.
 * One thread at a time. Allocates when a worker joins or a job is submitted, never later: those two can be refused, so
 * a step cannot fail. Memory: O(groups x parts) per live job, O(leases held) per worker, nothing per merged lease.
 *
 * Rules (each has a transcript in tests/coordinator/core):
 *  - A batch is merged iff its (job, kind, group, part, epoch) is open, not merged yet, its content is valid and its
 *    sender has the job's fingerprint, whoever holds the lease by now. A repeat is counted and dropped.
 *  - Epoch e + 1 of a (group, part) opens when its epoch e is merged and round e + 1 is at most one ahead of the first
 *    incomplete round: two rounds are open.
 *  - Higher priority first; among equals the owner with the fewest leases out in all, of its jobs that with the fewest,
 * then the older one. An owner is a name of a certificate; jobs without one are all one owner's, for a name that
 * anybody can call himself would be worth as many shares as he likes.
 *  - A job belongs to the fingerprint of its first worker (again free while nothing is merged and no lease is out).
 *  - A lease goes back to the pool when its holder leaves, is silent, fails or returns it. After 10 x the job's median
 *    lease time (at least 60 s; doubled each time for the same lease) it is handed out again, the first answer wins.
 *    A worker without other work gets a second copy of a lease of the first incomplete round that takes longer
 *    than 1.5 medians; never more than two workers are on one lease otherwise. While the job has no median, which is so
 * as long as nobody has answered, that is after 30 s (leases are made to take about 20), and of two copies that are
 * both out the older one is given up after 120 s for a worker that has nothing else to do.
 *  - What a worker holds at once is bounded by what it has given: 8 leases at first, twice as many after each that is
 * merged, half as many (1 at least) after each that was out for too long or that somebody else answered who got it
 * later. A node of 64 threads holds all it wants after its first four.
 *  - Invalid content is its sender's fault; after three faults in a row the worker gets no more leases.
 *    A failed lease is tried elsewhere; its worker, whatever its connection, waits 10, 20, 40 ... 640 s before it gets
 * more of this job; what it fails with meanwhile is the same failure.
 *  - The job fails when one lease failed on three workers, of three certificates where the farm knows as many
 * (failers.h): one worker never ends a job of which something is made, it waits for others, or for that one to mend.
 * While nothing was merged or noted the job fails, too, when any leases of it failed on three such workers, or on all
 * that are here and three times. What a worker lays to its own machine (a full disk) makes it pause and counts for none
 * of this: where all that are here say so the job waits, and its status names them.
 *  - A worker that goes while it holds a lease is on that lease's list (lost.h): when it calls again it may say that
 * the lease ended it, and that is a failure like any. Those who never call again count only when eight in a row held
 * the same lease. The owner of a job that ended workers gets one lease at a time for a while, of all his jobs that
 * nothing has been made of.
 *  - Of a job that is verified a share of the leases is computed by two workers, of two identities (worker registry.h)
 * and one fingerprint. The first answer is noted; one that equals another worker's is merged; where two differ a third
 *    decides, and a fourth; then the job fails. Who said otherwise than two that agree has given a wrong result.
 *  - A worker is set aside for good, by identity, after three faults in a row or three wrong results. Nothing that it
 * sends counts any more, and no failure of a job is laid to its wrong results.
 *  - A worker that calls again, in the same life or a later one of the same home, takes the place of its old
 * connection.
 *  - A job of an earlier life goes on where its merged leases say that it was; leases that were out then count when
 * their results come, as any do. A bound that its last complete round had met, or a look at its error, is not
 * forgotten.
 *  - A job may get other bounds while it lives; one that has ended goes on as one of an earlier life does, under its
 * id. Neither changes what its leases compute.
 *  - A job that is held gets no leases out; results that come are merged, and its clock stands still.
 *  - Bounds are tested after complete rounds only. The target error is evaluated when merge_error_due() says so, as
 *    hslt-render does, and when another bound ends the job. From the end on nothing is merged: the image is exactly the
 *    prefix that met the bound, and depends on workers and order only if the bound is a time.
 */
#ifndef COORDINATOR_CORE_FARM_H
#define COORDINATOR_CORE_FARM_H

#include "common/estimate/forecast.h"
#include "coordinator/core/event.h"
#include "coordinator/core/update.h"

enum { FARM_JOBS = 256 /* that live at once, unless told otherwise */ };

struct farm_config {
	uint64_t first_job; /* ids from here on, counted up, never reused */
	uint32_t max_jobs;  /* not ended; those of an earlier life may be more */
	uint32_t max_ended; /* remembered for status; at least 1 */
	uint32_t max_peers;
	uint32_t max_peer_leases; /* held by one worker */
	uint32_t max_slots;	  /* groups x parts of one job */
	uint32_t max_faults;	  /* of a worker in a row; wrong results in all */
	uint64_t verify_seed;	  /* of the choice of leases that are verified: what no worker knows */
	double silent_after;	  /* s without a word: leases taken back */
	double forget_after;	  /* s without a word: hung up */
	double first_timeout;	  /* of a lease before the job has a median */
	double first_copy;	  /* before the job has a median: a worker without other work gets a second copy then */
	double idle_timeout; /* and the older of two copies is given up then, doubled each time for the same lease */
	double min_timeout;
	double first_pause; /* of a worker that failed with a job, doubled each time */
};
void farm_config_init(struct farm_config *c); /* first_job 1 and sane limits */

struct farm;
int farm_new(struct farm **f, const struct farm_config *c, struct error *e); /* -EINVAL, -ENOMEM */
void farm_free(struct farm *f);
void farm_step(struct farm *f, const struct event *ev, struct update *u);

/* Questions, for status. Pointers inside are valid until the next step. */
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

enum peer_state { PEER_ACTIVE, PEER_SILENT, PEER_ASIDE };
struct peer_status {
	uint64_t id;
	uint64_t who; /* the same for each of its connections */
	uint64_t restarts;
	const char *name, *fingerprint;
	uint32_t threads, want, leases;
	enum peer_state state;
	double joined, heard;
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
enum farm_delivery { DELIVERY_AWAITED, DELIVERY_OPEN, DELIVERY_USELESS };
enum farm_delivery farm_awaits(const struct farm *f, uint64_t peer, const struct lease_key *k);
/* What is known of a worker, here or not. */
struct worker_status {
	uint64_t who, restarts;
	const char *certificate, *name, *home, *text;
	uint32_t wrong; /* results */
	bool aside;
};
/* Who made the chain states that go with this lease, for the log; "?": it is not the next one of its group and part. */
const char *farm_maker(const struct farm *f, const struct lease_key *k);
/* The smallest id above `after` (start with 0) of those that are set aside; 0: no more. */
uint64_t farm_next_quarantined(const struct farm *f, uint64_t after);
bool farm_worker(const struct farm *f, uint64_t who, struct worker_status *s);	    /* false: unknown */
bool farm_job(const struct farm *f, uint64_t id, double now, struct job_status *s); /* false: unknown */
bool farm_counts(const struct farm *f, uint64_t id, struct job_counts *c);	    /* false: unknown */
/* s since the job's first lease, less those that it was held; NAN: none yet, unknown */
double farm_elapsed(const struct farm *f, uint64_t id, double now);
bool farm_peer(const struct farm *f, uint64_t id, struct peer_status *s);
bool farm_lease(const struct farm *f, uint64_t peer, uint32_t i, struct lease_status *s); /* i-th lease of a worker */

bool job_state_is_end(enum job_state s);
const char *job_state_name(enum job_state s); /* as in the status: "queued" ... */
const char *job_end_name(enum job_end e);     /* "mutations" ... */
/* Of a program that waited for the job: 0 done, 3 failed or cancelled, 5 its chains disagree, 4 a bound came before the
 * target error: the first of them that holds. */
int job_exit_code(const struct job_status *s);

#endif
