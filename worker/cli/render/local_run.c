/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `run_phase` gives leases to threads under one lock, and their results are merged in the order in which they finish,
 * which does not affect the sums. After the bootstrap (run_bootstrap) follow rounds; after each,
 * common/estimate/merge.h decides whether the job is done.
 *
 * Fails if a lease fails (the error has its key), if the disk under the canvas does, or if memory is out. The canvas is
 * then freed, because it may contain part of a round.
 */
#include "worker/cli/render/local_run.h"

#include "common/base/clock.h"
#include "common/base/crash.h"
#include "common/base/mem.h"

#include <math.h>
#include <pthread.h>
#include <time.h>

/* What the threads share. The lock protects everything that changes during a phase. */
struct local_state {
	struct local_run *run;
	struct bootstrap *bootstrap;
	uint64_t *seeds;		   /* [groups][chains / groups] */
	struct brightness *brightness_map; /* see render_brightness_map_new */
	struct chain_state **states;	   /* [groups x parts][chains of a lease], after the epoch before */
	enum lease_kind kind;		   /* of the phase */
	uint64_t epoch;			   /* of the phase */
	uint32_t next_lease, lease_count;  /* the next lease of the phase, and their number */
	uint64_t finished_count;	   /* finished leases of all phases, for progress */
	struct timespec begin_time;	   /* of the bootstrap */
	pthread_mutex_t lock;
	int rc; /* of the first lease that failed, with `error` */
	struct error error;
};

struct local_job {
	struct local_state state;
};

static double seconds_since(const struct timespec *begin)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (double)(now.tv_sec - begin->tv_sec) + 1e-9 * (double)(now.tv_nsec - begin->tv_nsec);
}

static bool is_stopped(const struct local_state *c)
{
	return c->run->stop && atomic_load(c->run->stop);
}

static uint32_t lease_chain_count(const struct plan *p, uint32_t part)
{
	if (p->kind != PLAN_CHAINS)
		return 0;
	struct plan_range r = plan_chain_range(p, part);
	return (uint32_t)(r.end - r.begin);
}

static void free_states(struct chain_state *s, uint32_t count)
{
	for (uint32_t i = 0; s && i < count; i++)
		mem_free(s[i].bytes);
	mem_free(s);
}

static void report_progress(struct local_state *c)
{
	struct local_run *r = c->run;
	if (!r->on_progress)
		return;
	uint64_t per_round = (uint64_t)r->plan->groups * r->plan->parts;
	struct local_progress p = {.state = c->kind == LEASE_BOOTSTRAP ? "bootstrap" : "running",
				   .leases_done = c->finished_count,
				   .seconds = seconds_since(&c->begin_time)};
	p.leases_total = r->plan->rounds == UINT64_MAX ? UINT64_MAX : (r->plan->rounds + 1) * per_round;
	if (c->kind == LEASE_RENDER) {
		p.rounds = (double)c->finished_count / (double)per_round - 1;
		p.round_seconds = p.seconds - r->bootstrap_seconds;
	}
	p.rounds_remaining = r->plan->rounds == UINT64_MAX ? INFINITY : (double)r->plan->rounds - p.rounds;
	r->on_progress(r->user, &p);
}

/* Merges the batch, as the coordinator does on a farm. Under the lock. */
static int merge_batch(struct local_state *c, struct batch *b)
{
	const struct plan *p = c->run->plan;
	c->run->cpu_seconds += b->cpu_seconds;
	if (b->key.kind == LEASE_BOOTSTRAP)
		return bootstrap_add(c->bootstrap, b, &c->error);
	int rc = canvas_add(c->run->canvas, b, &c->error);
	if (rc || p->kind != PLAN_CHAINS)
		return rc;
	struct chain_state **at = &c->states[b->key.group * p->parts + b->key.part];
	free_states(*at, b->state_count);
	*at = b->states;
	b->states = NULL;
	b->state_count = 0;
	return 0;
}

static int run_lease(struct local_state *c, uint32_t index)
{
	const struct plan *p = c->run->plan;
	struct lease_key k = {.kind = c->kind, .group = index / p->parts, .part = index % p->parts, .epoch = c->epoch};
	struct lease_input in = {.chain_count = lease_chain_count(p, k.part), .map = c->brightness_map};
	if (p->kind == PLAN_CHAINS && c->kind == LEASE_RENDER) {
		if (c->epoch == 0)
			in.seeds = c->seeds + (size_t)k.group * (p->chains / p->groups) +
				   plan_chain_range(p, k.part).begin;
		else
			in.states = c->states[index];
	}
	struct batch b;
	struct error e;
	enum lease_outcome end;
	int rc = render_lease(c->run->world, p, &k, &in, c->run->stop, &end, &b, &e);
	pthread_mutex_lock(&c->lock);
	if (!rc && end == LEASE_DONE && !c->rc) {
		rc = batch_check(&b, p, &e);
		if (!rc) {
			rc = merge_batch(c, &b);
			e = c->error;
		}
		c->finished_count++;
		report_progress(c);
	}
	if (rc && !c->rc) {
		c->rc = rc;
		c->error = e;
	}
	pthread_mutex_unlock(&c->lock);
	if (end == LEASE_DONE)
		batch_fini(&b);
	return rc;
}

/* Returns the next lease of the phase that is not merged yet; the number of leases if none is left. Under the lock. */
static uint32_t next_unmerged_lease(struct local_state *c)
{
	uint32_t parts = c->run->plan->parts;
	while (c->kind == LEASE_BOOTSTRAP && c->next_lease < c->lease_count &&
	       bootstrap_has_lease(c->bootstrap, c->next_lease / parts, c->next_lease % parts))
		c->next_lease++;
	return c->next_lease < c->lease_count ? c->next_lease++ : c->lease_count;
}

static void *run_leases(void *arg)
{
	struct local_state *c = arg;
	crash_init_thread();
	for (;;) {
		pthread_mutex_lock(&c->lock);
		uint32_t i = c->rc || is_stopped(c) ? c->lease_count : next_unmerged_lease(c);
		pthread_mutex_unlock(&c->lock);
		if (i == c->lease_count || run_lease(c, i))
			return NULL;
	}
}

/* Runs all leases of one phase on all threads. */
static int run_phase(struct local_state *c, enum lease_kind kind, uint64_t epoch)
{
	enum { THREADS_MAX = 1024 };
	pthread_t threads[THREADS_MAX];
	unsigned started = 0, wanted = c->run->threads < THREADS_MAX ? c->run->threads : THREADS_MAX;
	c->kind = kind;
	c->epoch = epoch;
	c->next_lease = 0;
	c->lease_count = c->run->plan->groups * c->run->plan->parts;
	/* This thread works, too, so that the phase ends even if no other thread can be created. */
	while (started + 1 < wanted && pthread_create(&threads[started], NULL, run_leases, c) == 0)
		started++;
	run_leases(c);
	for (unsigned i = 0; i < started; i++)
		pthread_join(threads[i], NULL);
	return c->rc;
}

static int begin_rounds(struct local_state *c)
{
	struct local_run *r = c->run;
	const struct plan *p = r->plan;
	bootstrap_compute_b(c->bootstrap, &r->bootstrap_result);
	int rc = canvas_new(&r->canvas, p,
			    canvas_grid_exponent(p, r->bootstrap_result.b_pooled, world_brightness_bound(r->world)),
			    NULL, &c->error);
	if (rc)
		return rc;
	bootstrap_add_to_canvas(c->bootstrap, r->canvas);
	if (p->kind != PLAN_CHAINS)
		return 0;
	for (uint32_t g = 0; g < p->groups; g++)
		bootstrap_draw_seeds(c->bootstrap, g, c->seeds + (size_t)g * (p->chains / p->groups));
	return 0;
}

static int check_bounds(struct local_state *c, uint64_t rounds, enum merge_end *end)
{
	struct local_run *r = c->run;
	struct canvas_image img;
	double seconds = seconds_since(&c->begin_time);
	/* The target may be reached even if another bound ends the render. */
	bool ends = merge_find_end(r->plan, rounds, seconds, NULL) != MERGE_CONTINUES && r->plan->target_error > 0;
	bool due = ends || merge_error_is_due(r->plan, rounds);
	if (due && canvas_image_init(r->canvas, false, &img, &c->error))
		return -ENOMEM;
	*end = merge_find_end(r->plan, rounds, seconds, due ? &img : NULL);
	if (r->on_round)
		r->on_round(r->user, &(struct local_round){.rounds = rounds,
							   .cpu_seconds = r->cpu_seconds - r->bootstrap_cpu_seconds,
							   .seconds = seconds - r->bootstrap_seconds,
							   .bootstrap_seconds = r->bootstrap_seconds,
							   .canvas = r->canvas,
							   .image = due ? &img : NULL});
	if (due)
		canvas_image_fini(&img);
	return 0;
}

/* Makes the map of brightness. Its CPU time counts as the bootstrap's. */
static int make_map(struct local_state *c)
{
	double begin = clock_thread_seconds();
	int rc = render_brightness_map_new(c->run->world, c->run->plan, &c->brightness_map, &c->error);
	c->run->cpu_seconds += clock_thread_seconds() - begin;
	return rc;
}

/* Runs the bootstrap and prepares the rounds. */
static int run_bootstrap(struct local_state *c)
{
	struct local_run *r = c->run;
	int rc = r->load_bootstrap ? r->load_bootstrap(r->user, c->bootstrap, &c->error) : 0;
	if (!rc)
		rc = make_map(c);
	if (rc)
		return rc;
	c->finished_count = r->plan->groups * r->plan->parts - bootstrap_missing_count(c->bootstrap);
	rc = run_phase(c, LEASE_BOOTSTRAP, 0);
	if (rc || is_stopped(c))
		return rc;
	r->bootstrap_cpu_seconds = r->cpu_seconds;
	r->bootstrap_seconds = seconds_since(&c->begin_time);
	rc = begin_rounds(c);
	if (r->bootstrap_result.is_black)
		r->end = MERGE_ROUNDS;
	return rc;
}

/* Passes on an error, after which the canvas may contain part of a round and is freed. */
static int fail_job(struct local_job *j, int rc, struct error *e)
{
	*e = j->state.error;
	canvas_free(j->state.run->canvas);
	j->state.run->canvas = NULL;
	return rc;
}

int local_start(struct local_run *r, struct local_job **out, struct error *e)
{
	const struct plan *p = r->plan;
	struct local_job *j = *out = mem_alloc(1, sizeof *j);
	if (!j)
		return error_set(e, ENOMEM, "no memory for a job");
	struct local_state *c = &j->state;
	c->run = r;
	pthread_mutex_init(&c->lock, NULL);
	r->canvas = NULL;
	r->end = MERGE_CONTINUES;
	r->seconds = r->cpu_seconds = r->bootstrap_seconds = r->bootstrap_cpu_seconds = 0;
	clock_gettime(CLOCK_MONOTONIC, &c->begin_time);
	c->seeds = mem_alloc(p->chains, sizeof *c->seeds);
	c->states = mem_alloc((size_t)p->groups * p->parts, sizeof *c->states);
	int rc = !c->seeds || !c->states ? error_set(&c->error, ENOMEM, "no memory for the chains")
					 : bootstrap_new(&c->bootstrap, p, &c->error);
	if (!rc)
		rc = run_bootstrap(c);
	r->seconds = seconds_since(&c->begin_time);
	if (rc) {
		fail_job(j, rc, e);
		local_end(j);
		*out = NULL;
	}
	return rc;
}

int local_step(struct local_job *j, struct error *e)
{
	struct local_state *c = &j->state;
	if (!c->run->canvas || c->run->bootstrap_result.is_black || is_stopped(c))
		return 0;
	int rc = run_phase(c, LEASE_RENDER, canvas_complete_rounds(c->run->canvas));
	c->run->seconds = seconds_since(&c->begin_time);
	return rc ? fail_job(j, rc, e) : 0;
}

void local_end(struct local_job *j)
{
	struct local_state *c = &j->state;
	const struct plan *p = c->run->plan;
	for (uint32_t i = 0; c->states && i < p->groups * p->parts; i++)
		free_states(c->states[i], lease_chain_count(p, i % p->parts));
	mem_free(c->states);
	mem_free(c->seeds);
	render_brightness_map_free(c->brightness_map);
	bootstrap_free(c->bootstrap);
	pthread_mutex_destroy(&c->lock);
	mem_free(j);
}

int local_run(struct local_run *r, struct error *e)
{
	struct local_job *j;
	int rc = local_start(r, &j, e);
	if (rc)
		return rc;
	while (!rc && r->canvas && r->end == MERGE_CONTINUES && !is_stopped(&j->state)) {
		uint64_t before = canvas_complete_rounds(r->canvas);
		rc = local_step(j, e);
		if (rc || canvas_complete_rounds(r->canvas) == before)
			break;
		rc = check_bounds(&j->state, before + 1, &r->end);
		if (rc)
			fail_job(j, rc, e);
	}
	r->seconds = seconds_since(&j->state.begin_time);
	if (!rc && r->save_bootstrap && !r->bootstrap_result.is_black &&
	    (!r->canvas || canvas_complete_rounds(r->canvas) == 0))
		r->save_bootstrap(r->user, j->state.bootstrap);
	local_end(j);
	return rc;
}
