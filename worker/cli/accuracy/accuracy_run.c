/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Renders the settings alternately in short rounds, so that changes of the machine's speed affect all of them alike.
 * The next round belongs to the setting that has used the smallest part of its share. A short pilot with the default
 * determines the length of rounds. Settings that differ in nothing that is built share a world. Leases run as in
 * hslt-render (local_run.h).
 *
 * Fails if there is not enough memory for all films, before anything is rendered, or if a lease fails. A signal ends
 * the rounds; that is a failure only if some setting has no complete round yet.
 */
#include "worker/cli/accuracy/accuracy_run.h"

#include "common/base/clock.h"
#include "common/base/mem.h"

#include <stdio.h>
#include <string.h>

enum { PILOT_BOOTSTRAP = 16384, PILOT_EPOCH = 16 };

/* The speed of a short render of the default, from which the lengths of rounds and bootstraps are computed. */
struct pilot_speed {
	double bootstrap_sample_seconds; /* CPU seconds per sample of the bootstrap */
	double mutation_seconds;	 /* CPU seconds per mutation */
	double cpu_per_wall_second; /* CPU seconds per second, which is less if other programs use the processors, too
				     */
};

static double sum_of_shares(const struct accuracy_design *d)
{
	double sum = 0;
	for (size_t i = 0; i < d->count; i++)
		sum += d->settings[i].time_share;
	return sum;
}

/* Returns the CPU seconds for a setting whose share is 1; 15 % are set aside for bootstraps and worlds. */
static double expected_seconds(const struct accuracy_run *r, const struct pilot_speed *pilot)
{
	return r->setting_seconds > 0 ? r->setting_seconds
				      : 0.85 * r->seconds * pilot->cpu_per_wall_second / sum_of_shares(r->design);
}

/* Returns the bytes of available memory. File caches count as available, because they fill most of the memory of a
 * machine that has been up for a while. If the amount is not known, it is infinite: nothing is refused here, and an
 * allocation that fails later is reported. */
static double available_memory(void)
{
	char line[128];
	double kilobytes = INFINITY;
	FILE *f = fopen("/proc/meminfo", "re");
	while (f && fgets(line, sizeof line, f) && sscanf(line, "MemAvailable: %lf", &kilobytes) != 1)
		continue;
	if (f)
		fclose(f);
	return 1024 * kilobytes;
}

/* Checks that there is enough memory for the films, which all stay in memory until the end. */
static int check_memory(const struct accuracy_run *r, const struct plan *p, struct error *e)
{
	double tiles = ceil(p->crop_width / (double)TILE_SIZE) * ceil(p->crop_height / (double)TILE_SIZE);
	double wanted = (double)r->design->count * p->groups * 3 * tiles * TILE_SIZE * TILE_SIZE * TILE_CHANNELS *
			sizeof(int64_t);
	double available = available_memory();
	if (wanted < 0.75 * available)
		return 0;
	return error_set(
		e, ENOMEM,
		"%zu settings of %ux%u pixels take %.1f GB of memory, and %.1f are available: choose a smaller "
		"--size, or fewer --parameters",
		r->design->count, p->crop_width, p->crop_height, wanted / 1e9, available / 1e9);
}

/* Makes the plan of setting i. Rounds are short, so that the settings alternate often; the bootstrap takes about a
 * tenth of the time. */
static int make_plan(struct accuracy_run *r, size_t i, const struct pilot_speed *pilot, struct error *e)
{
	enum { ROUNDS = 25 };
	const struct accuracy_setting *s = &r->design->settings[i];
	struct plan_request q = r->request;
	struct plan *p = &r->jobs[i].plan;
	double seconds_per_share = expected_seconds(r, pilot);
	q.max_depth = s->max_depth;
	memcpy(q.accuracy, s->accuracy, sizeof q.accuracy);
	memcpy(q.mixture, s->mixture, sizeof q.mixture);
	q.seed += i; /* compared settings share no random numbers */
	q.seconds = 1e8;
	q.spp = q.mutations = 0;
	q.target_error = 0;
	bool chains = q.kind == PLAN_CHAINS;
	if (chains && !q.bootstrap)
		q.bootstrap = (uint64_t)fmin(
			fmax(0.1 * seconds_per_share / pilot->bootstrap_sample_seconds, PILOT_BOOTSTRAP), 1e6);
	/* Plans as many chains as a render of this length usually has. With more, each would be short and close to
	 * where it started, an error that the differences between groups do not show. */
	q.mutations =
		chains && !q.chains ? (uint64_t)fmin(fmax(seconds_per_share / pilot->mutation_seconds, 1), 1e15) : 0;
	int rc = plan_make(&q, p, e);
	q.chains = p->chains;
	q.mutations = 0;
	if (!rc)
		rc = plan_make(&q, p, e);
	if (!rc && !r->request.epoch) {
		double step = chains ? (double)p->chains : (double)p->groups * (double)plan_extended_pixels(p);
		q.epoch = (uint64_t)fmin(
			fmax(seconds_per_share / ROUNDS / pilot->mutation_seconds / step, chains ? PILOT_EPOCH : 1),
			8192);
		rc = plan_make(&q, p, e);
	}
	if (!rc && p->groups < 4)
		rc = error_set(e, EINVAL, "%u groups are too few to estimate errors: at least 4 are needed", p->groups);
	return rc;
}

/* Finds an existing world that can be used with the settings of this job, or makes a new one. */
static int find_world(struct accuracy_run *r, struct accuracy_job *j, struct error *e)
{
	struct render_options options = *r->options;
	for (size_t k = 0; k < r->world_count; k++) {
		bool fits;
		int rc = world_set_accuracy(r->worlds[k], j->plan.accuracy, &fits, e);
		if (rc)
			return rc;
		if (fits) {
			j->world = r->worlds[k];
			return 0;
		}
	}
	memcpy(options.accuracy, j->plan.accuracy, sizeof options.accuracy);
	int rc = world_new(&j->world, r->scene, r->assets, &options, e);
	if (!rc)
		r->worlds[r->world_count++] = j->world;
	return rc;
}

static bool is_stopped(const struct accuracy_run *r)
{
	return r->stop && atomic_load(r->stop);
}

static int start_setting(struct accuracy_run *r, size_t i, struct error *e)
{
	struct accuracy_job *j = &r->jobs[i];
	int rc = find_world(r, j, e);
	if (rc)
		return rc;
	j->run = (struct local_run){.world = j->world, .plan = &j->plan, .threads = r->threads, .stop = r->stop};
	rc = local_start(&j->run, &j->job, e);
	if (!rc && j->run.bootstrap_result.is_black && j->run.canvas)
		rc = error_set(e, EINVAL, "the bootstrap found no light: there is nothing to compare");
	return rc;
}

/* Renders a round of job i. Its cost is the CPU time of its leases. */
static int run_round(struct accuracy_run *r, size_t i, struct error *e)
{
	struct accuracy_job *j = &r->jobs[i];
	bool fits;
	int rc = world_set_accuracy(j->world, j->plan.accuracy, &fits, e);
	double before = j->run.cpu_seconds;
	uint64_t rounds = canvas_complete_rounds(j->run.canvas);
	if (!rc)
		rc = local_step(j->job, e);
	if (rc || canvas_complete_rounds(j->run.canvas) == rounds)
		return rc;
	double cpu = j->run.cpu_seconds - before;
	j->cpu_seconds += cpu;
	if (j->cost_count < ACCURACY_COSTS_MAX)
		j->costs[j->cost_count++] = cpu / (double)plan_round_mutations(&j->plan);
	return 0;
}

/* Returns the CPU seconds or rounds that setting i has used, divided by its share. */
static double share_used(const struct accuracy_run *r, size_t i)
{
	const struct accuracy_job *j = &r->jobs[i];
	return (r->setting_rounds ? (double)canvas_complete_rounds(j->run.canvas) : j->cpu_seconds) /
	       r->design->settings[i].time_share;
}

/* Returns the setting that has used least of its share. */
static size_t next_setting(const struct accuracy_run *r)
{
	size_t best = 0;
	for (size_t i = 1; i < r->design->count; i++)
		if (share_used(r, i) < share_used(r, best))
			best = i;
	return best;
}

static void report_progress(const struct accuracy_run *r, double fraction, const char *state)
{
	if (r->on_progress)
		r->on_progress(r->user, fraction, state);
}

static int render_rounds(struct accuracy_run *r, double begin, struct error *e)
{
	double rounds_begin = clock_seconds(),
	       quota = r->setting_rounds ? (double)r->setting_rounds : r->setting_seconds;
	for (;;) {
		size_t i = next_setting(r);
		double wall = clock_seconds();
		bool enough = quota > 0 ? share_used(r, i) >= quota : wall >= begin + r->seconds;
		/* Every setting gets at least two rounds, however short the time. */
		if ((enough && canvas_complete_rounds(r->jobs[i].run.canvas) >= 2) || is_stopped(r))
			return 0;
		report_progress(r,
				fmin(quota > 0 ? share_used(r, i) / quota
					       : (wall - rounds_begin) / fmax(begin + r->seconds - rounds_begin, 1),
				     1),
				"rendering");
		int rc = run_round(r, i, e);
		if (rc)
			return rc;
	}
}

static void end_job(struct accuracy_job *j)
{
	if (j->job)
		local_end(j->job);
	canvas_free(j->run.canvas);
	*j = (struct accuracy_job){.cost_count = 0};
}

/* Renders the default briefly, to measure its speed. */
static int render_pilot(struct accuracy_run *r, struct pilot_speed *pilot, struct error *e)
{
	struct accuracy_job *j = &r->jobs[ACCURACY_DEFAULT];
	*pilot = (struct pilot_speed){1, 1, 1}; /* a speed so low that make_plan chooses the shortest rounds */
	int rc = make_plan(r, ACCURACY_DEFAULT, pilot, e);
	if (!rc)
		rc = check_memory(r, &j->plan, e);
	if (!rc)
		rc = find_world(r, j, e);
	double begin = clock_seconds();
	if (!rc)
		rc = start_setting(r, ACCURACY_DEFAULT, e);
	if (!rc && !is_stopped(r))
		rc = run_round(r, ACCURACY_DEFAULT, e);
	if (!rc && j->cost_count > 0) {
		pilot->bootstrap_sample_seconds = fmax(j->run.bootstrap_cpu_seconds / (double)j->plan.bootstrap, 1e-9);
		pilot->mutation_seconds = fmax(j->costs[0], 1e-9);
		pilot->cpu_per_wall_second = fmax(j->run.cpu_seconds / fmax(clock_seconds() - begin, 1e-9), 0.05);
	}
	end_job(j);
	return rc;
}

int accuracy_render(struct accuracy_run *r, struct error *e)
{
	const struct accuracy_design *d = r->design;
	double begin = clock_seconds();
	int rc;
	r->jobs = mem_alloc(d->count, sizeof *r->jobs);
	if (!r->jobs)
		return error_set(e, ENOMEM, "no memory for %zu settings", d->count);
	struct pilot_speed pilot;
	report_progress(r, 0, "pilot");
	rc = render_pilot(r, &pilot, e);
	for (size_t i = 0; !rc && i < d->count; i++)
		rc = make_plan(r, i, &pilot, e);
	for (size_t i = 0; !rc && !is_stopped(r) && i < d->count; i++) {
		report_progress(r, (double)i / (double)d->count, "bootstrap");
		rc = start_setting(r, i, e);
		if (rc) {
			char name[96];
			accuracy_setting_name(&d->settings[i], name, sizeof name);
			error_prefix(e, rc, "%s", name);
		}
	}
	if (!rc && !is_stopped(r))
		rc = render_rounds(r, begin, e);
	r->wall_seconds = clock_seconds() - begin;
	r->was_interrupted = is_stopped(r);
	for (size_t i = 0; !rc && i < d->count; i++)
		if (!r->jobs[i].run.canvas || canvas_complete_rounds(r->jobs[i].run.canvas) < 1)
			rc = error_set(e, EINTR, "interrupted before each setting had a round: no report");
	return rc;
}

void accuracy_run_fini(struct accuracy_run *r)
{
	for (size_t i = 0; r->jobs && i < r->design->count; i++)
		end_job(&r->jobs[i]);
	mem_free(r->jobs);
	for (size_t k = 0; k < r->world_count; k++)
		world_free(r->worlds[k]);
	r->jobs = NULL;
	r->world_count = 0;
}
