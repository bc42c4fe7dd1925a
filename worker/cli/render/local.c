/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `phase` gives leases to threads under one lock, and their results are merged in the order in which they finish, which
 * does not affect the sums. After the bootstrap (run_bootstrap) follow rounds; after each, common/estimate/merge.h
 * decides whether the job is done.
 *
 * Fails if a lease fails (the error has its key), if the disk under the canvas does, or if memory is out. The canvas is
 * then freed, because it may contain part of a round.
 */
#include "worker/cli/render/local.h"

#include "common/base/clock.h"
#include "common/base/crash.h"
#include "common/base/mem.h"

#include <math.h>
#include <pthread.h>
#include <time.h>

/* What the threads share. The lock protects everything that changes during a phase. */
struct thread_pool {
	struct local_run *run;
	struct bootstrap *bootstrap;
	uint64_t *seeds;	     /* [groups][chains / groups] */
	struct brightness *map;	     /* see render_map_new */
	struct chain_state **states; /* [groups x parts][chains of a lease], after the epoch before */
	enum lease_kind kind;	     /* of the phase */
	uint64_t epoch;		     /* of the phase */
	uint32_t next, leases;	     /* the next lease of the phase, and their number */
	uint64_t finished;	     /* finished leases of all phases, for progress */
	struct timespec begin;	     /* of the bootstrap */
	pthread_mutex_t lock;
	int rc; /* of the first lease that failed, with `error` */
	struct error error;
};

struct local_job {
	struct thread_pool thread_pool;
};

static double seconds_since(const struct timespec *begin)
{
	struct timespec now;
	clock_gettime(CLOCK_MONOTONIC, &now);
	return (double)(now.tv_sec - begin->tv_sec) + 1e-9 * (double)(now.tv_nsec - begin->tv_nsec);
}

static bool is_stopped(const struct thread_pool *c)
{
	return c->run->stop && atomic_load(c->run->stop);
}

static uint32_t chains_of(const struct plan *p, uint32_t part)
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

static void show(struct thread_pool *c)
{
	struct local_run *r = c->run;
	if (!r->progress)
		return;
	uint64_t per_round = (uint64_t)r->plan->groups * r->plan->parts;
	struct local_progress p = {.state = c->kind == LEASE_BOOTSTRAP ? "bootstrap" : "running",
				   .done = c->finished,
				   .seconds = seconds_since(&c->begin)};
	p.total = r->plan->rounds == UINT64_MAX ? UINT64_MAX : (r->plan->rounds + 1) * per_round;
	if (c->kind == LEASE_RENDER) {
		p.rounds = (double)c->finished / (double)per_round - 1;
		p.round_seconds = p.seconds - r->bootstrap_seconds;
	}
	p.rounds_left = r->plan->rounds == UINT64_MAX ? INFINITY : (double)r->plan->rounds - p.rounds;
	r->progress(r->user, &p);
}

/* Merges the batch, as the coordinator does on a farm. Under the lock. */
static int merge(struct thread_pool *c, struct batch *b)
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

static int lease(struct thread_pool *c, uint32_t index)
{
	const struct plan *p = c->run->plan;
	struct lease_key k = {.kind = c->kind, .group = index / p->parts, .part = index % p->parts, .epoch = c->epoch};
	struct lease_input in = {.chain_count = chains_of(p, k.part), .map = c->map};
	if (p->kind == PLAN_CHAINS && c->kind == LEASE_RENDER) {
		if (c->epoch == 0)
			in.seeds = c->seeds + (size_t)k.group * (p->chains / p->groups) +
				   plan_chain_range(p, k.part).begin;
		else
			in.states = c->states[index];
	}
	struct batch b;
	struct error e;
	enum lease_end end;
	int rc = render_lease(c->run->world, p, &k, &in, c->run->stop, &end, &b, &e);
	pthread_mutex_lock(&c->lock);
	if (!rc && end == LEASE_DONE && !c->rc) {
		rc = batch_check(&b, p, &e);
		if (!rc) {
			rc = merge(c, &b);
			e = c->error;
		}
		c->finished++;
		show(c);
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
static uint32_t take_lease(struct thread_pool *c)
{
	uint32_t parts = c->run->plan->parts;
	while (c->kind == LEASE_BOOTSTRAP && c->next < c->leases &&
	       bootstrap_has(c->bootstrap, c->next / parts, c->next % parts))
		c->next++;
	return c->next < c->leases ? c->next++ : c->leases;
}

static void *run_leases(void *arg)
{
	struct thread_pool *c = arg;
	crash_thread();
	for (;;) {
		pthread_mutex_lock(&c->lock);
		uint32_t i = c->rc || is_stopped(c) ? c->leases : take_lease(c);
		pthread_mutex_unlock(&c->lock);
		if (i == c->leases || lease(c, i))
			return NULL;
	}
}

/* Runs all leases of one phase on all threads. */
static int phase(struct thread_pool *c, enum lease_kind kind, uint64_t epoch)
{
	enum { THREADS_MAX = 1024 };
	pthread_t threads[THREADS_MAX];
	unsigned started = 0, wanted = c->run->threads < THREADS_MAX ? c->run->threads : THREADS_MAX;
	c->kind = kind;
	c->epoch = epoch;
	c->next = 0;
	c->leases = c->run->plan->groups * c->run->plan->parts;
	/* This thread works, too, so that the phase ends even if no other thread can be created. */
	while (started + 1 < wanted && pthread_create(&threads[started], NULL, run_leases, c) == 0)
		started++;
	run_leases(c);
	for (unsigned i = 0; i < started; i++)
		pthread_join(threads[i], NULL);
	return c->rc;
}

static int begin_rounds(struct thread_pool *c)
{
	struct local_run *r = c->run;
	const struct plan *p = r->plan;
	bootstrap_merge(c->bootstrap, &r->lit);
	int rc = canvas_new(&r->canvas, p, canvas_grid_exponent(p, r->lit.b_pooled, world_brightest(r->world)), NULL,
			    &c->error);
	if (rc)
		return rc;
	bootstrap_to_canvas(c->bootstrap, r->canvas);
	if (p->kind != PLAN_CHAINS)
		return 0;
	for (uint32_t g = 0; g < p->groups; g++)
		bootstrap_seeds(c->bootstrap, g, c->seeds + (size_t)g * (p->chains / p->groups));
	return 0;
}

static int check_target(struct thread_pool *c, uint64_t rounds, enum merge_end *end)
{
	struct local_run *r = c->run;
	struct canvas_image img;
	double seconds = seconds_since(&c->begin);
	/* The target may be reached even if another bound ends the render. */
	bool ends = merge_end_of(r->plan, rounds, seconds, NULL) != MERGE_GOES_ON && r->plan->target_error > 0;
	bool due = ends || merge_error_due(r->plan, rounds);
	if (due && canvas_image(r->canvas, false, &img, &c->error))
		return -ENOMEM;
	*end = merge_end_of(r->plan, rounds, seconds, due ? &img : NULL);
	if (r->round)
		r->round(r->user, &(struct local_round){.rounds = rounds,
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
static int make_map(struct thread_pool *c)
{
	double begin = clock_thread_seconds();
	int rc = render_map_new(c->run->world, c->run->plan, &c->map, &c->error);
	c->run->cpu_seconds += clock_thread_seconds() - begin;
	return rc;
}

/* Runs the bootstrap and prepares the rounds. */
static int run_bootstrap(struct thread_pool *c)
{
	struct local_run *r = c->run;
	int rc = r->resume ? r->resume(r->user, c->bootstrap, &c->error) : 0;
	if (!rc)
		rc = make_map(c);
	if (rc)
		return rc;
	c->finished = r->plan->groups * r->plan->parts - bootstrap_missing(c->bootstrap);
	rc = phase(c, LEASE_BOOTSTRAP, 0);
	if (rc || is_stopped(c))
		return rc;
	r->bootstrap_cpu_seconds = r->cpu_seconds;
	r->bootstrap_seconds = seconds_since(&c->begin);
	rc = begin_rounds(c);
	if (r->lit.black)
		r->end = MERGE_ROUNDS;
	return rc;
}

/* Passes on an error, after which the canvas may contain part of a round and is freed. */
static int fail(struct local_job *j, int rc, struct error *e)
{
	*e = j->thread_pool.error;
	canvas_free(j->thread_pool.run->canvas);
	j->thread_pool.run->canvas = NULL;
	return rc;
}

int local_start(struct local_run *r, struct local_job **out, struct error *e)
{
	const struct plan *p = r->plan;
	struct local_job *j = *out = mem_alloc(1, sizeof *j);
	if (!j)
		return error_set(e, ENOMEM, "no memory for a job");
	struct thread_pool *c = &j->thread_pool;
	c->run = r;
	pthread_mutex_init(&c->lock, NULL);
	r->canvas = NULL;
	r->end = MERGE_GOES_ON;
	r->seconds = r->cpu_seconds = r->bootstrap_seconds = r->bootstrap_cpu_seconds = 0;
	clock_gettime(CLOCK_MONOTONIC, &c->begin);
	c->seeds = mem_alloc(p->chains, sizeof *c->seeds);
	c->states = mem_alloc((size_t)p->groups * p->parts, sizeof *c->states);
	int rc = !c->seeds || !c->states ? error_set(&c->error, ENOMEM, "no memory for the chains")
					 : bootstrap_new(&c->bootstrap, p, &c->error);
	if (!rc)
		rc = run_bootstrap(c);
	r->seconds = seconds_since(&c->begin);
	if (rc) {
		fail(j, rc, e);
		local_end(j);
		*out = NULL;
	}
	return rc;
}

int local_step(struct local_job *j, struct error *e)
{
	struct thread_pool *c = &j->thread_pool;
	if (!c->run->canvas || c->run->lit.black || is_stopped(c))
		return 0;
	int rc = phase(c, LEASE_RENDER, canvas_rounds(c->run->canvas));
	c->run->seconds = seconds_since(&c->begin);
	return rc ? fail(j, rc, e) : 0;
}

void local_end(struct local_job *j)
{
	struct thread_pool *c = &j->thread_pool;
	const struct plan *p = c->run->plan;
	for (uint32_t i = 0; c->states && i < p->groups * p->parts; i++)
		free_states(c->states[i], chains_of(p, i % p->parts));
	mem_free(c->states);
	mem_free(c->seeds);
	render_map_free(c->map);
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
	while (!rc && r->canvas && r->end == MERGE_GOES_ON && !is_stopped(&j->thread_pool)) {
		uint64_t before = canvas_rounds(r->canvas);
		rc = local_step(j, e);
		if (rc || canvas_rounds(r->canvas) == before)
			break;
		rc = check_target(&j->thread_pool, before + 1, &r->end);
		if (rc)
			fail(j, rc, e);
	}
	r->seconds = seconds_since(&j->thread_pool.begin);
	if (!rc && r->keep && !r->lit.black && (!r->canvas || canvas_rounds(r->canvas) == 0))
		r->keep(r->user, j->thread_pool.bootstrap);
	local_end(j);
	return rc;
}
