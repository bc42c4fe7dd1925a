/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes the map of brightness that all leases of a job share, in two steps. The first map is made from samples of bdpt,
 * which finds all light that the render finds. If most of that light is in few bright samples, such a map is as noisy
 * as an image of bdpt, however many samples it has. So the second map, which is the one in use, is made from the
 * render's own samples and chains, guided by the first map.
 *
 * Failures: -ENOMEM; -EDOM after an invalid floating-point operation. Nothing stays allocated then.
 */
#include "worker/render/brightness_map.h"

#include "worker/render/chain/redistribution.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/path/brightness.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrator.h"

#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/math/fptrap.h"

enum {
	FIRST_SAMPLES_MIN = 1 << 10,
	SECOND_SAMPLES_MIN = 1 << 12,
	SECOND_SAMPLES_MAX = 1 << 17,
	FIRST_DIVISOR = 4, /* the first map has a quarter of the samples */
	/* A bootstrap has 1/64 of the render's samples, but no more than BOOTSTRAP_MIN (plan.c), which
	 * LONG_BOOTSTRAP_SAMPLES repeats. So a map has 1/32 of the samples of a short render; of a longer one at most
	 * 1/16, or one sample per pixel. */
	LONG_BOOTSTRAP_SAMPLES = 1 << 14,
	SHORT_BOOTSTRAP_FACTOR = 2,
	LONG_BOOTSTRAP_FACTOR = 4,
	SAMPLES_PER_CELL = 1, /* samples per cell; a cell takes the mean of its neighbourhood */
	STEP_FIRST = 0,
	STEP_SECOND, /* steps of RNG_BRIGHTNESS */
};

/* Returns the number of samples of the second map, rounded to a power of two. */
static uint64_t choose_second_samples(const struct film_window *w, const struct plan *p)
{
	uint64_t n = SECOND_SAMPLES_MIN;
	const double pixels = w->width * w->height, bootstrap = (double)p->bootstrap;
	double wanted = bootstrap < LONG_BOOTSTRAP_SAMPLES ? bootstrap * SHORT_BOOTSTRAP_FACTOR
							   : fmax(pixels, bootstrap * LONG_BOOTSTRAP_FACTOR);
	while (n < SECOND_SAMPLES_MAX && (double)n * M_SQRT2 < wanted)
		n *= 2;
	return n;
}

#define NO_PIXEL UINT64_MAX /* distinguishes the map's chains from the render's */

/* The state from which both maps are made. */
struct map_maker {
	struct path_context context;
	struct path_sample sample;
	uint64_t counters[BATCH_COUNTERS];
	double class_intensity[PATH_CLASSES];
	struct brightness first_map;
	struct redistribution *redistribution;
};

static void sample_second(struct map_maker *m, struct brightness *map, uint64_t seed, uint64_t samples)
{
	struct path_context *c = &m->context;
	for (uint64_t i = 0; i < samples; i++) {
		struct sampler_random s;
		liveness_tick();
		sampler_random_init(&s, seed, RNG_BRIGHTNESS, i, STEP_SECOND);
		c->split = redistribution_begin(m->redistribution, NO_PIXEL, i);
		path_trace_bidirectional(c, &s.base, &m->sample);
		brightness_add_sample(map, &m->sample);
	}
	brightness_compute_nearby_scales(map, samples);
}

static int make_second(struct map_maker *m, struct brightness *map, uint64_t seed, uint64_t n, struct error *e)
{
	struct path_context *c = &m->context;
	int rc = brightness_init(map, &c->window, n, SAMPLES_PER_CELL, e);
	if (rc)
		return rc;
	rc = redistribution_new(&m->redistribution, &redistribution_default_rule, c, &m->first_map, seed, &map->target,
				m->class_intensity, e);
	if (!rc)
		sample_second(m, map, seed, n);
	return rc;
}

static int make_maps(struct map_maker *m, struct brightness *map, const struct plan *p, uint32_t light_subpath_interval,
		     struct error *e)
{
	jmp_buf jump;
	if (setjmp(jump))
		return error_set(e, EDOM,
				 "an invalid floating-point operation (SIGFPE) in the map of brightness for '%s'",
				 p->integrator);
	jmp_buf *previous_jump = fptrap_catch(&jump);
	const uint64_t n = choose_second_samples(&m->context.window, p), first = n / FIRST_DIVISOR;
	int rc = brightness_init_from_samples(&m->first_map, &m->context, path_trace_bidirectional, p->seed,
					      RNG_BRIGHTNESS, STEP_FIRST,
					      first < FIRST_SAMPLES_MIN ? FIRST_SAMPLES_MIN : first, e);
	m->context.light_subpath_interval = light_subpath_interval;
	if (!rc)
		rc = make_second(m, map, p->seed, n, e);
	fptrap_catch(previous_jump);
	return rc;
}

int render_brightness_map_new(const struct world *w, const struct plan *p, struct brightness **out, struct error *e)
{
	const struct integrator *i = integrator_find(p->integrator);
	*out = NULL;
	if (!i)
		return error_set(e, EINVAL, "no integrator is called '%s'", p->integrator);
	if (!i->redistributes)
		return 0;
	struct brightness *map = mem_alloc(1, sizeof *map);
	struct map_maker *m = mem_alloc(1, sizeof *m);
	int rc = map && m ? 0 : error_set(e, ENOMEM, "no memory for a map of brightness");
	if (!rc) {
		path_context_init_for_samples(&m->context, w, p, m->counters);
		m->context.refract = halfvec_refract;
		rc = make_maps(m, map, p, i->light_subpath_interval, e);
		brightness_fini(&m->first_map);
		redistribution_free(m->redistribution);
	}
	mem_free(m);
	if (rc)
		render_brightness_map_free(map);
	else
		*out = map;
	return rc;
}

void render_brightness_map_free(struct brightness *map)
{
	if (map)
		brightness_fini(map);
	mem_free(map);
}
