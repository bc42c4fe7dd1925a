/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A path made by merging contributes b, relative to the brightness of its place. If a sample of the integrator that
 * finds the path contributes c, then b / c is the expected number of times that a sample finds it: the brighter c,
 * the rarer. Paths are sorted into classes of c, each four times as bright as the one before. N samples find the
 * classes from the k-th on
 *
 *     N sum_{i >= k} sum b / c
 *
 * times. Light is unseen if its class is among the brightest ones that are together found at most `max_finds` times.
 * Light that has been found more often was found by different groups of samples, and the spread between them shows it.
 *
 * The unseen light, squared and averaged over the film, is its contribution to relMSE. The square of a sum
 * over few photons would be too large by the variance of the sum, so the sums of two independent sets of
 * photons are multiplied, in each of CELLS_ACROSS x CELLS_ACROSS cells. If light is missing from only a part of a cell,
 * the mean over the cell is too small.
 *
 * Failures: -ENOMEM. A scene without light has no unseen light.
 */
#include "worker/render/unseen_light.h"

#include "common/base/mem.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrator.h"
#include "worker/render/path/merging.h"
#include "worker/render/pilot_plan.h"

#include <string.h>

/* The number does not depend on the length of the render, so that a job that is extended has the
 * same value as a longer one. */
enum { SAMPLES = 1 << 13 };

enum { SETS = 2, CELLS_ACROSS = 8, CELLS = CELLS_ACROSS * CELLS_ACROSS, CLASSES = 24 };
static const double max_finds = 3;

/* The results of one set of photons. */
struct merged_light {
	double light[CELLS][CLASSES]; /* relative light, summed over the camera's samples */
	double finds[CLASSES];	      /* expected number of finds by one sample of the integrator */
	double samples[CELLS];	      /* samples of the camera */
};

struct merge_target {
	struct merged_light *light;
	double light_fraction, scale;
	unsigned cell;
};

static void add_to_class(void *user, const struct merged_path *m)
{
	struct merge_target *p = user;
	double finds = (1 - p->light_fraction) * m->contribution / m->path_contribution +
		       p->light_fraction * m->contribution / m->bdpt_contribution,
	       light = p->scale * m->contribution, contribution = finds > 0 ? light / finds : INFINITY;
	int k = contribution < 1			   ? 0
		: contribution < ldexp(1, 2 * CLASSES - 2) ? (int)(log2(contribution) / 2)
							   : CLASSES - 1;
	p->light->light[p->cell][k] += light;
	p->light->finds[k] += finds;
}

static unsigned cell_of(const struct film_window *w, const double film[2])
{
	double x = (film[0] - w->x) / w->width * CELLS_ACROSS, y = (film[1] - w->y) / w->height * CELLS_ACROSS;
	return (unsigned)fmin(fmax(y, 0), CELLS_ACROSS - 1) * CELLS_ACROSS +
	       (unsigned)fmin(fmax(x, 0), CELLS_ACROSS - 1);
}

static int merge_one_set(struct path_context *c, const struct brightness *map, double light_fraction, uint64_t seed,
			 uint64_t step, uint64_t samples, struct merged_light *out)
{
	struct merging m;
	int rc = merging_trace_photons(&m, c, seed, step, samples);
	for (uint64_t i = 0; i < m.path_count && !rc; i++) {
		struct merging_point point;
		double photons;
		bool is_rough = merging_walk_camera(&m, c, seed, step + 1, i, &point);
		struct merge_target p = {
			.light = out, .light_fraction = light_fraction, .cell = cell_of(&c->window, point.film)};
		out->samples[p.cell]++;
		if (!is_rough || !m.photon_count)
			continue;
		p.scale = merging_inverse_brightness(&m, c, &point, map, &photons);
		if (p.scale > 0)
			merging_visit_paths(&m, c, &point, add_to_class, &p);
	}
	for (int k = 0; k < CLASSES && !rc; k++)
		out->finds[k] /= (double)m.path_count;
	merging_fini(&m);
	return rc;
}

/* Returns the index of the dimmest of the brightest classes that so many samples find at most a few times in all. */
static int first_unseen_class(const struct merged_light *s, double samples)
{
	double finds = 0;
	int k = CLASSES;
	while (k > 0) {
		finds += samples * (s[0].finds[k - 1] + s[1].finds[k - 1]) / SETS;
		if (finds > max_finds)
			break;
		k--;
	}
	return k;
}

static double mean_square(const struct merged_light *s, int first_class)
{
	double sum = 0, samples = 0;
	for (int i = 0; i < CELLS; i++) {
		double light[SETS] = {0}, n = s[0].samples[i] + s[1].samples[i];
		samples += n;
		for (int k = first_class; k < CLASSES; k++)
			for (int j = 0; j < SETS; j++)
				light[j] += s[j].light[i][k];
		if (s[0].samples[i] > 0 && s[1].samples[i] > 0)
			sum += n * (light[0] / s[0].samples[i]) * (light[1] / s[1].samples[i]);
	}
	return samples > 0 ? sum / samples : 0;
}

int unseen_light_estimate(struct path_context *c, const struct brightness *map, double light_fraction, uint64_t seed,
			  uint64_t step, uint64_t samples, struct plan_unseen *out)
{
	double pixels = c->window.width * c->window.height;
	struct merged_light *s = mem_alloc(SETS, sizeof *s);
	int rc = s ? 0 : -ENOMEM;
	for (unsigned j = 0; j < SETS && !rc; j++)
		rc = merge_one_set(c, map, light_fraction, seed, step + 2 * j, samples, &s[j]);
	for (int i = 0; i < PLAN_UNSEEN_COUNT && !rc; i++)
		out->mean_squares[i] = mean_square(s, first_unseen_class(s, pixels * ldexp(1, 2 * i)));
	mem_free(s);
	return rc;
}

/* ---- of a render */

struct pilot {
	struct path_context context;
	struct brightness map;
	uint64_t counters[BATCH_COUNTERS];
};

static int run_pilot(struct pilot *p, const struct world *w, const struct plan *film,
		     const struct integrator *integrator, struct plan_request *r, struct error *e)
{
	path_context_init_for_samples(&p->context, w, film, p->counters);
	p->context.refract = halfvec_refract;
	int rc = brightness_init_from_samples(&p->map, &p->context, path_trace_candidates, r->seed, RNG_CHOICE,
					      PILOT_UNSEEN_MAP, SAMPLES, e);
	double light_fraction = integrator->properties.is_camera_only	 ? 0
				: integrator->light_subpath_interval > 1 ? 1.0 / integrator->light_subpath_interval
									 : 1;
	if (!rc &&
	    unseen_light_estimate(&p->context, &p->map, light_fraction, r->seed, PILOT_UNSEEN, SAMPLES, &r->unseen))
		rc = error_set(e, ENOMEM, "no memory for a pilot");
	brightness_fini(&p->map);
	return rc;
}

int render_unseen_light(const struct world *w, struct plan_request *r, struct error *e)
{
	const struct integrator *integrator = integrator_find(r->integrator);
	struct render_summary summary;
	struct plan film;
	r->unseen = (struct plan_unseen){0};
	world_summary(w, &summary);
	if (!integrator || !pilot_scene_has(&summary, "half-vectors"))
		return 0;
	int rc = pilot_make_plan(r, &film, e);
	struct pilot *p = rc ? NULL : mem_alloc(1, sizeof *p);
	if (!rc)
		rc = p ? run_pilot(p, w, &film, integrator, r, e) : error_set(e, ENOMEM, "no memory for a pilot");
	mem_free(p);
	return rc;
}
