/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chooses the integrator from a pilot; choose_integrator.h explains the method.
 *
 * render_choose makes a map of brightness from samples of `path`, then a second set of samples of `path` relative to
 * this map. If a lobe of the scene is narrow, it merges light with sub-paths of the camera. If that leaves the choice
 * open, it takes samples of `bdpt`: a quarter of them first, and the rest unless the quarter is clear.
 * render_choice_integrator then compares the measurements with the thresholds below, which were set from pilots of
 * 16,384 samples, 40 in each scene of tests/bench/choices.md.
 *
 * If `path` cannot find the light, the map is made by `bdpt` instead. -ENOMEM: no memory for the pilot. -EINVAL: the
 * request has no valid film.
 */
#include "worker/render/choose_integrator.h"

#include "common/base/mem.h"
#include "common/base/liveness.h"
#include "common/estimate/tail.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrate_path.h"
#include "worker/render/path/integrator.h"
#include "worker/render/pilot_plan.h"

#include <stdio.h>
#include <string.h>

enum {
	BDPT_FIRST_DIVISOR = 4, /* bdpt takes 1/4 of its samples first */
	SAMPLES_PER_PIXEL = 16, /* consecutive samples in one pixel */
	MERGING_DIVISOR = 4,	/* merging has 1/4 of the samples, within the two bounds below */
	MERGING_SAMPLES_MIN = 1 << 12,
	MERGING_SAMPLES_MAX = 1 << 16, /* photons take memory */
	COMPARED_DIVISOR = 128,	       /* at most 1/128 of the samples have a splat that is compared with its pixel */
	DROPPED_INTERVAL = 1 << 12,    /* the variance omits the largest terms, one per 4,096 samples */
};

/* If path finds a larger share of rare light, or a smaller tail index (no finite mean), chains may be needed. */
static const double doubtful_rare_share = 0.03, finite_mean_tail_index = 1;
/* Share of rare light, for bdpt or for path, from which chains are needed. For bdpt it is 0.16 or more in the scenes
 * where chains win by factors, except torus; in the others 0.12 or less, except veach-door with 0.05 to 0.33. */
static const double chains_rare_share = 0.12;
/* If the share exceeds chains_rare_share, the smaller of bdpt's two tail indices must also be below this for chains to
 * be needed. It is at most 1.2 where chains win, and 1.23 to 2.0 in veach-door. */
static const double chains_max_tail_index = 1.25;
/* The tail index of path's extremes must also be below this, whatever the share of rare light. It is 0.3 to 0.6 in
 * window, pane and frosted: there camera sub-paths rarely meet the light, so too few samples of bdpt begin a chain. It
 * is 1.5 to 2.6 in water, pool and torus: there light sub-paths find the rest, and the chains of erpt need 0.01 to 0.9
 * of the time of those of hslt. */
static const double chains_max_extreme_tail_index = 1;
/* Limit on the share of the light that merging finds to be rare for bdpt; above it, chains may be needed. The share
 * is 0.05 to 0.35 in water, frosted, pane, torus and pool, 0.02 to 0.03 in half-sunk, and at most 0.008 where chains
 * lose. */
static const double chains_merging_share = 0.03;
/* If merging finds more than min_merging_seen_share of all light, and less than negligible_merging_share of it is rare
 * for bdpt, chains are not needed, even if light is rare for path. In kitchen, where short pilots of path find almost
 * nothing, these are 0.62 to 0.84 and 0.003 to 0.006. */
static const double negligible_merging_share = 0.01, min_merging_seen_share = 0.4;
/* A quarter of bdpt's samples is enough if bdpt finds more rare light than this, and a tail without a mean. */
static const double clear_rare_share = 0.4;
/* It is also enough if bdpt finds less rare light than negligible_rare_share and path finds little, the extremes of
 * both have a tail index of at least clear_extreme_tail_index, and no single sample has more than clear_largest_share
 * of the light. In jewel, the rest of bdpt's samples found a third of the light, of which the first quarter had found
 * nothing. */
static const double negligible_rare_share = 0.01, clear_extreme_tail_index = 0.9, clear_largest_share = 0.05;
/* The tail index of path from which its variance is taken to be finite. It is 2.0 to 2.8 in cornell-box and veach-mis
 * and more in box, where path wins by 1.1 to 2.4 x. It is 0.9 to 2.1 in rough-caustic, three-spheres, demo, displaced
 * and veach-door, where path loses. */
static const double finite_variance_tail_index = 2.1;
/* For path and bdpt8, no sample may have more than this share of the light. It is at most 0.01 in cornell-box, box and
 * effects-glass, and 0.1 in the median pilot of pool, where the other samples show no sign of rare light. */
static const double max_largest_share = 0.03;
/* Mean of the samples of a pixel, relative to the map, above which the pixel is brighter than the map says. Smaller
 * values only mean that the map is coarse. */
static const double bright_pixel_ratio = 8;
/* Instead of the tail index, the extreme-value index may show a finite variance: it is then below 0.5. It is 0.2 to 0.6
 * in effects-glass, where the tail index is 1.0 to 1.3 because the contributions have a broad but bounded range, and
 * where erpt4 needs 0.7 of the time of erpt. */
static const double finite_variance_value_index = 0.5;
/* Where path cannot find all light, `erpt4` is chosen only if path finds more than this fraction of it. The
 * fraction is 0.97 and 0.98 in random scenes where erpt4 needs 0.50 and 0.90 of the time of erpt, and 0.90 in one
 * where it needs 1.2 times that. */
static const double min_found_fraction = 0.9;

/* ---- contributions of samples */

/* Sums over samples of one kind, relative to the brightness of their places. */
struct contribution_tally {
	double samples, rays;
	size_t nonzero_count;		      /* terms that are not 0 */
	double variance, energy, rare_energy; /* variance: sum of the variances within pixels, and of the squares of
						 what lands elsewhere */
	struct tail *tail;
};

/* The contributions of one sample of a pixel: to this pixel, and to other places. */
struct pixel_parts {
	double own_pixel;
	uint32_t elsewhere_count;
	double elsewhere[PATH_SPLATS_MAX];
};

static void add_term(struct contribution_tally *t, double y)
{
	t->nonzero_count += y > 0;
	t->energy += y;
	t->rare_energy += fmax(y - RENDER_RARE_FACTOR, 0);
	tail_add(t->tail, y);
}

/* Adds the samples of a pixel. A pixel may be brighter than the map says, for example if it shows a small lamp.
 * Then all of its samples are too bright, so each is divided by the mean of the others if that exceeds 1.
 * Contributions to the pixel itself vary around its mean; contributions to other places land there at random, so
 * their variance is their square. */
static void add_pixel(struct contribution_tally *t, const struct pixel_parts *parts)
{
	double total = 0, sum = 0, squares = 0;
	for (int i = 0; i < SAMPLES_PER_PIXEL; i++)
		total += parts[i].own_pixel;
	for (int i = 0; i < SAMPLES_PER_PIXEL; i++) {
		double y = parts[i].own_pixel / fmax(1, (total - parts[i].own_pixel) / (SAMPLES_PER_PIXEL - 1));
		sum += y;
		squares += y * y;
		add_term(t, y);
		for (uint32_t k = 0; k < parts[i].elsewhere_count; k++) {
			t->variance += parts[i].elsewhere[k] * parts[i].elsewhere[k];
			add_term(t, parts[i].elsewhere[k]);
		}
	}
	t->variance += fmax(squares - sum * sum / SAMPLES_PER_PIXEL, 0) * SAMPLES_PER_PIXEL / (SAMPLES_PER_PIXEL - 1);
}

static const struct render_measurement no_measurement = {INFINITY, 0, 1, 1, 1, 0};

static struct render_measurement compute_measurement(const struct contribution_tally *t)
{
	struct render_measurement f = no_measurement;
	const struct tail *tail = t->tail;
	double variance = t->variance, mean = t->energy / t->samples;
	if (!(t->energy > 0))
		return f;
	tail_select_largest(t->tail);
	size_t dropped = t->samples > DROPPED_INTERVAL ? (size_t)t->samples / DROPPED_INTERVAL : 1;
	for (size_t i = 0; i < dropped && i < tail->count; i++)
		variance -= (tail->values[i] - mean) * (tail->values[i] - mean);
	if (t->nonzero_count > dropped)
		f.cost = fmax(variance, 0) / t->samples * t->rays / t->samples;
	f.tail_index = tail_index(tail, (size_t)t->samples / RENDER_TAIL_INTERVAL);
	f.extreme_tail_index = tail_index(tail, (size_t)t->samples / RENDER_EXTREME_INTERVAL);
	f.extreme_value_index = tail_extreme_value_index(tail, (size_t)t->samples / RENDER_EXTREME_VALUE_INTERVAL);
	f.largest_share = tail->values[0] / t->energy;
	/* A single sample does not prove rare light: it may show the edge of a lamp that the
	 * pixel's other samples missed. */
	double largest = tail->values[0], energy = t->energy - largest;
	if (energy > 0)
		f.rare_share = fmax(t->rare_energy - fmax(largest - RENDER_RARE_FACTOR, 0), 0) / energy;
	return f;
}

/* ---- the choice */

/* Whether the samples of path leave it possible that there is light that only chains find. */
static bool is_doubtful(const struct render_choice *c)
{
	return c->path_misses_light || c->path.rare_share > doubtful_rare_share ||
	       c->path.tail_index < finite_mean_tail_index;
}

/* Whether the largest samples of path agree with a finite variance. */
static bool has_finite_variance(const struct render_measurement *path)
{
	return path->tail_index >= finite_variance_tail_index ||
	       (path->extreme_value_index < finite_variance_value_index && path->rare_share <= doubtful_rare_share);
}

bool render_choice_is_settled(const struct render_choice *c)
{
	return c->merging.rare_share > chains_merging_share || (!is_doubtful(c) && !has_finite_variance(&c->path));
}

/* Whether merging finds most of the light and hardly any of that is rare for bdpt. */
static bool merging_rules_out_rare_light(const struct render_choice *c)
{
	return c->merging.seen_share > min_merging_seen_share && c->merging.rare_share < negligible_merging_share;
}

/* Whether the chains of hslt (not those of erpt) are needed. If path cannot find all light, bdpt's samples are
 * judged instead of path's. */
static bool needs_chains(const struct render_choice *c)
{
	const struct render_measurement *b = &c->bdpt, *p = c->path_misses_light ? b : &c->path;
	if (c->has_emitting_media)
		return false;
	if (c->path_is_dark && !merging_rules_out_rare_light(c))
		return true; /* a mistake costs 1,300 times the error in bulb, 2.5 times in kitchen */
	if (c->merging.rare_share > chains_merging_share)
		return c->path_misses_light || p->extreme_tail_index < chains_max_extreme_tail_index;
	if (render_choice_is_settled(c))
		return false;
	if (isinf(p->cost))
		return true; /* if there is no light at all, the bootstrap of chains looks for it much longer */
	return p->extreme_tail_index < chains_max_extreme_tail_index && b->rare_share > chains_rare_share &&
	       fmin(b->tail_index, b->extreme_tail_index) < chains_max_tail_index;
}

/* Whether more samples of bdpt would hardly change the choice. */
static bool choice_is_clear(const struct render_choice *c)
{
	const struct render_measurement *b = &c->bdpt, *p = &c->path;
	if (b->rare_share > clear_rare_share && b->tail_index < finite_mean_tail_index)
		return true;
	return !c->path_misses_light && isfinite(p->cost + b->cost) && b->rare_share <= negligible_rare_share &&
	       p->rare_share <= chains_rare_share && fmax(p->largest_share, b->largest_share) <= clear_largest_share &&
	       fmin(p->extreme_tail_index, b->extreme_tail_index) >= clear_extreme_tail_index;
}

/* Whether path has a finite variance, and no single bright sample. */
static bool has_no_fireflies(const struct render_measurement *path)
{
	return has_finite_variance(path) && path->largest_share <= max_largest_share;
}

/* Whether too much light is rare for path and for erpt4. */
static bool has_rare_light(const struct render_choice *c)
{
	return c->bdpt.rare_share > chains_rare_share ||
	       (c->path.rare_share > chains_rare_share && c->bdpt.extreme_tail_index < chains_max_extreme_tail_index);
}

/* Whether path misses little of the light and bdpt finds it evenly. */
static bool path_misses_little_light(const struct render_choice *c)
{
	return c->found_fraction > min_found_fraction && has_no_fireflies(&c->bdpt);
}

static bool path_is_cheaper(const struct render_choice *c)
{
	return !render_choice_is_settled(c) && has_finite_variance(&c->path) && c->path.cost <= c->bdpt.cost;
}

static bool has_short_tail(const struct render_measurement *path)
{
	return has_no_fireflies(path) && path->tail_index >= finite_variance_tail_index;
}

const char *render_choice_integrator(const struct render_choice *c)
{
	if (needs_chains(c))
		return RENDER_INTEGRATOR_CHAINS;
	if (has_rare_light(c) || !path_is_cheaper(c))
		return "erpt";
	if (c->path_misses_light)
		return path_misses_little_light(c) ? "erpt4" : "erpt";
	if (has_short_tail(&c->path) && !c->has_narrow_lobes)
		return "path";
	return has_short_tail(&c->path) && !c->is_brief && !c->has_transmission ? "bdpt8" : "erpt4";
}

/* ---- the pilot */

struct pilot {
	const struct world *w;
	uint64_t seed, sample_count;
	double path_mean; /* mean contribution of a sample, relative to the brightness of its place */
	struct path_context context;
	struct path_sample sample;
	struct brightness map;
	struct pixel_parts parts[SAMPLES_PER_PIXEL];
	struct path_sample compared_sample;
	uint64_t compared_count; /* splats of the current kind of samples that were compared with their pixels */
	struct tail tail;
	uint64_t counters[BATCH_COUNTERS], scratch_counters[BATCH_COUNTERS];
};

/* A sampler with film points within one pixel of the window. */
struct pixel_sampler {
	struct sampler_random random;
	double corner[2], size[2];
};

static const double *pixel_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct pixel_sampler *s = (struct pixel_sampler *)(void *)base;
	double *u = s->random.values[side];
	sampler_fill_block(s->random.seed, s->random.stream, s->random.index, s->random.step, side, vertex, u);
	if (side == SIDE_CAMERA && vertex == 0) {
		u[DIM_FILM_X] = s->corner[0] + u[DIM_FILM_X] * s->size[0];
		u[DIM_FILM_Y] = s->corner[1] + u[DIM_FILM_Y] * s->size[1];
	}
	return u;
}

/* Makes the map from samples of `path`, which are cheaper, unless it misses some light. */
static int make_map(struct pilot *p, bool misses, struct error *e)
{
	return brightness_init_from_samples(&p->map, &p->context, misses ? path_trace_candidates : path_trace, p->seed,
					    RNG_CHOICE, PILOT_MAP, p->sample_count, e);
}

/* Evaluates one sample of the pixel in that column and row of the window. */
static void trace_pixel(struct pilot *p, const double pixel[2], uint64_t index, uint64_t stream, path_tracer *trace,
			struct path_sample *out)
{
	const struct film_window *w = &p->context.window;
	struct pixel_sampler s = {.corner = {pixel[0] / w->width, pixel[1] / w->height},
				  .size = {1 / w->width, 1 / w->height}};
	sampler_random_init(&s.random, p->seed, RNG_CHOICE, index, stream);
	s.random.base.block = pixel_block;
	trace(&p->context, &s.random.base, out);
}

static double relative_brightness(const struct pilot *p, const struct splat *s)
{
	return (s->xyz[0] + s->xyz[1] + s->xyz[2]) * brightness_inverse_at(&p->map, s->x, s->y);
}

/* Compares a splat with samples of `path` in the same pixel, and returns y relative to their mean if the pixel is
 * brighter than the map says. Light sub-paths hit lamps, and mirror images of lamps, that are too small for the map.
 * These look like caustics that need chains, but samples of `path` find them, too. */
static double compare_with_pixel(struct pilot *p, const struct splat *s, double y)
{
	const struct film_window *w = &p->context.window;
	const double pixel[2] = {fmin(fmax(floor(s->x - w->x), 0), w->width - 1),
				 fmin(fmax(floor(s->y - w->y), 0), w->height - 1)};
	double mean = 0;
	p->context.counters = p->scratch_counters;
	for (unsigned k = 0; k < SAMPLES_PER_PIXEL; k++) {
		trace_pixel(p, pixel, p->compared_count * SAMPLES_PER_PIXEL + k, PILOT_COMPARED, path_trace,
			    &p->compared_sample);
		for (uint32_t i = 0; i < p->compared_sample.splat_count; i++)
			mean += relative_brightness(p, &p->compared_sample.splats[i]) / SAMPLES_PER_PIXEL;
	}
	p->context.counters = p->counters;
	p->compared_count++;
	return mean > bright_pixel_ratio ? y / mean : y;
}

/* Sorts the splats of a sample. The first one is that of the camera's sub-path, in its pixel; those of light
 * sub-paths land anywhere. */
static void split_sample(struct pilot *p, const struct film_window *pixel, struct pixel_parts *out)
{
	out->own_pixel = 0;
	out->elsewhere_count = 0;
	for (uint32_t k = 0; k < p->sample.splat_count; k++) {
		const struct splat *s = &p->sample.splats[k];
		const double film[2] = {s->x, s->y};
		double y = relative_brightness(p, s);
		if (k == 0 && film_window_contains(pixel, film))
			out->own_pixel = y;
		else if (y > RENDER_RARE_FACTOR && p->compared_count < p->sample_count / COMPARED_DIVISOR)
			out->elsewhere[out->elsewhere_count++] = compare_with_pixel(p, s, y);
		else
			out->elsewhere[out->elsewhere_count++] = y;
	}
}

/* Evaluates the samples from `first` to `end` of the stream and adds them to the tally. Returns the measurements. */
static struct render_measurement measure_samples(struct pilot *p, uint64_t stream, uint64_t first, uint64_t end,
						 path_tracer *trace, struct contribution_tally *t)
{
	const struct film_window *w = &p->context.window;
	for (uint64_t i = first / SAMPLES_PER_PIXEL; i < end / SAMPLES_PER_PIXEL; i++) {
		double u[4];
		liveness_tick();
		rng_uniform4(p->seed, RNG_CHOICE, i, PILOT_PIXEL, stream, u); /* random pixels */
		const double position[2] = {floor(u[0] * w->width), floor(u[1] * w->height)};
		struct film_window pixel = {w->x + position[0], w->y + position[1], 1, 1};
		for (unsigned k = 0; k < SAMPLES_PER_PIXEL; k++) {
			trace_pixel(p, position, i * SAMPLES_PER_PIXEL + k, stream, trace, &p->sample);
			split_sample(p, &pixel, &p->parts[k]);
		}
		add_pixel(t, p->parts);
	}
	t->samples = (double)(end / SAMPLES_PER_PIXEL * SAMPLES_PER_PIXEL);
	t->rays = (double)batch_ray_count(p->counters);
	return compute_measurement(t);
}

static struct contribution_tally begin_measurement(struct pilot *p)
{
	memset(p->counters, 0, sizeof p->counters);
	p->compared_count = 0;
	tail_clear(&p->tail);
	return (struct contribution_tally){.tail = &p->tail};
}

static void measure_path(struct pilot *p, struct render_choice *out)
{
	struct contribution_tally t = begin_measurement(p);
	out->path = measure_samples(p, PILOT_PATH, 0, p->sample_count, path_trace, &t);
	p->path_mean = t.energy / t.samples;
	out->sample_count += p->sample_count;
}

static void measure_bdpt(struct pilot *p, struct render_choice *out)
{
	struct contribution_tally t = begin_measurement(p);
	uint64_t first_count = p->sample_count / BDPT_FIRST_DIVISOR;
	out->bdpt = measure_samples(p, PILOT_BDPT, 0, first_count, path_trace_candidates, &t);
	out->sample_count += first_count;
	if (choice_is_clear(out))
		return;
	out->bdpt = measure_samples(p, PILOT_BDPT, first_count, p->sample_count, path_trace_candidates, &t);
	out->found_fraction = t.energy > 0 ? p->path_mean / (t.energy / t.samples) : 0;
	out->sample_count += p->sample_count - first_count;
}

/* Measures rare light by merging. Not needed if no lobe is narrow, because nothing is hidden from bdpt then; not
 * possible if media scatter. */
static int measure_merging(struct pilot *p, struct render_choice *out)
{
	uint64_t n = p->sample_count / MERGING_DIVISOR;
	n = n < MERGING_SAMPLES_MIN ? MERGING_SAMPLES_MIN : n > MERGING_SAMPLES_MAX ? MERGING_SAMPLES_MAX : n;
	if (!out->has_narrow_lobes || p->w->effects.scattering)
		return 0;
	out->sample_count += n;
	p->context.counters = p->scratch_counters;
	int rc = rare_light_estimate(&p->context, &p->map, p->seed, PILOT_MERGING, n, &out->merging);
	p->context.counters = p->counters;
	return rc;
}

/* Called if path finds almost nothing: all light comes through narrow lobes, and the map is black, so it is made
 * again by bdpt. In bulb, where bdpt finds the light on the walls but not their images in a mirror, merging calls
 * for chains, which are better by 1,300 x; in kitchen, where short pilots of path find nothing, merging does not
 * call for chains. */
static int remake_map_by_bdpt(struct pilot *p, struct render_choice *out, struct error *e)
{
	out->path_misses_light = out->path_is_dark = true;
	out->sample_count += p->sample_count;
	brightness_fini(&p->map);
	return make_map(p, true, e);
}

static int run_pilot(struct pilot *p, const struct plan *film, struct render_choice *out, struct error *e)
{
	path_context_init_for_samples(&p->context, p->w, film, p->counters);
	p->context.refract = halfvec_refract;
	int rc = tail_init(&p->tail, p->sample_count / RENDER_TAIL_INTERVAL + 1);
	rc = rc ? error_set(e, ENOMEM, "no memory for a pilot") : make_map(p, out->path_misses_light, e);
	if (!rc) {
		out->sample_count = p->sample_count;
		measure_path(p, out);
		if (isinf(out->path.cost) && !out->path_misses_light)
			rc = remake_map_by_bdpt(p, out, e);
		if (!rc && measure_merging(p, out))
			rc = error_set(e, ENOMEM, "no memory for a pilot");
		out->is_settled = render_choice_is_settled(out);
		if (!rc && !out->is_settled)
			measure_bdpt(p, out);
	}
	brightness_fini(&p->map);
	tail_fini(&p->tail);
	return rc;
}

/* Whether path cannot find all light: a path from the camera never hits a delta emitter, and is not joined to one
 * through an exactly specular lobe, nor to a beam. */
static bool path_misses_light(const struct world *w)
{
	bool has_delta_emitter = false, has_specular_lobe = world_has_beam(w);
	for (uint32_t i = 0; i < w->emitter_count; i++)
		has_delta_emitter = has_delta_emitter || w->emitters[i].is_delta;
	for (uint32_t i = 0; i < w->bsdf_count; i++)
		has_specular_lobe = has_specular_lobe || w->bsdfs[i].has_delta;
	return has_delta_emitter && has_specular_lobe;
}

/* Determines whether there are narrow lobes and refracting ones. Where media scatter, faces of `null` are not vertices,
 * so they neither focus nor refract. */
static void find_lobes(const struct world *w, const struct render_summary *s, struct render_choice *out)
{
	bool narrow = false, transmits = false;
	out->has_narrow_lobes = pilot_scene_has(s, "half-vectors");
	out->has_transmission = out->has_narrow_lobes && pilot_scene_has(s, "transmission");
	if (!w->effects.scattering)
		return;
	for (uint32_t i = 0; i < w->bsdf_count; i++) {
		const struct bsdf *b = &w->bsdfs[i];
		if (b->is_see_through)
			continue;
		narrow |= b->has_delta || (b->has_smooth && isfinite(b->min_alpha));
		transmits |= (b->modes & BSDF_TRANSMIT) != 0;
	}
	out->has_narrow_lobes &= narrow;
	out->has_transmission &= narrow && transmits;
}

int render_choose(const struct world *w, struct plan_request *r, struct render_choice *out, struct error *e)
{
	struct render_summary summary;
	struct plan film;
	*out = (struct render_choice){.path = no_measurement, .bdpt = no_measurement};
	world_summary(w, &summary);
	find_lobes(w, &summary, out);
	int rc = pilot_make_plan(r, &film, e);
	struct pilot *p = rc ? NULL : mem_alloc(1, sizeof *p);
	if (!rc && !p)
		rc = error_set(e, ENOMEM, "no memory for a pilot");
	if (!rc) {
		p->w = w;
		p->seed = r->seed;
		p->sample_count = pilot_samples(r, (uint64_t)film.crop_width * film.crop_height);
		out->is_brief = p->sample_count < PILOT_SAMPLES;
		out->path_misses_light = path_misses_light(w);
		out->has_emitting_media = w->effects.medium_light;
		rc = run_pilot(p, &film, out, e);
	}
	mem_free(p);
	if (rc)
		return rc;
	const struct integrator_properties *integrator = render_integrator_find(render_choice_integrator(out));
	memset(r->integrator, 0, sizeof r->integrator);
	memset(r->mixture, 0, sizeof r->mixture);
	snprintf(r->integrator, sizeof r->integrator, "%s", integrator->name);
	r->kind = integrator->kind;
	return integrator->has_mutations ? render_canonical_mutations(NULL, &summary, r->mixture, e) : 0;
}

static const char *choice_reason(const char *integrator, const struct render_choice *c)
{
	if (strcmp(integrator, "hslt") == 0)
		return isinf(c->path.cost) ? "paths from the camera find next to no light; chains search for it longest"
					   : "much of the light, such as caustics, arrives by few, very bright paths; "
					     "chains stay with those that they find";
	if (strcmp(integrator, "path") == 0)
		return "paths from the camera find the light evenly, and no surface focuses it";
	if (strcmp(integrator, "bdpt8") == 0)
		return "paths from the camera find the light evenly; as some surfaces may focus it, one sample in "
		       "eight also starts at the lamps, which avoids most fireflies";
	if (strcmp(integrator, "erpt4") == 0)
		return c->path_misses_light
			       ? "paths from the camera find the light evenly, except for a little that they cannot "
				 "find; one sample in four also starts at the lamps, and short chains spread what is too bright"
			       : "paths from the camera find the light evenly; as some contributions may still be "
				 "very bright, one sample in four also starts at the lamps, and what is too bright for a sample is "
				 "spread by short chains";
	if (c->path_misses_light)
		return "paths from the camera cannot find all light, such as that of a point light through glass";
	return has_no_fireflies(&c->path)
		       ? "paths from the camera and from the lamps, joined, leave less noise in the same time; what is "
			 "too bright for a sample is spread by short chains"
		       : "paths from the camera alone leave fireflies; joined with paths from the lamps they find the "
			 "light more evenly, and what is still too bright for a sample is spread by short chains";
}

void render_choice_text(const char *integrator, const struct render_choice *c, char *text, size_t size)
{
	snprintf(text, size, "%s, by a pilot: %s", integrator, choice_reason(integrator, c));
}
