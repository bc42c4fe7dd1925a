#include "worker/render/choose.h"

#include "common/base/mem.h"
#include "common/base/tick.h"
#include "worker/path/integrator.h"
#include "worker/render/brightness.h"

#include <stdio.h>
#include <string.h>

enum {
	SAMPLES_LEAST = 1 << 13,
	SAMPLES_MOST = 1 << 15,
	SAMPLES_SHARE = 128, /* one of so many samples of the render, of each kind */
	IN_PIXEL = 16,       /* samples of one pixel */
	DROPPED = 3,         /* largest terms */
	STREAM_MAP = 0, STREAM_PATH, STREAM_BDPT, STREAM_PIXEL, /* steps of RNG_CHOICE */
};

/* Of the scenes of tests/bench/README.md: more in the four where chains win by factors (pane and frosted, eight seeds each: 15 of 16
 * pilots of 8,192 samples, 16 of 16 of 16,384), 0.16 or less in all others but veach-door, where it is 0.1 to 0.34. */
static const double rare_share = 0.28;
/* bdpt errs less than the pilot says: it has the shorter tails. */
static const double path_cost = 0.75, path_heavy = 1.5, heavy_least = 0.05;

/* ---- what samples bring */

/* Sums over samples of one kind, relative to the brightness of their places. */
struct tally {
	double samples, rays;
	double square, energy, rare, heavy;
	double most, most_square[DROPPED]; /* the largest terms, falling */
};

/* One sample of a pixel: what it brings there, and to other places. */
struct parts {
	double here;
	uint32_t count;
	double elsewhere[PATH_MAX_SPLATS];
};

static void keep_most(double most[DROPPED], double term)
{
	for (int i = 0; i < DROPPED; i++)
		if (term > most[i]) {
			double smaller = most[i];
			most[i] = term;
			term = smaller;
		}
}

static void add_term(struct tally *t, double y)
{
	t->energy += y;
	t->rare += fmax(y - RENDER_RARE, 0);
	t->heavy += fmax(y - RENDER_HEAVY, 0);
	t->square += y * y;
	t->most = fmax(t->most, y);
	keep_most(t->most_square, y * y);
}

/* A pixel that is brighter than the map knows, a lamp's, is so in all its samples: each is held against what the others found,
 * where that is more. */
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
	struct render_found f = {0, 0, 0};
	double square = t->square;
	for (int i = 0; i < DROPPED; i++)
		square -= t->most_square[i];
	if (!(t->energy > 0))
		return f;
	f.cost = fmax(square, 0) / t->samples * t->rays / t->samples;
	/* One sample alone proves nothing: the edge of a lamp that the pixel's others missed. */
	double energy = t->energy - t->most;
	if (energy > 0) {
		f.rare = fmax(t->rare - fmax(t->most - RENDER_RARE, 0), 0) / energy;
		f.heavy = fmax(t->heavy - fmax(t->most - RENDER_HEAVY, 0), 0) / energy;
	}
	return f;
}

/* ---- the pilot */

struct pilot {
	const struct world *w;
	uint64_t seed, samples;
	struct path_context context;
	struct path_sample sample;
	struct brightness map;
	struct parts parts[IN_PIXEL];
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

static struct render_found look(struct pilot *p, uint64_t stream, void (*trace)(struct path_context *, struct sampler *, struct path_sample *))
{
	struct tally t = {.samples = (double)(p->samples / IN_PIXEL * IN_PIXEL)};
	const struct film_window *w = &p->context.window;
	memset(p->counters, 0, sizeof p->counters);
	for (uint64_t i = 0; i < p->samples / IN_PIXEL; i++) {
		double u[4];
		tick();
		rng_uniform4(p->seed, RNG_CHOICE, i, STREAM_PIXEL, stream, u); /* pixels of its own */
		double column = floor(u[0] * w->width), row = floor(u[1] * w->height);
		struct film_window pixel = {w->x + column, w->y + row, 1, 1};
		for (unsigned k = 0; k < IN_PIXEL; k++) {
			struct pixel_sampler s = {.corner = {column / w->width, row / w->height}, .size = {1 / w->width, 1 / w->height}};
			sampler_random_init(&s.random, p->seed, RNG_CHOICE, i * IN_PIXEL + k, stream);
			s.random.base.block = pixel_block;
			trace(&p->context, &s.random.base, &p->sample);
			take_parts(p, &pixel, &p->parts[k]);
		}
		add_pixel(&t, p->parts);
	}
	t.rays = (double)(p->counters[COUNT_RAYS_CLOSEST] + p->counters[COUNT_RAYS_SHADOW]);
	return found(&t);
}

/* A power of two, so that nearly equal renders have equal pilots. */
static uint64_t pilot_samples(const struct plan_request *r, uint64_t pixels)
{
	uint64_t total = UINT64_MAX, n = SAMPLES_LEAST;
	if (r->spp && r->spp < UINT64_MAX / pixels)
		total = r->spp * pixels;
	if (r->mutations && r->mutations < total)
		total = r->mutations;
	while (n < SAMPLES_MOST && n < total / SAMPLES_SHARE)
		n *= 2;
	return n;
}

/* The film and the random numbers of the render, checked as it will be; then all of the film, so that a crop is rendered by what the
 * whole is rendered by and has its pixels. */
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
	p->context = (struct path_context){.w = p->w, .window = film_window_of(film), .min_depth = film->min_depth,
					   .max_depth = film->max_depth, .roulette = true, .unclassed = true, .counters = p->counters};
	int rc = make_map(p, out->misses, e);
	if (!rc) {
		out->bdpt = look(p, STREAM_BDPT, path_trace_both_ways);
		out->path = look(p, STREAM_PATH, path_trace);
	}
	brightness_fini(&p->map);
	return rc;
}

/* ---- the choice */

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

const char *render_choice_of(const struct render_choice *c)
{
	bool dark = !(c->path.cost > 0) && !(c->bdpt.cost > 0); /* its bootstrap looks for light much longer */
	double rare = c->misses ? c->bdpt.rare : fmin(c->path.rare, c->bdpt.rare);
	if (dark || rare > rare_share)
		return "hslt";
	bool tails = c->path.heavy > fmax(heavy_least, path_heavy * c->bdpt.heavy);
	return !c->misses && c->path.cost > 0 && c->path.cost < path_cost * c->bdpt.cost && !tails ? "path" : "bdpt";
}

int render_choose(const struct world *w, struct plan_request *r, struct render_choice *out, struct error *e)
{
	struct render_summary summary;
	struct plan film;
	*out = (struct render_choice){.path = {0, 0, 0}};
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
	snprintf(text, size, "%s, by a pilot: light beyond %d times the brightness of its place path %.3g %%, bdpt %.3g %%; "
			     "second moment times rays path %.3g, bdpt %.3g",
		 integrator, RENDER_RARE, 100 * c->path.rare, 100 * c->bdpt.rare, c->path.cost, c->bdpt.cost);
}
