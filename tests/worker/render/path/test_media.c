/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Edges through media that scatter (worker/render/path/media.h), on a ray through three layers with faces of `null`:
 * one that scatters, one that only absorbs, and one of other coefficients, in which a glass pane states no medium.
 * Events drawn for evenly spaced numbers are counted between any two places as often as the integral of their density
 * says; an edge has the same depths from both ends; faces that do not fit are noticed; and emitters know what surrounds
 * them.
 */
#include "worker/render/path/media.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

/* From z = a to b. */
#define LAYER(middle, half, medium)                                                                            \
	"<shape type='cube'><transform name='to_world'><scale x='9' y='9' z='" half "'/><translate z='" middle \
	"'/></transform><bsdf type='null'/>" medium "</shape>"
#define FOG(side, sigma_t, albedo)                                                       \
	"<medium type='homogeneous' name='" side "'><rgb name='sigma_t' value='" sigma_t \
	"'/><rgb name='albedo' value='" albedo "'/></medium>"

/* Layers at z in (-1, 1), (-3, -2) and (-7, -3). The third begins where the second ends: between them the exterior of
 * the one and the interior of the other would have to be told; so there is a gap of 0.25. */
static struct world *layers(void)
{
	return world_of_text(
		8, 8,
		"%s<emitter type='constant'/>" LAYER("0", "1", FOG("interior", "0.2,0.5,1.5", "0.9,0.8,0.7"))
			LAYER("-2.5", "0.5", FOG("interior", "0.3,0.1,0.2", "0,0,0"))
				LAYER("-5.25", "2", FOG("interior", "0.9,0.4,0.1", "0.5,0.6,0.7")),
		SENSOR("0,0,5", "0,0,0"));
}

static struct path_vertex start_at(const struct world *w, double z)
{
	struct path_vertex v = {.kind = VERTEX_MEDIUM};
	v.x.p = vec3_scale(w->scale, vec3_sub((vec3){0.1, 0.2, z}, w->center));
	v.x.prim = PRIM_NONE;
	return v;
}

static struct path_context context_of(const struct world *w, uint64_t *counters)
{
	return (struct path_context){.w = w, .wl = wavelengths_sample(0.37), .counters = counters};
}

static const vec3 down = {0, 0, -1};

static void test_events(void **state)
{
	(void)state;
	enum { NUMBERS = 1 << 16, PLACES = 40 };
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct world *w = layers();
	struct path_context c = context_of(w, counters);
	struct path_vertex at = start_at(w, 3), to;
	double length = 11 * w->scale; /* of the ray that is looked at */
	unsigned events[PLACES] = {0}, free_ones = 0;
	spectrum left, carried = spectrum_of(0);
	double pdf_free = 0;
	for (int i = 0; i < NUMBERS; i++) {
		assert_true(path_extend_in_media(&c, &at, down, 0, INFINITY, (i + 0.5) / NUMBERS, &to, &left));
		if (to.kind == VERTEX_INFINITE) {
			free_ones++;
			pdf_free = path_edge_pdf(&c, &to.edge, to.edge.medium, &to);
			carried = left;
			continue;
		}
		assert_int_equal(to.kind, VERTEX_MEDIUM);
		events[(int)((at.x.p.z - to.x.p.z) / length * PLACES)]++;
	}
	assert_true(fabs(free_ones / (double)NUMBERS - pdf_free) < 8.0 / NUMBERS);
	const struct medium *first = &w->media[0], *second = &w->media[1], *third = &w->media[2];
	spectrum a = medium_transmittance(first, 2 * w->scale, &c.wl),
		 b = medium_transmittance(second, w->scale, &c.wl),
		 d = medium_transmittance(third, 4 * w->scale, &c.wl);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		assert_true(fabs(carried.v[i] / (a.v[i] * b.v[i] * d.v[i]) - 1) < 1e-9);
	assert_true(fabs(pdf_free / spectrum_mean(spectrum_mul(a, d)) - 1) < 1e-9);
	for (int k = 0; k < PLACES; k++) {
		enum { STEPS = 64 };
		double sum = 0;
		for (int i = 0; i < STEPS; i++) {
			struct path_edge edge;
			double z = 3 - 11 * (k + (i + 0.5) / STEPS) / PLACES;
			struct path_vertex there = start_at(w, z);
			assert_true(path_see_in_media(&c, &at, &there, &edge, &left));
			if (edge.medium && path_medium(w, edge.medium)->scatters)
				sum += path_edge_pdf(&c, &edge, edge.medium, &there) * length / PLACES / STEPS;
		}
		/* a face falls between steps; four wavelengths have an event or not at either end */
		assert_true(fabs(events[k] / (double)NUMBERS - sum) < 1.5e-3);
	}
	world_free(w);
}

/* Points in the first and in the third layer see each other alike; only the ends differ. */
static void test_both_ends(void **state)
{
	(void)state;
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct world *w = layers();
	struct path_context c = context_of(w, counters);
	struct path_vertex a = start_at(w, 0.5), b = start_at(w, -5);
	struct path_edge there, back;
	spectrum left, left_back;
	a.edge.medium = 1;
	b.edge.medium = 3;
	assert_true(path_see_in_media(&c, &a, &b, &there, &left));
	assert_true(path_see_in_media(&c, &b, &a, &back, &left_back));
	assert_int_equal(there.before, 1);
	assert_int_equal(there.medium, 3);
	assert_int_equal(back.before, 3);
	assert_int_equal(back.medium, 1);
	assert_true(there.fits && back.fits);
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		assert_true(fabs(there.free.v[i] / back.free.v[i] - 1) < 1e-12);
		assert_true(fabs(left.v[i] / left_back.v[i] - 1) < 1e-12);
		assert_true(left.v[i] < 0.95 * there.free.v[i]); /* the layer between them absorbs */
	}
	a.edge.medium = 2; /* not what the layer says of its inside */
	assert_true(path_see_in_media(&c, &a, &b, &there, &left));
	assert_false(there.fits);
	world_free(w);
}

/* A lamp in fog without a medium of its own, one that states what is around it, a point light outside and one inside.
 */
static void test_emitters(void **state)
{
	(void)state;
	struct world *w = world_of_text(
		8, 8,
		"%s" LAYER(
			"0", "2",
			FOG("interior", "1,1,1",
			    "0.5,0.5,0.5")) "<shape type='sphere'><float name='radius' value='0.2'/><emitter type='area'/></shape>"
					    "<shape type='sphere'><point name='center' x='1' y='0' z='0'/><float name='radius' value='0.2'/>"
					    "<emitter type='area'/>" FOG(
						    "exterior", "2,2,2",
						    "0.5,0.5,0.5") "</shape>"
								   "<emitter type='point'><point name='position' x='0' y='1' z='3'/></emitter>"
								   "<emitter type='point'><point name='position' x='0' y='1' z='1'/></emitter>"
								   "<emitter type='constant'/>",
		SENSOR("0,0,5", "0,0,0"));
	assert_int_equal(w->emitter_count, 5);
	static const uint32_t around[] = {1, 2, 0, 1, 0};
	for (int32_t i = 0; i < 5; i++) {
		struct emitter_point p;
		double pdf;
		const double u[] = {0.3, 0.6};
		assert_true(w->emitters[i].ops->sample_point(&w->emitters[i], u, &p, &pdf));
		struct path_vertex v = path_emitter_vertex(w, i, &p);
		assert_int_equal(path_medium_of_emitter(w, &v, p.n), around[i]);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_events),
		cmocka_unit_test(test_both_ends),
		cmocka_unit_test(test_emitters),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
