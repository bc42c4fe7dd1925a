/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/choose.h"

#include "common/base/mem.h"
#include "common/base/liveness.h"
#include "common/estimate/tail.h"
#include "worker/render/path/integrator.h"
#include "worker/render/brightness.h"

#include <stdio.h>
#include <string.h>

enum {
	SAMPLES_LEAST =
		1 << 14, /* of 8,192 the tail says too little: 2.0 to 2.5 in cornell-box, 1.5 to 2.3 in three-spheres */
	SAMPLES_MOST = 1 << 18,
	SAMPLES_SHARE = 128, /* one of so many samples of the render, of each kind */
	SHORTER = 4,   /* of bdpt, where only its cost is asked for, and at first where chains may be called for */
	IN_PIXEL = 16, /* samples of one pixel */
	DROPPED = 3,   /* largest terms */
	STREAM_MAP = 0,
	STREAM_PATH,
	STREAM_BDPT,
	STREAM_PIXEL, /* steps of RNG_CHOICE */
};

/* Of the scenes of tests/bench/README.md: more in the four where chains win by factors (pane and frosted, eight seeds
 * each: 15 of 16 pilots of 8,192 samples, 16 of 16 of 16,384), 0.16 or less in all others but veach-door, where it is
 * 0.1 to 0.34. */
static const double rare_share = 0.28;
/* A quarter of bdpt's samples is enough where they say so much, and none of a mean: 30 of 44 pilots of frosted, water,
 * pane and window. In veach-door, the nearest of the others, 0.13 to 0.3 and a tail index of 1.25 to 1.73, 12 pilots.
 */
static const double rare_clear = 0.4, tail_clear_most = 1;
/* With 16,384 samples, five seeds each: the larger of both extremes is 0.67 to 0.79 in half-sunk, where chains are as
 * good as the others but for fireflies (four times better with them), and the smaller share of rare light 6 to 16 %. In
 * all other scenes that do not call for chains one of them is 1.03 or more but for one pilot of displaced: 0.82, with 3
 * % of the light rare. */
static const double extreme_least = 0.85, extreme_share = 0.05;
/* Light so rare that a pilot finds a few of its paths, by one of the two or the other: path sees what bdpt sees, but
 * for luck. In torus the larger of both shares is 0.16 to 0.57, six seeds, and bdpt's smaller index 0.47 to 0.87;
 * shares are 0.07 or less where bdpt is the best, but for veach-door: 0.26 to 0.54, and an index of 1.2 or more. */
static const double rare_some = 0.12, heavy_least = 0.9;
/* The same of path's tail: 2.1 to 2.8 in cornell-box and veach-mis and more in box, where path is the best by 1.2
 * to 1.4 x; 0.9 to 2.0 but for one of rough-caustic (2.3) in that, three-spheres, demo, displaced and veach-door, where
 * bdpt is, by up to 2.1 x (6 x with fireflies). */
static const double tail_least = 2.1;
/* From here on path's largest say that it has no fireflies: 4.0 to 4.6 in box, 2.2 to 2.8 in cornell-box and veach-mis.
 * Below, bdpt8 costs little more and bounds them: without the worst pixels 1.04 and 0.98 of path's relMSE times CPU
 * seconds in these two, of all pixels 1.03 and 0.64; in box 1.31. */
static const double tail_path = 3.3;
/* bdpt errs less than the pilot says: it has the shorter tails. */
static const double path_cost = 0.75;

/* ---- what samples bring */

/* Sums over samples of one kind, relative to the brightness of their places. */
struct tally {
	double samples, rays;
	double square, energy, rare;
	struct tail *tail;
};

/* One sample of a pixel: what it brings there, and to other places. */
struct parts {
	double here;
	uint32_t count;
	double elsewhere[PATH_MAX_SPLATS];
};

static void add_term(struct tally *t, double y)
{
	t->energy += y;
	t->rare += fmax(y - RENDER_RARE, 0);
	t->square += y * y;
	tail_add(t->tail, y);
}

/* A pixel that is brighter than the map knows, a lamp's, is so in all its samples: each is held against what the others
 * found, where that is more. */
static void add_pixel(struct tally *t, const struct parts *of)
{
	double all = 0;
	for (int i = 0; i < IN_PIXEL; i++)
		all += of[i].here;
	for (int i = 0; i < IN_PIXEL; i++) {
		add_term(t, of[i].here / fmax(1, (all - of[i].here) / (IN_PIXEL - 1)));
		for (uint32_t k = 0; k < of[i].count; k++)
			add_term(t, of[i].elsewhere[k]);
	}
}

static struct render_found found(const struct tally *t)
{
	struct render_found f = {0, 0, 1, 1};
	const struct tail *tail = t->tail;
	double square = t->square;
	if (!(t->energy > 0))
		return f;
	tail_settle(t->tail);
	for (size_t i = 0; i < DROPPED && i < tail->held; i++)
		square -= tail->y[i] * tail->y[i];
	f.cost = fmax(square, 0) / t->samples * t->rays / t->samples;
	f.tail = tail_index(tail, (size_t)t->samples / RENDER_TAIL);
	f.extreme = tail_index(tail, (size_t)t->samples / RENDER_EXTREME);
	/* One sample alone proves nothing: the edge of a lamp that the pixel's others missed. */
	double most = tail->y[0], energy = t->energy - most;
	if (energy > 0)
		f.rare = fmax(t->rare - fmax(most - RENDER_RARE, 0), 0) / energy;
	return f;
}

/* ---- the choice */

/* As far as one of the two says. No light: the bootstrap of chains looks for it much longer. */
static bool wants_chains(const struct render_found *f)
{
	return !(f->cost > 0) || f->rare > rare_share || (f->rare > extreme_share && f->extreme < extreme_least);
}

/* Of what path says, as far as it says anything: some light may be for chains alone. */
static bool is_doubtful(const struct render_choice *c)
{
	return c->misses || wants_chains(&c->path) || c->path.rare > rare_some;
}

bool render_choice_is_settled(const struct render_choice *c)
{
	return !is_doubtful(c) && c->path.tail < tail_least;
}

/* Both find light that is rare; or one does, and bdpt's largest fall off as if there were much more of it. */
static bool both_want_chains(const struct render_choice *c)
{
	double rare = fmax(c->misses ? 0 : c->path.rare, c->bdpt.rare);
	if (wants_chains(&c->bdpt) && (c->misses || wants_chains(&c->path)))
		return true;
	return rare > rare_some && fmin(c->bdpt.tail, c->bdpt.extreme) < heavy_least;
}

const char *render_choice_of(const struct render_choice *c)
{
	if (render_choice_is_settled(c))
		return "bdpt";
	if (both_want_chains(c))
		return "hslt";
	bool path =
		!c->misses && c->path.cost > 0 && c->path.tail >= tail_least && c->path.cost < path_cost * c->bdpt.cost;
	if (!path)
		return "bdpt";
	return c->path.tail >= tail_path && c->path.rare <= rare_some ? "path" : "bdpt8";
}

/* ---- the pilot */

struct pilot {
	const struct world *w;
	uint64_t seed, samples;
	struct path_context context;
	struct path_sample sample;
	struct brightness map;
	struct parts parts[IN_PIXEL];
	struct tail tail;
	uint64_t counters[BATCH_COUNTERS];
};

/* Film points within one pixel of the window. */
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

/* By `path`, which is the cheaper one, where it finds all. */
static int make_map(struct pilot *p, bool misses, struct error *e)
{
	int rc = brightness_init(&p->map, &p->context.window, p->samples, e);
	for (uint64_t i = 0; i < p->samples && !rc; i++) {
		struct sampler_random s;
		if (i % IN_PIXEL == 0)
			tick();
		sampler_random_init(&s, p->seed, RNG_CHOICE, i, STREAM_MAP);
		(misses ? path_trace_both_ways : path_trace)(&p->context, &s.base, &p->sample);
		for (uint32_t k = 0; k < p->sample.count; k++)
			brightness_add(&p->map, &p->sample.splats[k]);
	}
	if (!rc)
		brightness_settle(&p->map, p->samples);
	return rc;
}

/* The camera's sub-path brings its pixel one splat, the first; those of light sub-paths land anywhere. */
static void take_parts(const struct pilot *p, const struct film_window *pixel, struct parts *out)
{
	out->here = 0;
	out->count = 0;
	for (uint32_t k = 0; k < p->sample.count; k++) {
		const struct splat *s = &p->sample.splats[k];
		const double film[2] = {s->x, s->y};
		double y = (s->xyz[0] + s->xyz[1] + s->xyz[2]) * brightness_scale(&p->map, s->x, s->y);
		if (k == 0 && film_window_holds(pixel, film))
			out->here = y;
		else
			out->elsewhere[out->count++] = y;
	}
}

typedef void tracer(struct path_context *, struct sampler *, struct path_sample *);

/* From sample first to sample end of the stream, on top of what the tally has. */
static struct render_found look_on(struct pilot *p, uint64_t stream, uint64_t first, uint64_t end, tracer *trace,
				   struct tally *t)
{
	const struct film_window *w = &p->context.window;
	for (uint64_t i = first / IN_PIXEL; i < end / IN_PIXEL; i++) {
		double u[4];
		tick();
		rng_uniform4(p->seed, RNG_CHOICE, i, STREAM_PIXEL, stream, u); /* pixels of its own */
		double column = floor(u[0] * w->width), row = floor(u[1] * w->height);
		struct film_window pixel = {w->x + column, w->y + row, 1, 1};
		for (unsigned k = 0; k < IN_PIXEL; k++) {
			struct pixel_sampler s = {.corner = {column / w->width, row / w->height},
						  .size = {1 / w->width, 1 / w->height}};
			sampler_random_init(&s.random, p->seed, RNG_CHOICE, i * IN_PIXEL + k, stream);
			s.random.base.block = pixel_block;
			trace(&p->context, &s.random.base, &p->sample);
			take_parts(p, &pixel, &p->parts[k]);
		}
		add_pixel(t, p->parts);
	}
	t->samples = (double)(end / IN_PIXEL * IN_PIXEL);
	t->rays = (double)(p->counters[COUNT_RAYS_CLOSEST] + p->counters[COUNT_RAYS_SHADOW]);
	return found(t);
}

static struct tally begin_look(struct pilot *p)
{
	memset(p->counters, 0, sizeof p->counters);
	tail_clear(&p->tail);
	return (struct tally){.tail = &p->tail};
}

static void look_at_path(struct pilot *p, struct render_choice *out)
{
	struct tally t = begin_look(p);
	out->path = look_on(p, STREAM_PATH, 0, p->samples, path_trace, &t);
	out->samples += p->samples;
}

static void look_at_bdpt(struct pilot *p, struct render_choice *out)
{
	struct tally t = begin_look(p);
	uint64_t few = p->samples / SHORTER;
	out->bdpt = look_on(p, STREAM_BDPT, 0, few, path_trace_both_ways, &t);
	out->samples += few;
	bool only_cost = !is_doubtful(out) && !(out->bdpt.rare > rare_some);
	if (only_cost || (out->bdpt.rare > rare_clear && out->bdpt.tail < tail_clear_most))
		return;
	out->bdpt = look_on(p, STREAM_BDPT, few, p->samples, path_trace_both_ways, &t);
	out->samples += p->samples - few;
}

/* The nearest power of two, so that nearly equal renders have equal pilots. */
static uint64_t pilot_samples(const struct plan_request *r, uint64_t pixels)
{
	uint64_t total = UINT64_MAX, n = SAMPLES_LEAST;
	if (r->spp && r->spp < UINT64_MAX / pixels)
		total = r->spp * pixels;
	if (r->mutations && r->mutations < total)
		total = r->mutations;
	while (n < SAMPLES_MOST && (double)n * M_SQRT2 < (double)(total / SAMPLES_SHARE))
		n *= 2;
	return n;
}

/* The film and the random numbers of the render, checked as it will be; then all of the film, so that a crop is
 * rendered by what the whole is rendered by and has its pixels. */
static int film_of(const struct plan_request *r, struct plan *p, struct error *e)
{
	struct plan_request of = *r;
	memset(of.integrator, 0, sizeof of.integrator);
	memset(of.mixture, 0, sizeof of.mixture);
	snprintf(of.integrator, sizeof of.integrator, "path");
	of.kind = PLAN_SAMPLES;
	of.chains = 0;
	of.groups = of.parts = 1;
	int rc = plan_make(&of, p, e);
	p->crop_x = p->crop_y = 0;
	p->crop_width = p->width;
	p->crop_height = p->height;
	return rc;
}

static int run(struct pilot *p, const struct plan *film, struct render_choice *out, struct error *e)
{
	p->context = (struct path_context){.w = p->w,
					   .window = film_window_of(film),
					   .min_depth = film->min_depth,
					   .max_depth = film->max_depth,
					   .roulette = true,
					   .unclassed = true,
					   .counters = p->counters};
	int rc = tail_init(&p->tail, p->samples / RENDER_TAIL + 1);
	rc = rc ? error_set(e, ENOMEM, "no memory for a pilot") : make_map(p, out->misses, e);
	if (!rc) {
		out->samples = p->samples;
		look_at_path(p, out);
		out->settled = render_choice_is_settled(out);
		if (!out->settled)
			look_at_bdpt(p, out);
	}
	brightness_fini(&p->map);
	tail_fini(&p->tail);
	return rc;
}

/* A path from the camera never meets a delta emitter, and is not joined to one through an exactly specular lobe. */
static bool path_misses(const struct world *w)
{
	bool emitter = false, lobe = false;
	for (uint32_t i = 0; i < w->emitter_count; i++)
		emitter = emitter || w->emitters[i].delta;
	for (uint32_t i = 0; i < w->bsdf_count; i++)
		lobe = lobe || w->bsdfs[i].has_delta;
	return emitter && lobe;
}

int render_choose(const struct world *w, struct plan_request *r, struct render_choice *out, struct error *e)
{
	struct render_summary summary;
	struct plan film;
	*out = (struct render_choice){.path = {0, 0, 1, 1}, .bdpt = {0, 0, 1, 1}};
	int rc = film_of(r, &film, e);
	struct pilot *p = rc ? NULL : mem_alloc(1, sizeof *p);
	if (!rc && !p)
		rc = error_set(e, ENOMEM, "no memory for a pilot");
	if (!rc) {
		p->w = w;
		p->seed = r->seed;
		p->samples = pilot_samples(r, (uint64_t)film.crop_width * film.crop_height);
		out->misses = path_misses(w);
		rc = run(p, &film, out, e);
	}
	mem_free(p);
	if (rc)
		return rc;
	const struct render_integrator *chosen = render_integrator_find(render_choice_of(out));
	memset(r->integrator, 0, sizeof r->integrator);
	memset(r->mixture, 0, sizeof r->mixture);
	snprintf(r->integrator, sizeof r->integrator, "%s", chosen->name);
	r->kind = chosen->kind;
	world_summary(w, &summary);
	return chosen->has_mutations ? render_mutations(NULL, &summary, r->mixture, e) : 0;
}

void render_choice_text(const char *integrator, const struct render_choice *c, char *text, size_t size)
{
	const struct render_found *p = &c->path, *b = &c->bdpt;
	int n = snprintf(
		text, size,
		"%s, by a pilot: path: %.3g %% of the light beyond %d times the brightness of its place, tail index %.2f, "
		"of the extreme %.2f, second moment times rays %.3g",
		integrator, 100 * p->rare, RENDER_RARE, p->tail, p->extreme, p->cost);
	if (n < 0 || (size_t)n >= size)
		return;
	if (c->settled)
		snprintf(text + n, size - (size_t)n, "; so bdpt was not tried");
	else
		snprintf(text + n, size - (size_t)n, "; bdpt: %.3g %%, %.2f, %.2f, %.3g", 100 * b->rare, b->tail,
			 b->extreme, b->cost);
}
