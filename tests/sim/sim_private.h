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
	QUEUE_MAX = 64,
	MESSAGES_MAX = 1 << 14,
	SIM_STEPS_MAX = 400000,
	HOARDED_THREADS = 4096 /* threads that a hoarding worker claims to have */
};

enum sim_message_kind {
	TO_CORE,
	TICK,
	SUBMIT,
	LEASE,
	REVOKE,
	FINISH,
	WORKER_HEARTBEAT,
	CRASH,
	START,
	CALM,
	RESTART,
	ORDER
};

struct sim_message {
	double time;
	uint64_t order;
	enum sim_message_kind kind;
	uint32_t worker;
	uint64_t peer;
	struct event ev; /* for TO_CORE */
	struct lease_key key;
	uint64_t value; /* chain state: the input of a LEASE, the output of a batch */
};

struct sim_work {
	struct lease_key key;
	uint64_t state;
};

struct sim_worker {
	uint64_t peer; /* 0: down */
	uint32_t threads, busy_threads, queued, wanted;
	double speed, frozen_until;
	double invalid_rate, failure_rate, lie_rate;
	bool is_hoarding; /* takes leases and never answers them, until the world is calm */
	const char *fingerprint;
	struct sim_work queue[QUEUE_MAX];
};

struct sim_job {
	struct plan plan;
	uint64_t id;
	int priority;
	bool mixed, submitted, ended, prepared;
	double verify;
	uint32_t answered_by[SLOTS];	 /* by slot: bits of the workers whose answers the core has noted */
	bool held[JOB_HOLD_COUNT], done; /* done: it has ended successfully, and may be extended */
	double elapsed_seconds;		 /* at its end */
	double cancel_at, lease_seconds, error_scale;
	uint64_t next[SLOTS], state[SLOTS], bootstrap_slots;
	uint64_t round_sum[ROUNDS];
	uint64_t rounds;	  /* number of complete rounds, counted here */
	double completed_seconds; /* from its first lease to its last complete round */
	char fingerprint[2];	  /* of the workers whose results are merged */
	double last_progress;
};

struct sim_world {
	uint64_t seed, draw_count, order, next_peer;
	int trace;
	double now, calm_from, tick_at;
	double drop_rate, repeat_rate, max_delay, failure_rate;
	double verify;	/* verified fraction of every job */
	bool has_liars; /* some workers lie; then every result is verified, and all workers have one fingerprint */
	struct farm *farm;
	struct farm_config config;
	struct sim_message *message_heap;
	size_t heap_count;
	uint32_t worker_count, job_count, orders_remaining;
	struct sim_worker workers[WORKERS];
	struct sim_job jobs[JOBS];
	struct sim_result result;
	char violation[256];
};

/* sim_chance.c: the random numbers, and the messages under way, in the order of their times. */
uint64_t sim_mix(uint64_t x);
double sim_uniform(struct sim_world *w);
uint32_t sim_uniform_below(struct sim_world *w, uint32_t n);
bool sim_chance(struct sim_world *w, double p);
__attribute__((format(printf, 2, 3))) void sim_report_violation(struct sim_world *w, const char *format, ...);
void sim_push_message(struct sim_world *w, struct sim_message m);
struct sim_message sim_pop_message(struct sim_world *w);
bool sim_is_calm(const struct sim_world *w);
void sim_post_message(struct sim_world *w, struct sim_message m);

/* sim_worker.c */
uint64_t sim_correct_result(struct lease_key k, uint64_t state);
struct sim_job *sim_job_by_id(struct sim_world *w, uint64_t id);
void sim_finish_lease(struct sim_world *w, const struct sim_message *m);
void sim_heartbeat(struct sim_world *w, const struct sim_message *m);
void sim_start_worker(struct sim_world *w, uint32_t index);
void sim_crash_worker(struct sim_world *w, const struct sim_message *m);
void sim_forget_answers(struct sim_world *w);
void sim_calm_down(struct sim_world *w);
void sim_receive_lease(struct sim_world *w, const struct sim_message *m);
bool sim_same_key(struct lease_key a, struct lease_key b);
void sim_receive_revoke(struct sim_world *w, const struct sim_message *m);

/* sim_shell.c: the shell around the core, which checks the core's actions. */
double sim_error_after(const struct sim_job *j, uint64_t rounds);
uint64_t sim_undisturbed_rounds(const struct sim_job *j);
void sim_step(struct sim_world *w, struct event *ev, uint64_t value);

/* sim_orders.c */
void sim_restore_job(struct sim_world *w, struct sim_job *j, double elapsed);
void sim_restart_coordinator(struct sim_world *w);
void sim_give_order(struct sim_world *w); /* gives a random order (hold, release, priority, extend) for a random job */
void sim_release_all_jobs(struct sim_world *w);

#endif
