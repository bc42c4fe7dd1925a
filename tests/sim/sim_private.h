/* SPDX-License-Identifier: Apache-2.0 */
/* The internals of the simulated farm, for sim_*.c: its state, its messages and its actors. One thread. */
#ifndef TESTS_SIM_SIM_PRIVATE_H
#define TESTS_SIM_SIM_PRIVATE_H

#include "coordinator/core/farm.h"
#include "tests/sim/sim_world.h"

#include <stdbool.h>

enum {
	WORKERS = 8,
	JOBS = 5,
	SLOTS = 12,
	ROUNDS = 512,
	QUEUE = 64,
	MESSAGES = 1 << 14,
	STEPS_MOST = 400000,
	HOARD = 4096 /* number of threads that a hoarding worker claims to have */
};

enum message_kind { TO_CORE, TICK, SUBMIT, LEASE, REVOKE, FINISH, BEAT, CRASH, START, CALM, RESTART, ORDER };

struct message {
	double time;
	uint64_t order;
	enum message_kind kind;
	uint32_t worker;
	uint64_t peer;
	struct event ev; /* for TO_CORE */
	struct lease_key key;
	uint64_t value; /* chain state: the input of a LEASE, the output of a batch */
};

struct work {
	struct lease_key key;
	uint64_t state;
};

struct worker {
	uint64_t peer; /* 0: down */
	uint32_t threads, busy, queued, want;
	double speed, frozen_until;
	double fault_rate, failure_rate, lie_rate;
	bool hoards; /* takes leases and never answers them, until the world is calm */
	const char *fingerprint;
	struct work queue[QUEUE];
};

struct sim_job {
	struct plan plan;
	uint64_t id;
	int priority;
	bool mixed, submitted, over, prepared;
	double verify;
	uint32_t answered[SLOTS];   /* by slot: bits of the workers whose answers the core has noted */
	bool held[JOB_HOLDS], done; /* done: it has ended successfully, and may be extended */
	double elapsed;		    /* seconds at its end */
	double cancel_at, lease_time, error_scale;
	uint64_t next[SLOTS], state[SLOTS], boot;
	uint64_t round_sum[ROUNDS];
	uint64_t rounds;     /* number of complete rounds, counted here */
	double completed;    /* seconds from its first lease to its last complete round */
	char fingerprint[2]; /* of the workers whose results are merged */
	double progress;
};

struct world {
	uint64_t seed, draws, order, next_peer;
	int trace;
	double now, calm, tick_at;
	double drop, repeat, delay, failure;
	double verify; /* verified fraction of every job */
	bool liars;    /* some workers lie; then every result is verified, and all workers have one fingerprint */
	struct farm *farm;
	struct farm_config config;
	struct message *heap;
	size_t heap_count;
	uint32_t worker_count, job_count, orders_left;
	struct worker workers[WORKERS];
	struct sim_job jobs[JOBS];
	struct sim_result result;
	char wrong[256];
};

/* sim_chance.c: the random numbers, and the messages under way, in the order of their times. */
uint64_t sim_mix(uint64_t x);
double sim_uniform(struct world *w);
uint32_t sim_below(struct world *w, uint32_t n);
bool sim_chance(struct world *w, double p);
__attribute__((format(printf, 2, 3))) void sim_wrong(struct world *w, const char *format, ...);
void sim_push(struct world *w, struct message m);
struct message sim_pop(struct world *w);
bool sim_is_calm(const struct world *w);
void sim_post(struct world *w, struct message m);

/* sim_worker.c */
uint64_t sim_result_of(struct lease_key k, uint64_t state);
struct sim_job *sim_job_by_id(struct world *w, uint64_t id);
void sim_finish(struct world *w, const struct message *m);
void sim_beat(struct world *w, const struct message *m);
void sim_start(struct world *w, uint32_t index);
void sim_crash(struct world *w, const struct message *m);
void sim_forget_answers(struct world *w);
void sim_calm_down(struct world *w);
void sim_receive_lease(struct world *w, const struct message *m);
bool sim_same_key(struct lease_key a, struct lease_key b);
void sim_receive_revoke(struct world *w, const struct message *m);

/* sim_shell.c: the shell around the core, which checks the core's actions. */
double sim_error_after(const struct sim_job *j, uint64_t rounds);
uint64_t sim_undisturbed_rounds(const struct sim_job *j);
void sim_step(struct world *w, struct event *ev, uint64_t value);

/* sim_orders.c */
void sim_restore(struct world *w, struct sim_job *j, double elapsed);
void sim_restart(struct world *w);
void sim_order(struct world *w); /* gives a random order (hold, release, priority, extend) for a random job */
void sim_release_all(struct world *w);

#endif
