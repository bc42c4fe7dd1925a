/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Runs leases. check_job() tests whether plan, key and input fit, prepare_job() allocates all memory that the lease
 * needs, and run_job() draws samples or runs chains into the film of the lease (film/sums.h), whose touched tiles make
 * up the batch. Samples are numbered by pixel and round, chains by their index, so that any thread on any machine draws
 * the same random numbers.
 *
 * Failures: -EINVAL if the inputs do not fit, -EILSEQ for invalid states, -EDOM if an invalid operation was trapped
 * (the error message gives the place), -ENOMEM. Nothing of the batch is kept.
 */
#include "worker/render/lease.h"

#include "common/base/clock.h"
#include "common/base/crash.h"
#include "common/base/mem.h"
#include "common/base/liveness.h"
#include "worker/render/chain/chain.h"
#include "worker/render/chain/redistribution.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/brightness_map.h"
#include "worker/render/math/fptrap.h"
#include "worker/render/mutation/mixture.h"
#include "worker/render/path/overlong.h"
#include "worker/render/path/sobol.h"
#include "worker/render/film/sums.h"
#include "worker/render/world/build.h"

#include <stdio.h>
#include <string.h>

/* The working state of one lease. */
struct lease_job {
	const struct plan *plan;
	const struct lease_key *key;
	const struct integrator *integrator;
	const atomic_bool *stop;
	struct path_context context;
	struct path_sample sample;
	struct film_sums sums;
	struct chain *chain;
	struct redistribution *redistribution; /* NULL: the integrator does not redistribute */
	struct brightness *owned_map;
	struct batch *batch;
	struct error *e;
	/* Current position: row and column, or chain and mutation; for a bootstrap, index is the sample. */
	uint64_t sequence, index;
};

enum { STOP_INTERVAL = 16 }; /* samples or mutations between checks of the stop flag; one sample may take 10 ms */
/* One in this many bootstrap samples also estimates paths that are too long to simulate. */
enum { OVERLONG_INTERVAL = 16 };

static bool is_stopped(const struct lease_job *j)
{
	liveness_tick();
	return j->stop && atomic_load_explicit(j->stop, memory_order_relaxed);
}

/* A sampler stratified over pixels: in block 0 of the camera, the film point is moved into one pixel. */
struct pixel_sampler {
	struct sampler_sobol sobol;
	double x, y, width, height; /* position of the pixel and size of a pixel, in units of the window */
};

static const double *pixel_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct pixel_sampler *s = (struct pixel_sampler *)(void *)base;
	double *u = sampler_sobol_fill(&s->sobol, side, vertex);
	if (side == SIDE_CAMERA && vertex == 0) {
		u[DIM_FILM_X] = s->x + u[DIM_FILM_X] * s->width;
		u[DIM_FILM_Y] = s->y + u[DIM_FILM_Y] * s->height;
	}
	return u;
}

/* Returns the number of a pixel. It does not depend on the crop, so that a crop has the same
 * samples as the full render. */
static uint64_t pixel_index(const struct film_window *w, uint64_t column, uint64_t row)
{
	enum { BORDER = 1 << 10 };
	uint64_t x = (uint64_t)(w->x + BORDER) + column, y = (uint64_t)(w->y + BORDER) + row;
	return y << 32 | x;
}

/* Evaluates sample i of the group in that pixel. */
static void evaluate_sample(struct lease_job *j, struct sampler *s, uint64_t pixel, uint64_t i)
{
	const struct film_window *w = &j->context.window;
	double area = w->width * w->height;
	if (j->redistribution)
		j->context.split = redistribution_begin(j->redistribution, pixel, i * j->plan->groups + j->key->group);
	j->integrator->evaluate(&j->context, s, &j->sample);
	for (uint32_t k = 0; k < j->sample.splat_count; k++)
		film_sums_splat(&j->sums, &j->sample.splats[k], 1 / area);
	double intensity = j->sample.intensity;
	if (j->redistribution)
		intensity += redistribution_taken_intensity(j->redistribution);
	j->batch->independent_sum += intensity;
	j->batch->independent_square += intensity * intensity;
	j->batch->counters[COUNT_SAMPLES]++;
}

static enum lease_outcome sample_pixel(struct lease_job *j, uint64_t column, uint64_t row)
{
	const struct plan *p = j->plan;
	const struct film_window *w = &j->context.window;
	const uint64_t pixel = pixel_index(w, column, row);
	struct pixel_sampler s = {.x = (double)column / w->width,
				  .y = (double)row / w->height,
				  .width = 1 / w->width,
				  .height = 1 / w->height};
	for (uint64_t i = 0; i < p->epoch; i++) {
		if (j->batch->counters[COUNT_SAMPLES] % STOP_INTERVAL == 0 && is_stopped(j))
			return LEASE_STOPPED;
		uint64_t sample = j->key->epoch * p->epoch + i;
		sampler_sobol_init(&s.sobol, p->seed, j->integrator->stream, pixel, j->key->group, sample);
		s.sobol.base.block = pixel_block;
		evaluate_sample(j, &s.sobol.base, pixel, sample);
	}
	j->batch->counters[COUNT_INDEPENDENT] += p->epoch;
	return LEASE_DONE;
}

static enum lease_outcome run_samples(struct lease_job *j)
{
	struct plan_range rows = plan_row_range(j->plan, j->key->part);
	for (uint64_t row = rows.begin; row < rows.end; row++)
		for (uint64_t column = 0; column < (uint64_t)j->context.window.width; column++) {
			j->sequence = row;
			j->index = column;
			if (sample_pixel(j, column, row) == LEASE_STOPPED)
				return LEASE_STOPPED;
		}
	return LEASE_DONE;
}

static enum lease_outcome run_bootstrap(struct lease_job *j)
{
	struct plan_range r = plan_bootstrap_range(j->plan, j->key->group, j->key->part);
	struct batch *out = j->batch;
	uint32_t max_edges = j->plan->max_depth < PATH_EDGES_MAX ? j->plan->max_depth : OVERLONG_EDGES_MAX;
	for (uint64_t i = r.begin; i < r.end; i++) {
		if ((i - r.begin) % STOP_INTERVAL == 0 && is_stopped(j))
			return LEASE_STOPPED;
		j->index = i;
		struct sampler_random s;
		sampler_random_init(&s, j->plan->seed, RNG_BOOTSTRAP, i, 0);
		j->integrator->evaluate(&j->context, &s.base, &j->sample);
		double intensity = j->sample.intensity;
		for (uint32_t remaining = j->sample.class_mask; remaining; remaining &= remaining - 1) {
			int k = __builtin_ctz(remaining);
			out->classes[k] += j->sample.class_intensity[k];
		}
		out->weights[i - r.begin] = (float)intensity;
		out->independent_sum += intensity;
		out->independent_square += intensity * intensity;
		out->counters[COUNT_SAMPLES]++;
		out->counters[COUNT_INDEPENDENT]++;
		if (max_edges > j->context.max_depth && i % OVERLONG_INTERVAL == 0)
			out->overlong_sum +=
				OVERLONG_INTERVAL *
				overlong_paths_sample_energy(&j->context, j->plan->seed, i, max_edges, &j->sample);
	}
	return LEASE_DONE;
}

static int run_chain(struct lease_job *j, const struct lease_input *in, uint32_t k, uint64_t id,
		     enum lease_outcome *result)
{
	struct chain *c = j->chain;
	const struct chain_ops *ops = j->integrator->chain;
	*c = (struct chain){.integrator = j->integrator,
			    .context = &j->context,
			    .film = &j->sums,
			    .mixture = j->plan->mutations,
			    .strategy_counters = j->batch->strategies,
			    .seed = j->plan->seed,
			    .id = id,
			    .step = j->key->epoch * j->plan->epoch};
	j->sequence = id;
	j->index = 0;
	bool ok = in->states ? ops->resume(c, &in->states[k]) : ops->start(c, in->seeds[k]);
	if (!ok && in->states)
		return error_set(j->e, EILSEQ,
				 "chain %llu of group %u does not resume: its state is not one of this plan",
				 (unsigned long long)id, j->key->group);
	if (!ok) { /* the seed, chosen by weights computed elsewhere, carries no light here */
		j->batch->counters[COUNT_STATES_LOST]++;
		ops->start(c, UINT64_MAX);
	}
	struct chain_sums sums = {0, 0};
	uint64_t accepted = j->batch->counters[COUNT_ACCEPTED];
	for (uint64_t i = 0; i < j->plan->epoch; i++) {
		if (i % STOP_INTERVAL == 0 && is_stopped(j)) {
			*result = LEASE_STOPPED;
			return 0;
		}
		j->index = i + 1;
		ops->step(c, &sums);
	}
	ops->flush(c);
	if (batch_sequence_count(j->plan) > 1)
		chain_moments_end_sequence(&j->sums.moments,
					   j->batch->moments + (size_t)k * batch_film_tile_count(j->plan));
	j->batch->counters[COUNT_STUCK] += j->batch->counters[COUNT_ACCEPTED] == accepted;
	j->batch->independent_sum += sums.sum;
	j->batch->independent_square += sums.square_sum;
	return ops->save(c, &j->batch->states[k]);
}

static int run_chains(struct lease_job *j, const struct lease_input *in, enum lease_outcome *result)
{
	struct plan_range r = plan_chain_range(j->plan, j->key->part);
	if (!in || in->chain_count != r.end - r.begin || (!in->seeds && !in->states))
		return error_set(j->e, EINVAL, "a lease of %llu chains came with another number of states or seeds",
				 (unsigned long long)(r.end - r.begin));
	*result = LEASE_DONE;
	for (uint64_t k = r.begin; k < r.end && *result == LEASE_DONE; k++) {
		int rc = run_chain(j, in, (uint32_t)(k - r.begin), j->key->group + j->plan->groups * k, result);
		if (rc)
			return rc == -ENOMEM ? error_set(j->e, ENOMEM, "out of memory for chain states") : rc;
	}
	if (batch_sequence_count(j->plan) == 1)
		chain_moments_end_sequence(&j->sums.moments, j->batch->moments);
	size_t second = (size_t)batch_sequence_count(j->plan) * batch_film_tile_count(j->plan);
	chain_moments_end_lease(&j->sums.moments, j->batch->moments + second, j->batch->classes);
	return 0;
}

static int check_job(const struct world *w, const struct plan *p, const struct integrator *i, struct error *e)
{
	if (!i)
		return error_set(e, EINVAL, "no integrator is called '%s'", p->integrator);
	if (i->properties.kind != p->kind)
		return error_set(e, EINVAL, "integrator '%s' and the plan differ in kind", p->integrator);
	if (p->width != w->settings.width || p->height != w->settings.height || p->border != w->settings.border)
		return error_set(
			e, EINVAL, "the plan's film is %u x %u with a border of %u pixels, the scene's %u x %u with %u",
			p->width, p->height, p->border, w->settings.width, w->settings.height, w->settings.border);
	if (i->properties.is_camera_only && world_has_beam(w))
		return error_set(e, EINVAL, RENDER_NO_BEAMS, i->properties.name);
	if (!i->properties.is_camera_only && world_has_rolling_shutter(w))
		return error_set(e, EINVAL, RENDER_NO_ROLLING_SHUTTER, i->properties.name);
	if (i->properties.must_end_on_emitter && w->effects.medium_light)
		return error_set(e, EINVAL, RENDER_NO_MEDIUM_LIGHT, i->properties.name);
	struct mixture unused;
	char accuracy[PLAN_ACCURACY_MAX];
	accuracy_settings_print(&w->accuracy, accuracy);
	if (strcmp(accuracy, p->accuracy) != 0)
		return error_set(e, EINVAL, "the plan's settings are '%s', those of the world '%s'", p->accuracy,
				 accuracy);
	if (i->properties.has_mutations && mixture_parse(p->mutations, &unused, e))
		return -EINVAL;
	if (p->max_depth < 1 || p->max_depth > PATH_EDGES_MAX)
		return error_set(e, EINVAL, "a depth of %u edges is not between 1 and %d", p->max_depth,
				 PATH_EDGES_MAX);
	return 0;
}

static int prepare_redistribution(struct lease_job *j, const struct brightness *map, struct error *e)
{
	int rc = map ? 0 : render_brightness_map_new(j->context.w, j->plan, &j->owned_map, e);
	if (rc)
		return rc;
	return redistribution_new(&j->redistribution, &redistribution_default_rule, &j->context,
				  map ? map : j->owned_map, j->plan->seed, &j->sums.target, j->batch->classes, e);
}

static int prepare_job(struct lease_job *j, const struct world *w, const struct lease_input *in, struct error *e)
{
	const struct plan *p = j->plan;
	uint32_t depth =
		p->max_depth < j->integrator->properties.max_depth ? p->max_depth : j->integrator->properties.max_depth;
	j->context.w = w;
	j->context.window = film_window_from_plan(p);
	j->context.min_depth = p->min_depth;
	j->context.max_depth = depth;
	j->context.light_subpath_interval = j->integrator->light_subpath_interval;
	j->context.max_survival = p->kind == PLAN_SAMPLES ? PATH_SURVIVAL_MAX : 0;
	j->context.skips_classes = p->kind == PLAN_SAMPLES && j->key->kind == LEASE_RENDER;
	j->context.counters = j->batch->counters;
	j->context.refract = halfvec_refract;
	j->batch->strategy_count = j->key->kind == LEASE_RENDER ? (uint32_t)plan_strategy_count(p->mutations) : 0;
	if (j->key->kind == LEASE_BOOTSTRAP) {
		struct plan_range r = plan_bootstrap_range(p, j->key->group, j->key->part);
		j->batch->weight_count = r.end - r.begin;
		j->batch->weights = mem_alloc(j->batch->weight_count, sizeof *j->batch->weights);
		return j->batch->weights ? 0
					 : error_set(e, ENOMEM, "out of memory for %llu weights",
						     (unsigned long long)(r.end - r.begin));
	}
	if (p->kind == PLAN_CHAINS) {
		struct plan_range r = plan_chain_range(p, j->key->part);
		j->batch->state_count = (uint32_t)(r.end - r.begin);
		j->batch->states = mem_alloc(j->batch->state_count, sizeof *j->batch->states);
		j->chain = mem_alloc(1, j->integrator->chain->size);
		j->batch->moment_count = batch_moment_count(p, LEASE_RENDER);
		j->batch->moments = mem_alloc(j->batch->moment_count, sizeof *j->batch->moments);
		if (!j->batch->states || !j->chain || !j->batch->moments)
			return error_set(e, ENOMEM, "out of memory for chain states");
	}
	int rc = j->integrator->redistributes ? prepare_redistribution(j, in ? in->map : NULL, e) : 0;
	return rc ? rc : film_sums_init(&j->sums, p, &w->settings, e);
}

static int run_job(struct lease_job *j, const struct lease_input *in, enum lease_outcome *result)
{
	if (j->key->kind == LEASE_BOOTSTRAP) {
		*result = run_bootstrap(j);
		return 0;
	}
	int rc = 0;
	if (j->plan->kind == PLAN_SAMPLES)
		*result = run_samples(j);
	else
		rc = run_chains(j, in, result);
	if (rc || *result == LEASE_STOPPED)
		return rc;
	return film_sums_add_tiles(&j->sums, j->batch, j->e);
}

static int invalid_operation(const struct lease_job *j)
{
	char place[128];
	unsigned long long sequence = j->sequence, index = j->index, group = j->key->group, epoch = j->key->epoch;
	if (j->key->kind == LEASE_BOOTSTRAP)
		snprintf(place, sizeof place, "bootstrap sample %llu of group %llu", index, group);
	else if (j->plan->kind == PLAN_SAMPLES)
		snprintf(place, sizeof place, "row %llu, column %llu of group %llu, epoch %llu", sequence, index, group,
			 epoch);
	else
		snprintf(place, sizeof place, "mutation %llu of chain %llu, epoch %llu", index, sequence, epoch);
	return error_set(j->e, EDOM, "an invalid floating-point operation (SIGFPE) in %s by '%s'", place,
			 j->plan->integrator);
}

/* Runs a job and catches invalid operations. All memory belongs to the job, so that nothing leaks when an invalid
 * operation leaves it in the middle. */
static int run_guarded(struct lease_job *j, const struct lease_input *in, enum lease_outcome *result)
{
	jmp_buf jump;
	if (setjmp(jump))
		return invalid_operation(j);
	jmp_buf *previous_jump = fptrap_catch(&jump);
	bool was_watched = fptrap_watch();
	int rc = run_job(j, in, result);
	fptrap_unwatch(was_watched);
	fptrap_catch(previous_jump);
	return rc;
}

int render_lease(const struct world *w, const struct plan *p, const struct lease_key *k, const struct lease_input *in,
		 const atomic_bool *stop, enum lease_outcome *result, struct batch *out, struct error *e)
{
	*out = (struct batch){.key = *k};
	*result = LEASE_DONE;
	const struct integrator *integrator = integrator_find(p->integrator);
	int rc = check_job(w, p, integrator, e);
	if (rc)
		return rc;
	struct lease_job *j = mem_alloc(1, sizeof *j);
	if (!j)
		return error_set(e, ENOMEM, "out of memory for a lease");
	j->plan = p;
	j->key = k;
	j->integrator = integrator;
	j->stop = stop;
	j->batch = out;
	j->e = e;
	double start = clock_thread_seconds();
	crash_set_context(k->kind == LEASE_BOOTSTRAP ? "rendering bootstrap samples" : "rendering", NULL, 0);
	rc = prepare_job(j, w, in, e);
	if (!rc)
		rc = run_guarded(j, in, result);
	film_sums_fini(&j->sums);
	redistribution_free(j->redistribution);
	render_brightness_map_free(j->owned_map);
	mem_free(j->chain);
	mem_free(j);
	crash_set_context(NULL, NULL, 0);
	out->cpu_seconds = clock_thread_seconds() - start;
	if (rc || *result == LEASE_STOPPED)
		batch_fini(out);
	return rc;
}
