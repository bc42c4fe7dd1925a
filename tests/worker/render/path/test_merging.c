/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Merging with a photon placed exactly where the camera's sub-path ends: the contribution found by bdpt and `path` must
 * be f divided by the densities of the full path, multiplied out vertex by vertex. And the light of a room by merging,
 * against `path`.
 */
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/path/full_path_density.h"
#include "worker/render/path/integrate_path.h"
#include "worker/render/path/measure.h"
#include "worker/render/path/media.h"
#include "worker/render/path/merging.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

#define AT(inner) "<transform name='to_world'>" inner "</transform>"
/* clang-format off */
#define ROOM                                                                                                                    \
	SENSOR("0,0.2,1.9", "0,-0.3,-1")                                                                                        \
	"<shape type='cube'>" AT("<scale value='2'/>") "<bsdf type='diffuse'><rgb name='reflectance' value='0.5,0.45,0.35'/>"     \
	"</bsdf></shape>"
#define LAMP                                                                                                                    \
	"<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>")                       \
	"<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>"
#define ROUND_LAMP                                                                                                              \
	"<shape type='sphere'><point name='center' value='0.6,1.2,-0.5'/><float name='radius' value='0.3'/>"                     \
	"<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>"
#define BALL(bsdf)                                                                                                              \
	"<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/><float name='radius' value='0.8'/>" bsdf "</shape>"
#define PANE(y)                                                                                                                 \
	"<shape type='rectangle'>" AT("<scale value='1.9'/><rotate x='1' angle='80'/><translate y='" y "'/>")                    \
	"<bsdf type='thindielectric'/></shape>"
/* Fog fills the room except its corners; beside it lies a ball of denser fog. */
#define FOG(side, sigma_t)                                                                                                      \
	"<medium type='homogeneous' name='" side "'><rgb name='sigma_t' value='" sigma_t "'/>"                                   \
	"<rgb name='albedo' value='0.9,0.8,0.6'/><phase type='hg'><float name='g' value='0.4'/></phase></medium>"
#define FOGGY                                                                                                                   \
	"<shape type='cube'>" AT("<scale x='1.4' y='1.3' z='1'/><translate y='-0.6'/>") "<bsdf type='null'/>"                    \
	FOG("interior", "0.3,0.5,0.8") "</shape>"
/* clang-format on */

enum { EDGES = 8 };

static struct path_context context_of(struct world *w, uint64_t *counters)
{
	return (struct path_context){.w = w,
				     .window = {0, 0, 32, 32},
				     .min_depth = 1,
				     .max_depth = EDGES,
				     .counters = counters,
				     .refract = halfvec_refract};
}

static double contribution_over_densities(const double *log_pdf, unsigned last, double log_f)
{
	double sum = 0;
	for (unsigned s = 0; s <= last; s++)
		sum += exp(log_pdf[s] - log_f);
	return 1 / sum;
}

/* Continues the camera's sub-path of t vertices to vertex s of the light sub-path as if this vertex had been sampled.
 * Returns false if that is impossible. */
static bool extend_camera_subpath_to_light(struct path_context *c, unsigned s, unsigned t)
{
	const struct path_vertex *y = &c->light[s];
	struct path_vertex *at = &c->camera[t - 1], *z = &c->camera[t];
	double distance2, pdf = path_pdf(c, at - 1, at, y, TRANSPORT_RADIANCE);
	vec3 w = path_direction(at, y, &distance2);
	*z = *y;
	z->to_prev = vec3_neg(w);
	z->pdf = pdf;
	z->beta = spectrum_mul(at->beta, path_scatter(c, at, at->to_prev, w));
	z->beta = spectrum_scale(path_geometry_term(at, y, w, distance2) / pdf, z->beta);
	at->is_delta = false;
	if (t >= 2)
		at[-1].pdf_rev = path_pdf(c, y, at, at - 1, TRANSPORT_IMPORTANCE);
	if (pdf > 0 && EFFECT_IS_ON(c->w, scattering)) {
		spectrum transmittance;
		if (!path_is_visible_in_media(c, at, z, &z->edge, &transmittance))
			return false;
		path_apply_edge(c, z, transmittance);
		if (t >= 2)
			at[-1].pdf_rev *= path_edge_pdf(c, &at->edge, at->edge.previous_medium, &at[-1]);
	}
	return pdf > 0;
}

static void note_relative_error(double got, double expected, double *worst)
{
	if (isinf(expected) && isinf(got))
		return;
	double relative_error = fabs(got - expected) / expected;
	if (!(relative_error < 1e-7))
		fail_msg("%.17g instead of %.17g", got, expected);
	*worst = fmax(*worst, relative_error);
}

static unsigned long check_densities(const char *name, struct world *w, unsigned long samples)
{
	static struct path_context c;
	static struct full_path x;
	uint64_t counters[BATCH_COUNTERS] = {0};
	unsigned long compared = 0;
	double log_pdf[FULL_PATH_VERTICES_MAX], film[2], worst = 0;
	c = context_of(w, counters);
	for (unsigned long i = 0; i < samples; i++) {
		struct sampler_random u;
		sampler_random_init(&u, 0x6d65726765, RNG_TEST, i, 0);
		unsigned camera = path_walk_camera(&c, &u.base, EDGES + 1, film),
			 light = path_walk_light(&c, &u.base, EDGES);
		/* From the longest sub-path down: each meeting changes the vertices after it. */
		for (unsigned t = camera; t >= 2; t--)
			for (unsigned s = 2; s < light && s + t <= EDGES; s++) {
				struct merged_path found;
				/* s + 1 vertices of the light sub-path and t of the camera's are joined */
				if (!full_path_from_subpaths(&c, s + 1, 0, s + t, &x) ||
				    !extend_camera_subpath_to_light(&c, s, t))
					continue;
				struct photon p = photon_from_vertex(&c, s);
				if (!merging_merge_photon(&c, &p, t, &found))
					continue;
				double log_f = full_path_log_f(&c, &x);
				full_path_log_technique_pdfs(&c, &x, log_pdf);
				note_relative_error(found.bdpt_contribution,
						    contribution_over_densities(log_pdf, x.edges, log_f), &worst);
				note_relative_error(found.path_contribution,
						    contribution_over_densities(log_pdf, 1, log_f), &worst);
				compared++;
			}
	}
	printf("%s: %lu paths, largest difference %.3g\n", name, compared, worst);
	world_free(w);
	return compared;
}

static void merging_equals_f_over_the_sum_of_densities(void **state)
{
	(void)state;
	assert_true(check_densities("diffuse", world_from_text(32, 32, ROOM LAMP "%s", ""), 1000) > 1000);
	assert_true(check_densities("glass",
				    world_from_text(32, 32, ROOM ROUND_LAMP BALL("<bsdf type='dielectric'/>") "%s", ""),
				    3000) > 3000);
	/* `path` finds all of the light from the point behind the ball by refracted connections. */
	assert_true(
		check_densities("glass and a point",
				world_from_text(32, 32,
						ROOM "<emitter type='point'><point name='position' value='0.5,1,0'/>"
						     "<rgb name='intensity' value='1,1,1'/></emitter>" BALL(
							     "<bsdf type='dielectric'/>") "%s",
						""),
				3000) > 3000);
	assert_true(
		check_densities("rough glass and a point",
				world_from_text(32, 32,
						ROOM "<emitter type='point'><point name='position' value='0.5,1,0'/>"
						     "<rgb name='intensity' value='1,1,1'/></emitter>" BALL(
							     "<bsdf type='roughdielectric'><float name='alpha' "
							     "value='0.2'/></bsdf>") "%s",
						""),
				1000) > 1000);
	/* Techniques that pass through the panes count as well, and some of them end at the photon. */
	/* Scattering events are vertices; `null` faces are not. */
	assert_true(check_densities("fog and a lamp in it",
				    world_from_text(32, 32,
						    ROOM LAMP FOGGY "<emitter type='point'><point name='position' "
								    "value='0.9,-0.4,0.3'/><rgb name='intensity' "
								    "value='1,1,1'/></emitter>%s",
						    ""),
				    2000) > 1000);
	assert_true(check_densities(
			    "behind panes",
			    world_from_text(
				    32, 32,
				    ROOM ROUND_LAMP BALL("<bsdf type='conductor'/>") PANE("0.4")
					    PANE("0.1") "<emitter type='point'><point name='position' value='0.5,1,0'/>"
							"<rgb name='intensity' value='1,1,1'/></emitter>%s",
				    ""),
			    3000) > 2000);
	assert_true(
		check_densities(
			"under the sky",
			world_from_text(
				32, 32,
				SENSOR("0,0.5,2.5", "0,-0.3,-1") BALL("<bsdf type='dielectric'/>") "<shape type='cube'>" AT(
					"<translate z='-2'/>") "</shape>"
							       "<shape type='rectangle'>" AT(
								       "<scale value='2'/><rotate x='1' angle='-90'/><translate "
								       "y='-1.5'/>") "</shape><emitter type='constant'/>%s",
				""),
			40000) > 100);
}

static void add_merged_contribution(void *user, const struct merged_path *m)
{
	*(double *)user += m->contribution;
}

/* Light that arrives after at least two scattering events. Merging misses photons in the part of the disk beyond the
 * edge of a wall, here 1 %. The limit of 4.5 standard errors beyond 3 % rejects a correct program once in 10^5; an
 * error of 10 % is found nine times in ten. */
static void merging_finds_the_light_of_bdpt(void **state)
{
	(void)state;
	enum { PATHS = 1 << 14, GROUPS = 32 };
	static struct path_context c;
	static struct path_sample sample;
	struct world *w = world_from_text(32, 32, ROOM LAMP "%s", "");
	uint64_t counters[BATCH_COUNTERS] = {0};
	c = context_of(w, counters);
	c.max_depth = 5;
	double by[2][GROUPS];
	for (unsigned g = 0; g < GROUPS; g++) {
		struct merging m;
		by[0][g] = by[1][g] = 0;
		assert_int_equal(merging_trace_photons(&m, &c, g, 0, PATHS), 0);
		assert_int_equal(m.path_count, PATHS);
		for (uint64_t i = 0; i < PATHS; i++) {
			struct merging_point place;
			if (merging_walk_camera(&m, &c, g, 1, i, &place))
				merging_visit_paths(&m, &c, &place, add_merged_contribution, &by[0][g]);
		}
		merging_fini(&m);
		c.min_depth = 3;
		for (uint64_t i = 0; i < PATHS / 4; i++) {
			struct sampler_random u;
			sampler_random_init(&u, g, RNG_TEST, i, 0);
			path_trace(&c, &u.base, &sample);
			by[1][g] += 4 * sample.intensity;
		}
		c.min_depth = 1;
	}
	double mean[2], square[2] = {0, 0};
	for (int k = 0; k < 2; k++) {
		mean[k] = 0;
		for (unsigned g = 0; g < GROUPS; g++)
			mean[k] += by[k][g] / GROUPS;
		for (unsigned g = 0; g < GROUPS; g++)
			square[k] += (by[k][g] / mean[k] - 1) * (by[k][g] / mean[k] - 1) / (GROUPS * (GROUPS - 1));
	}
	double ratio = mean[0] / mean[1], error = sqrt(square[0] + square[1]);
	printf("by merging %.4f +- %.4f of path's\n", ratio, error);
	assert_true(error < 0.013);
	assert_true(fabs(ratio - 1) < 0.03 + 4.5 * error);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(merging_equals_f_over_the_sum_of_densities),
					   cmocka_unit_test(merging_finds_the_light_of_bdpt)};
	return cmocka_run_group_tests_name("worker/render/path/merging", tests, NULL, NULL);
}
