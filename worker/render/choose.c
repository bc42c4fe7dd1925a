/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chooses the integrator from a pilot; choose.h explains the method.
 *
 * render_choose makes a map of brightness from samples of `path`, then a second set of samples of `path` relative to
 * this map. If a lobe of the scene is narrow, it merges light with sub-paths of the camera. If that leaves the choice
 * open, it takes samples of `bdpt`: a quarter of them first, and the rest unless the quarter is clear. render_choice_of
 * then compares the measurements with the thresholds below, which were set from pilots of 16,384 samples, 40 in each
 * scene of tests/bench/choices.md.
 *
 * If `path` cannot find the light, the map is made by `bdpt` instead. -ENOMEM: no memory for the pilot. -EINVAL: the
 * request has no valid film.
 */
#include "worker/render/choose.h"

#include "common/base/mem.h"
#include "common/base/liveness.h"
#include "common/estimate/tail.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrate_path.h"
#include "worker/render/path/integrator.h"
#include "worker/render/pilot.h"

#include <stdio.h>
#include <string.h>

enum {
	SHORTER = 4,   /* bdpt takes 1/4 of its samples first */
	IN_PIXEL = 16, /* consecutive samples in one pixel */
	MERGED = 4,    /* merging has 1/4 of the samples, within the two bounds below */
	MERGED_LEAST = 1 << 12,
	MERGED_MOST = 1 << 16, /* photons take memory */
	BESIDE = 128,	       /* at most 1/128 of the samples have a splat that is compared with its pixel */
	DROPPED = 1 << 12,     /* the variance omits the largest terms, one per 4,096 samples */
};

/* If path finds a larger share of rare light, or a smaller tail index (no finite mean), chains may be needed. */
static const double rare_hint = 0.03, tail_mean = 1;
/* Share of rare light, for bdpt or for path, from which chains are needed. For bdpt it is 0.16 or more in the scenes
 * where chains win by factors, except torus; in the others 0.12 or less, except veach-door with 0.05 to 0.33. */
static const double rare_some = 0.12;
/* If the share exceeds rare_some, the smaller of bdpt's two tail indices must also be below this for chains to be
 * needed. It is at most 1.2 where chains win, and 1.23 to 2.0 in veach-door. */
static const double heavy_most = 1.25;
/* The tail index of path's extremes must also be below this, whatever the share of rare light. It is 0.3 to 0.6 in
 * window, pane and frosted: there camera sub-paths rarely meet the light, so too few samples of bdpt begin a chain. It
 * is 1.5 to 2.6 in water, pool and torus: there light sub-paths find the rest, and the chains of erpt need 0.01 to 0.9
 * of the time of those of hslt. */
static const double lucky_extreme = 1;
/* Limit on the share of the light that merging finds to be rare for bdpt; above it, chains may be needed. The share
 * is 0.05 to 0.35 in water, frosted, pane, torus and pool, 0.02 to 0.03 in half-sunk, and at most 0.008 where chains
 * lose. */
static const double merged_rare = 0.03;
/* If merging finds more than merged_seen of all light, and less than merged_none of it is rare for bdpt, chains are not
 * needed, even if light is rare for path. In kitchen, where short pilots of path find almost nothing, these are 0.62 to
 * 0.84 and 0.003 to 0.006. */
static const double merged_none = 0.01, merged_seen = 0.4;
/* A quarter of bdpt's samples is enough if bdpt finds more rare light than this, and a tail without a mean. */
static const double rare_clear = 0.4;
/* It is also enough if bdpt finds less rare light than rare_none and path finds little, the extremes of both have a
 * tail index of at least extreme_clear, and no single sample has more than most_clear of the light. In jewel, the rest
 * of bdpt's samples found a third of the light, of which the first quarter had found nothing. */
static const double rare_none = 0.01, extreme_clear = 0.9, most_clear = 0.05;
/* The tail index of path from which its variance is taken to be finite. It is 2.0 to 2.8 in cornell-box and veach-mis
 * and more in box, where path wins by 1.1 to 2.4 x. It is 0.9 to 2.1 in rough-caustic, three-spheres, demo, displaced
 * and veach-door, where path loses. */
static const double tail_least = 2.1;
/* For path and bdpt8, no sample may have more than this share of the light. It is at most 0.01 in cornell-box, box and
 * effects-glass, and 0.1 in the median pilot of pool, where the other samples show no sign of rare light. */
static const double most_tame = 0.03;
/* Mean of the samples of a pixel, relative to the map, above which the pixel is brighter than the map says. Smaller
 * values only mean that the map is coarse. */
static const double bright = 8;
/* Instead of the tail index, the extreme-value index may show a finite variance: it is then below 0.5. It is 0.2 to 0.6
 * in effects-glass, where the tail index is 1.0 to 1.3 because the contributions have a broad but bounded range, and
 * where erpt4 needs 0.7 of the time of erpt. */
static const double evi_most = 0.5;
/* Where path cannot find all light, `erpt4` is chosen only if path finds more than this fraction of it. The
 * fraction is 0.97 and 0.98 in random scenes where erpt4 needs 0.50 and 0.90 of the time of erpt, and 0.90 in one
 * where it needs 1.2 times that. */
static const double missed_little = 0.9;

/* ---- contributions of samples */

/* Sums over samples of one kind, relative to the brightness of their places. */
struct tally {
	double samples, rays;
	size_t lit; /* terms that are not 0 */
	double variance, energy,
		rare; /* variance: sum of the variances within pixels, and of the squares of what lands elsewhere */
	struct tail *tail;
};

/* The contributions of one sample of a pixel: to this pixel, and to other places. */
struct parts {
	double here;
	uint32_t count;
	double elsewhere[PATH_MAX_SPLATS];
};

static void add_term(struct tally *t, double y)
{
	t->lit += y > 0;
	t->energy += y;
	t->rare += fmax(y - RENDER_RARE, 0);
	tail_add(t->tail, y);
}

/* Adds the samples of a pixel. A pixel may be brighter than the map says, for example if it shows a small lamp.
 * Then all of its samples are too bright, so each is divided by the mean of the others if that exceeds 1.
 * Contributions to the pixel itself vary around its mean; contributions to other places land there at random, so
 * their variance is their square. */
static void add_pixel(struct tally *t, const struct parts *of)
{
	double all = 0, sum = 0, squares = 0;
	for (int i = 0; i < IN_PIXEL; i++)
		all += of[i].here;
	for (int i = 0; i < IN_PIXEL; i++) {
		double y = of[i].here / fmax(1, (all - of[i].here) / (IN_PIXEL - 1));
		sum += y;
		squares += y * y;
		add_term(t, y);
		for (uint32_t k = 0; k < of[i].count; k++) {
			t->variance += of[i].elsewhere[k] * of[i].elsewhere[k];
			add_term(t, of[i].elsewhere[k]);
		}
	}
	t->variance += fmax(squares - sum * sum / IN_PIXEL, 0) * IN_PIXEL / (IN_PIXEL - 1);
}

static const struct render_found render_found_none = {INFINITY, 0, 1, 1, 1, 0};

static struct render_found found_light(const struct tally *t)
{
	struct render_found f = render_found_none;
	const struct tail *tail = t->tail;
	double variance = t->variance, mean = t->energy / t->samples;
	if (!(t->energy > 0))
		return f;
	tail_settle(t->tail);
	size_t dropped = t->samples > DROPPED ? (size_t)t->samples / DROPPED : 1;
	for (size_t i = 0; i < dropped && i < tail->held; i++)
		variance -= (tail->y[i] - mean) * (tail->y[i] - mean);
	if (t->lit > dropped)
		f.cost = fmax(variance, 0) / t->samples * t->rays / t->samples;
	f.tail = tail_index(tail, (size_t)t->samples / RENDER_TAIL);
	f.extreme = tail_index(tail, (size_t)t->samples / RENDER_EXTREME);
	f.evi = tail_evi(tail, (size_t)t->samples / RENDER_EVI);
	f.most = tail->y[0] / t->energy;
	/* A single sample does not prove rare light: it may show the edge of a lamp that the
	 * pixel's other samples missed. */
	double most = tail->y[0], energy = t->energy - most;
	if (energy > 0)
		f.rare = fmax(t->rare - fmax(most - RENDER_RARE, 0), 0) / energy;
	return f;
}

/* ---- the choice */

/* Whether the samples of path leave it possible that there is light that only chains find. */
static bool is_doubtful(const struct render_choice *c)
{
	return c->misses || c->path.rare > rare_hint || c->path.tail < tail_mean;
}

/* Whether the largest samples of path agree with a finite variance. */
static bool is_tame(const struct render_found *path)
{
	return path->tail >= tail_least || (path->evi < evi_most && path->rare <= rare_hint);
}

bool render_choice_is_settled(const struct render_choice *c)
{
	return c->merged.share > merged_rare || (!is_doubtful(c) && !is_tame(&c->path));
}

/* Whether merging finds most of the light and hardly any of that is rare for bdpt. */
static bool is_seen(const struct render_choice *c)
{
	return c->merged.seen > merged_seen && c->merged.share < merged_none;
}

/* Whether the chains of hslt (not those of erpt) are needed. If path cannot find all light, bdpt's samples are
 * judged instead of path's. */
static bool wants_chains(const struct render_choice *c)
{
	const struct render_found *b = &c->bdpt, *p = c->misses ? b : &c->path;
	if (c->media_shine)
		return false;
	if (c->dark && !is_seen(c))
		return true; /* a mistake costs 1,300 times the error in bulb, 2.5 times in kitchen */
	if (c->merged.share > merged_rare)
		return c->misses || p->extreme < lucky_extreme;
	if (render_choice_is_settled(c))
		return false;
	if (isinf(p->cost))
		return true; /* if there is no light at all, the bootstrap of chains looks for it much longer */
	return p->extreme < lucky_extreme && b->rare > rare_some && fmin(b->tail, b->extreme) < heavy_most;
}

/* Whether more samples of bdpt would hardly change the choice. */
static bool is_clear(const struct render_choice *c)
{
	const struct render_found *b = &c->bdpt, *p = &c->path;
	if (b->rare > rare_clear && b->tail < tail_mean)
		return true;
	return !c->misses && isfinite(p->cost + b->cost) && b->rare <= rare_none && p->rare <= rare_some &&
	       fmax(p->most, b->most) <= most_clear && fmin(p->extreme, b->extreme) >= extreme_clear;
}

/* Whether path has a finite variance, and no single bright sample. */
static bool has_no_fireflies(const struct render_found *path)
{
	return is_tame(path) && path->most <= most_tame;
}

/* Whether too much light is rare for path and for erpt4. */
static bool has_rare_light(const struct render_choice *c)
{
	return c->bdpt.rare > rare_some || (c->path.rare > rare_some && c->bdpt.extreme < lucky_extreme);
}

/* Whether path misses little of the light and bdpt finds it evenly. */
static bool misses_little(const struct render_choice *c)
{
	return c->found > missed_little && has_no_fireflies(&c->bdpt);
}

static bool path_is_cheaper(const struct render_choice *c)
{
	return !render_choice_is_settled(c) && is_tame(&c->path) && c->path.cost <= c->bdpt.cost;
}

static bool is_short(const struct render_found *path)
{
	return has_no_fireflies(path) && path->tail >= tail_least;
}

const char *render_choice_of(const struct render_choice *c)
{
	if (wants_chains(c))
		return RENDER_INTEGRATOR_CHAINS;
	if (has_rare_light(c) || !path_is_cheaper(c))
		return "erpt";
	if (c->misses)
		return misses_little(c) ? "erpt4" : "erpt";
	if (is_short(&c->path) && !c->focuses)
		return "path";
	return is_short(&c->path) && !c->brief && !c->refracts ? "bdpt8" : "erpt4";
}

/* ---- the pilot */

struct pilot {
	const struct world *w;
	uint64_t seed, samples;
	double path_mean; /* mean contribution of a sample, relative to the brightness of its place */
	struct path_context context;
	struct path_sample sample;
	struct brightness map;
	struct parts parts[IN_PIXEL];
	struct path_sample beside;
	uint64_t besides; /* splats of the current kind of samples that were compared with their pixels */
	struct tail tail;
	uint64_t counters[BATCH_COUNTERS], uncounted[BATCH_COUNTERS];
};

/* A sampler with film points within one pixel of the window. */
struct pixel_sampler {
	struct sampler_random random;
	double corner[2], size[2];
};

static const double *pixel_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	struct pixel_sampler *s = (struct pixel_sampler *)(void *)base;
	double *u = s->random.value[side];
	sampler_fill(s->random.seed, s->random.stream, s->random.index, s->random.step, side, vertex, u);
	if (side == SIDE_CAMERA && vertex == 0) {
		u[DIM_FILM_X] = s->corner[0] + u[DIM_FILM_X] * s->size[0];
		u[DIM_FILM_Y] = s->corner[1] + u[DIM_FILM_Y] * s->size[1];
	}
	return u;
}

/* Makes the map from samples of `path`, which are cheaper, unless it misses some light. */
static int make_map(struct pilot *p, bool misses, struct error *e)
{
	return brightness_of_samples(&p->map, &p->context, misses ? path_trace_candidates : path_trace, p->seed,
				     RNG_CHOICE, PILOT_MAP, p->samples, e);
}

/* Evaluates one sample of the pixel in that column and row of the window. */
static void trace_pixel(struct pilot *p, const double at[2], uint64_t index, uint64_t stream, path_tracer *trace,
			struct path_sample *out)
{
	const struct film_window *w = &p->context.window;
	struct pixel_sampler s = {.corner = {at[0] / w->width, at[1] / w->height},
				  .size = {1 / w->width, 1 / w->height}};
	sampler_random_init(&s.random, p->seed, RNG_CHOICE, index, stream);
	s.random.base.block = pixel_block;
	trace(&p->context, &s.random.base, out);
}

static double relative(const struct pilot *p, const struct splat *s)
{
	return (s->xyz[0] + s->xyz[1] + s->xyz[2]) * brightness_scale(&p->map, s->x, s->y);
}

/* Compares a splat with samples of `path` in the same pixel, and returns y relative to their mean if the pixel is
 * brighter than the map says. Light sub-paths hit lamps, and mirror images of lamps, that are too small for the map.
 * These look like caustics that need chains, but samples of `path` find them, too. */
static double held_against_its_pixel(struct pilot *p, const struct splat *s, double y)
{
	const struct film_window *w = &p->context.window;
	const double at[2] = {fmin(fmax(floor(s->x - w->x), 0), w->width - 1),
			      fmin(fmax(floor(s->y - w->y), 0), w->height - 1)};
	double mean = 0;
	p->context.counters = p->uncounted;
	for (unsigned k = 0; k < IN_PIXEL; k++) {
		trace_pixel(p, at, p->besides * IN_PIXEL + k, PILOT_BESIDE, path_trace, &p->beside);
		for (uint32_t i = 0; i < p->beside.count; i++)
			mean += relative(p, &p->beside.splats[i]) / IN_PIXEL;
	}
	p->context.counters = p->counters;
	p->besides++;
	return mean > bright ? y / mean : y;
}

/* Sorts the splats of a sample. The first one is that of the camera's sub-path, in its pixel; those of light
 * sub-paths land anywhere. */
static void take_parts(struct pilot *p, const struct film_window *pixel, struct parts *out)
{
	out->here = 0;
	out->count = 0;
	for (uint32_t k = 0; k < p->sample.count; k++) {
		const struct splat *s = &p->sample.splats[k];
		const double film[2] = {s->x, s->y};
		double y = relative(p, s);
		if (k == 0 && film_window_holds(pixel, film))
			out->here = y;
		else if (y > RENDER_RARE && p->besides < p->samples / BESIDE)
			out->elsewhere[out->count++] = held_against_its_pixel(p, s, y);
		else
			out->elsewhere[out->count++] = y;
	}
}

/* Evaluates the samples from `first` to `end` of the stream and adds them to the tally. Returns the measurements. */
static struct render_found look_on(struct pilot *p, uint64_t stream, uint64_t first, uint64_t end, path_tracer *trace,
				   struct tally *t)
{
	const struct film_window *w = &p->context.window;
	for (uint64_t i = first / IN_PIXEL; i < end / IN_PIXEL; i++) {
		double u[4];
		liveness_tick();
		rng_uniform4(p->seed, RNG_CHOICE, i, PILOT_PIXEL, stream, u); /* random pixels */
		const double at[2] = {floor(u[0] * w->width), floor(u[1] * w->height)};
		struct film_window pixel = {w->x + at[0], w->y + at[1], 1, 1};
		for (unsigned k = 0; k < IN_PIXEL; k++) {
			trace_pixel(p, at, i * IN_PIXEL + k, stream, trace, &p->sample);
			take_parts(p, &pixel, &p->parts[k]);
		}
		add_pixel(t, p->parts);
	}
	t->samples = (double)(end / IN_PIXEL * IN_PIXEL);
	t->rays = (double)batch_rays(p->counters);
	return found_light(t);
}

static struct tally begin_look(struct pilot *p)
{
	memset(p->counters, 0, sizeof p->counters);
	p->besides = 0;
	tail_clear(&p->tail);
	return (struct tally){.tail = &p->tail};
}

static void look_at_path(struct pilot *p, struct render_choice *out)
{
	struct tally t = begin_look(p);
	out->path = look_on(p, PILOT_PATH, 0, p->samples, path_trace, &t);
	p->path_mean = t.energy / t.samples;
	out->samples += p->samples;
}

static void look_at_bdpt(struct pilot *p, struct render_choice *out)
{
	struct tally t = begin_look(p);
	uint64_t few = p->samples / SHORTER;
	out->bdpt = look_on(p, PILOT_BDPT, 0, few, path_trace_candidates, &t);
	out->samples += few;
	if (is_clear(out))
		return;
	out->bdpt = look_on(p, PILOT_BDPT, few, p->samples, path_trace_candidates, &t);
	out->found = t.energy > 0 ? p->path_mean / (t.energy / t.samples) : 0;
	out->samples += p->samples - few;
}

/* Measures rare light by merging. Not needed if no lobe is narrow, because nothing is hidden from bdpt then; not
 * possible if media scatter. */
static int look_at_merged(struct pilot *p, struct render_choice *out)
{
	uint64_t n = p->samples / MERGED;
	n = n < MERGED_LEAST ? MERGED_LEAST : n > MERGED_MOST ? MERGED_MOST : n;
	if (!out->focuses || p->w->effects.scattering)
		return 0;
	out->samples += n;
	p->context.counters = p->uncounted;
	int rc = rare_light(&p->context, &p->map, p->seed, PILOT_MERGED, n, &out->merged);
	p->context.counters = p->counters;
	return rc;
}

/* Called if path finds almost nothing: all light comes through narrow lobes, and the map is black, so it is made
 * again by bdpt. In bulb, where bdpt finds the light on the walls but not their images in a mirror, merging calls
 * for chains, which are better by 1,300 x; in kitchen, where short pilots of path find nothing, merging does not
 * call for chains. */
static int see_what_path_misses(struct pilot *p, struct render_choice *out, struct error *e)
{
	out->misses = out->dark = true;
	out->samples += p->samples;
	brightness_fini(&p->map);
	return make_map(p, true, e);
}

static int run_pilot(struct pilot *p, const struct plan *film, struct render_choice *out, struct error *e)
{
	path_context_for_samples(&p->context, p->w, film, p->counters);
	p->context.refract = halfvec_refract;
	int rc = tail_init(&p->tail, p->samples / RENDER_TAIL + 1);
	rc = rc ? error_set(e, ENOMEM, "no memory for a pilot") : make_map(p, out->misses, e);
	if (!rc) {
		out->samples = p->samples;
		look_at_path(p, out);
		if (isinf(out->path.cost) && !out->misses)
			rc = see_what_path_misses(p, out, e);
		if (!rc && look_at_merged(p, out))
			rc = error_set(e, ENOMEM, "no memory for a pilot");
		out->settled = render_choice_is_settled(out);
		if (!rc && !out->settled)
			look_at_bdpt(p, out);
	}
	brightness_fini(&p->map);
	tail_fini(&p->tail);
	return rc;
}

/* Whether path cannot find all light: a path from the camera never hits a delta emitter, and is not joined to one
 * through an exactly specular lobe, nor to a beam. */
static bool path_misses(const struct world *w)
{
	bool emitter = false, lobe = world_has_beam(w);
	for (uint32_t i = 0; i < w->emitter_count; i++)
		emitter = emitter || w->emitters[i].delta;
	for (uint32_t i = 0; i < w->bsdf_count; i++)
		lobe = lobe || w->bsdfs[i].has_delta;
	return emitter && lobe;
}

/* Determines whether there are narrow lobes and refracting ones. Where media scatter, faces of `null` are not vertices,
 * so they neither focus nor refract. */
static void find_lobes(const struct world *w, const struct render_summary *s, struct render_choice *out)
{
	bool narrow = false, transmits = false;
	out->focuses = pilot_scene_has(s, "half-vectors");
	out->refracts = out->focuses && pilot_scene_has(s, "transmission");
	if (!w->effects.scattering)
		return;
	for (uint32_t i = 0; i < w->bsdf_count; i++) {
		const struct bsdf *b = &w->bsdfs[i];
		if (b->passes)
			continue;
		narrow |= b->has_delta || (b->has_smooth && isfinite(b->alpha));
		transmits |= (b->modes & BSDF_TRANSMIT) != 0;
	}
	out->focuses &= narrow;
	out->refracts &= narrow && transmits;
}

int render_choose(const struct world *w, struct plan_request *r, struct render_choice *out, struct error *e)
{
	struct render_summary summary;
	struct plan film;
	*out = (struct render_choice){.path = render_found_none, .bdpt = render_found_none};
	world_summary(w, &summary);
	find_lobes(w, &summary, out);
	int rc = pilot_film(r, &film, e);
	struct pilot *p = rc ? NULL : mem_alloc(1, sizeof *p);
	if (!rc && !p)
		rc = error_set(e, ENOMEM, "no memory for a pilot");
	if (!rc) {
		p->w = w;
		p->seed = r->seed;
		p->samples = pilot_samples(r, (uint64_t)film.crop_width * film.crop_height);
		out->brief = p->samples < PILOT_SAMPLES;
		out->misses = path_misses(w);
		out->media_shine = w->effects.medium_light;
		rc = run_pilot(p, &film, out, e);
	}
	mem_free(p);
	if (rc)
		return rc;
	const struct render_integrator *chosen = render_integrator_find(render_choice_of(out));
	memset(r->integrator, 0, sizeof r->integrator);
	memset(r->mixture, 0, sizeof r->mixture);
	snprintf(r->integrator, sizeof r->integrator, "%s", chosen->name);
	r->kind = chosen->kind;
	return chosen->has_mutations ? render_mutations(NULL, &summary, r->mixture, e) : 0;
}

static const char *reason_of(const char *integrator, const struct render_choice *c)
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
		return c->misses
			       ? "paths from the camera find the light evenly, except for a little that they cannot "
				 "find; one sample in four also starts at the lamps, and short chains spread what is too bright"
			       : "paths from the camera find the light evenly; as some contributions may still be "
				 "very bright, one sample in four also starts at the lamps, and what is too bright for a sample is "
				 "spread by short chains";
	if (c->misses)
		return "paths from the camera cannot find all light, such as that of a point light through glass";
	return has_no_fireflies(&c->path)
		       ? "paths from the camera and from the lamps, joined, leave less noise in the same time; what is "
			 "too bright for a sample is spread by short chains"
		       : "paths from the camera alone leave fireflies; joined with paths from the lamps they find the "
			 "light more evenly, and what is still too bright for a sample is spread by short chains";
}

void render_choice_text(const char *integrator, const struct render_choice *c, char *text, size_t size)
{
	snprintf(text, size, "%s, by a pilot: %s", integrator, reason_of(integrator, c));
}
