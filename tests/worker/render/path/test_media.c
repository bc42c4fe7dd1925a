/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Edges through scattering media (worker/render/path/media.h), on a ray through three layers with `null` faces: one
 * that scatters, one that only absorbs, and one with other coefficients that contains a glass pane without a medium
 * of its own. Events drawn from evenly spaced numbers must occur between any two positions as often as the integral
 * of their density says; a grid must equal layers of its values; an edge must have the same optical depths from both
 * ends; mismatched faces must be noticed; and emitters must know the medium around them.
 */
#include "worker/render/path/media.h"
#include "tests/support/memory_assets.h"
#include "tests/support/vol.h"
#include "tests/support/worlds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* A layer from z = middle - half to middle + half. */
#define LAYER(middle, half, medium)                                                                            \
	"<shape type='cube'><transform name='to_world'><scale x='9' y='9' z='" half "'/><translate z='" middle \
	"'/></transform><bsdf type='null'/>" medium "</shape>"
#define FOG(side, sigma_t, albedo)                                                       \
	"<medium type='homogeneous' name='" side "'><rgb name='sigma_t' value='" sigma_t \
	"'/><rgb name='albedo' value='" albedo "'/></medium>"

/* Layers at z in (-1, 1), (-3, -2) and (-7.25, -3.25). A third layer that began where the second ends would need a
 * stated exterior in one and a stated interior in the other; so a gap of 0.25 separates them. */
static struct world *make_layers(void)
{
	return world_from_text(
		8, 8,
		"%s<emitter type='constant'/>" LAYER("0", "1", FOG("interior", "0.2,0.5,1.5", "0.9,0.8,0.7"))
			LAYER("-2.5", "0.5", FOG("interior", "0.3,0.1,0.2", "0,0,0"))
				LAYER("-5.25", "2", FOG("interior", "0.9,0.4,0.1", "0.5,0.6,0.7")),
		SENSOR("0,0,5", "0,0,0"));
}

static struct path_vertex vertex_at_depth(const struct world *w, double z)
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

static const vec3 down_direction = {0, 0, -1};

/* Returns the transmittance of a homogeneous medium over `distance`. */
static spectrum homogeneous_transmittance(const struct medium *m, double distance, const struct wavelengths *w)
{
	spectrum t = medium_extinction(m, (vec3){0, 0, 0}, down_direction, w);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		t.v[i] = exp(-t.v[i] * distance);
	return t;
}

static void scattering_events_follow_their_density(void **state)
{
	(void)state;
	enum { NUMBERS = 1 << 16, PLACES = 40 };
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct world *w = make_layers();
	struct path_context c = context_of(w, counters);
	struct path_vertex at = vertex_at_depth(w, 3), to;
	double length = 11 * w->scale; /* length of the test ray */
	unsigned events[PLACES] = {0}, free_ones = 0;
	spectrum transmittance, carried = spectrum_constant(0);
	double pdf_free = 0;
	for (int i = 0; i < NUMBERS; i++) {
		assert_true(path_extend_in_media(&c, &at, down_direction, 0, INFINITY, (i + 0.5) / NUMBERS, NULL, &to,
						 &transmittance));
		if (to.kind == VERTEX_INFINITE) {
			free_ones++;
			pdf_free = path_edge_pdf(&c, &to.edge, to.edge.medium, &to);
			carried = transmittance;
			continue;
		}
		assert_int_equal(to.kind, VERTEX_MEDIUM);
		events[(int)((at.x.p.z - to.x.p.z) / length * PLACES)]++;
	}
	assert_true(fabs(free_ones / (double)NUMBERS - pdf_free) < 8.0 / NUMBERS);
	const struct medium *first = &w->media[0], *second = &w->media[1], *third = &w->media[2];
	spectrum a = homogeneous_transmittance(first, 2 * w->scale, &c.wl),
		 b = homogeneous_transmittance(second, w->scale, &c.wl),
		 d = homogeneous_transmittance(third, 4 * w->scale, &c.wl);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		assert_true(fabs(carried.v[i] / (a.v[i] * b.v[i] * d.v[i]) - 1) < 1e-9);
	assert_true(fabs(pdf_free / spectrum_mean(spectrum_mul(a, d)) - 1) < 1e-9);
	for (int k = 0; k < PLACES; k++) {
		enum { STEPS = 64 };
		double sum = 0;
		for (int i = 0; i < STEPS; i++) {
			struct path_edge edge;
			double z = 3 - 11 * (k + (i + 0.5) / STEPS) / PLACES;
			struct path_vertex there = vertex_at_depth(w, z);
			assert_true(path_is_visible_in_media(&c, &at, &there, &edge, &transmittance));
			if (edge.medium && path_medium(w, edge.medium)->is_scattering)
				sum += path_edge_pdf(&c, &edge, edge.medium, &there) * length / PLACES / STEPS;
		}
		/* a face may fall between two steps; the four wavelengths differ in whether an event occurs at either
		 * end */
		assert_true(fabs(events[k] / (double)NUMBERS - sum) < 1.5e-3);
	}
	world_free(w);
}

/* A grid of four values stacked along z, and four layers that almost touch each other. */
#define VALUES 4
static const double grid_densities[VALUES] = {0.4, 2, 0, 0.9};

static struct world *make_layered_world(bool scatters)
{
	static char xml[4096], *at;
	at = xml + sprintf(xml, "<emitter type='constant'/>%s", SENSOR("0,0,5", "0,0,0"));
	for (int i = 0; i < VALUES; i++)
		at += sprintf(
			at,
			"<shape type='cube'><transform name='to_world'><scale x='9' y='9' z='0.4999999'/><translate "
			"z='%g'/></transform><bsdf type='null'/><medium type='homogeneous' name='interior'>"
			"<rgb name='sigma_t' value='%g,%g,%g'/><float name='albedo' value='%g'/></medium></shape>",
			i - 3.5, 2 * grid_densities[i], grid_densities[i], grid_densities[i] / 2, scatters ? 0.5 : 0);
	return world_from_text(8, 8, "%s", xml);
}

static struct world *make_grid_world(bool scatters)
{
	static char xml[4096];
	static struct vol grid;
	grid.side[0] = grid.side[1] = 1;
	grid.side[2] = VALUES;
	grid.channels = 3;
	for (int i = 0; i < VALUES; i++)
		for (int k = 0; k < 3; k++)
			grid.value[3 * i + k] = (float)(grid_densities[i] * (k == 0 ? 2 : k == 1 ? 1 : 0.5));
	vol_write(&grid);
	int n = snprintf(
		xml, sizeof xml,
		"<scene version='3.0.0'><emitter type='constant'/>%s<shape type='cube'><transform name='to_world'>"
		"<scale x='9' y='9' z='2'/><translate z='-2'/></transform><bsdf type='null'/><medium "
		"type='heterogeneous' name='interior'><volume type='gridvolume' name='sigma_t'>"
		"<string name='filename' value='g'/><string name='filter_type' value='nearest'/><transform "
		"name='to_world'><translate x='-.5' y='-.5' z='-1'/><scale x='18' y='18' z='4'/></transform></volume>"
		"<float name='albedo' value='%g'/></medium></shape></scene>",
		SENSOR("0,0,5", "0,0,0"), scatters ? 0.5 : 0);
	const struct memory_file files[] = {{"s", xml, (size_t)n}, {"g", grid.bytes, grid.size}, {NULL, NULL, 0}};
	return world_from_files(8, 8, files);
}

/* Where a grid steps from one value to the next, the events and the remaining light are those of homogeneous layers.
 * Three channels are compared where colours are RGB. */
static void stepped_grid_equals_homogeneous_layers(void **state)
{
	(void)state;
	enum { NUMBERS = 400 };
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct world *w[2] = {make_layered_world(true), make_grid_world(true)};
	const vec3 along = vec3_normalize((vec3){0.3, -0.2, -1});
	unsigned in_media = 0;
	assert_true(w[0]->scale == w[1]->scale);
	for (int n = 0; n < NUMBERS; n++) {
		struct path_vertex to[2];
		spectrum transmittance[2];
		double pdf[2];
		for (int i = 0; i < 2; i++) {
			struct path_context c = context_of(w[i], counters);
			c.wl = (struct wavelengths){.is_rgb = true};
			struct path_vertex at = vertex_at_depth(w[i], 0.5);
			assert_true(path_extend_in_media(&c, &at, along, 0, INFINITY, (n + 0.5) / NUMBERS, NULL, &to[i],
							 &transmittance[i]));
			pdf[i] = path_edge_pdf(&c, &to[i].edge, to[i].edge.medium, &to[i]);
		}
		assert_int_equal(to[0].kind, to[1].kind);
		in_media += to[0].kind == VERTEX_MEDIUM;
		if (to[0].kind == VERTEX_MEDIUM) /* the medium in the middle may differ between the scenes */
			assert_true(fabs(to[0].x.p.z / w[0]->scale + w[0]->center.z - to[1].x.p.z / w[1]->scale -
					 w[1]->center.z) < 1e-5);
		assert_true(fabs(pdf[0] / pdf[1] - 1) < 1e-5);
		for (int k = 0; k < 3; k++)
			assert_true(fabs(transmittance[0].v[k] / transmittance[1].v[k] - 1) < 1e-5);
	}
	assert_true(in_media > NUMBERS / 2 && in_media < NUMBERS);
	world_free(w[0]);
	world_free(w[1]);
}

/* Like stepped_grid_equals_homogeneous_layers(), but in media that only absorb, between points on both sides of the
 * boundaries and within them. */
static void absorbing_grid_equals_absorbing_layers(void **state)
{
	(void)state;
	struct world *w = make_grid_world(false);
	assert_false(w->effects.scattering);
	const struct wavelengths rgb = {.is_rgb = true};
	for (double a = -3.9; a < 0; a += 0.37)
		for (double b = -3.8; b < 0; b += 0.41) {
			struct path_vertex from = vertex_at_depth(w, a), to = vertex_at_depth(w, b);
			spectrum transmittance = path_transmittance(w, &rgb, 1, &from, &to);
			double depth = 0;
			for (int i = 0; i < VALUES; i++)
				depth += grid_densities[i] * fmax(fmin(fmax(a, b), i - 3) - fmax(fmin(a, b), i - 4), 0);
			for (int k = 0; k < 3; k++)
				assert_true(fabs(transmittance.v[k] / exp(-depth * (k == 0   ? 2
										    : k == 1 ? 1
											     : 0.5)) -
						 1) < 1e-7);
		}
	struct path_vertex from = vertex_at_depth(w, 2), sky = {.kind = VERTEX_INFINITE, .x.p = {0, 0, -1}};
	double depth = grid_densities[0] + grid_densities[1] + grid_densities[2] + grid_densities[3];
	assert_true(fabs(path_transmittance(w, &rgb, 1, &from, &sky).v[0] / exp(-2 * depth) - 1) < 1e-7);
	assert_true(fabs(path_transmittance(w, &rgb, 1, &sky, &from).v[0] / exp(-2 * depth) - 1) < 1e-7);
	world_free(w);
}

/* Points in the first and in the third layer see each other with the same optical depths in both directions; only the
 * ends of the edge are exchanged. */
static void transmittance_is_equal_in_both_directions(void **state)
{
	(void)state;
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct world *w = make_layers();
	struct path_context c = context_of(w, counters);
	struct path_vertex a = vertex_at_depth(w, 0.5), b = vertex_at_depth(w, -5);
	struct path_edge there, back;
	spectrum left, left_back;
	a.edge.medium = 1;
	b.edge.medium = 3;
	assert_true(path_is_visible_in_media(&c, &a, &b, &there, &left));
	assert_true(path_is_visible_in_media(&c, &b, &a, &back, &left_back));
	assert_int_equal(there.previous_medium, 1);
	assert_int_equal(there.medium, 3);
	assert_int_equal(back.previous_medium, 3);
	assert_int_equal(back.medium, 1);
	assert_true(there.has_matching_media && back.has_matching_media);
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		assert_true(fabs(there.scattering_transmittance.v[i] / back.scattering_transmittance.v[i] - 1) < 1e-12);
		assert_true(fabs(left.v[i] / left_back.v[i] - 1) < 1e-12);
		assert_true(left.v[i] <
			    0.95 * there.scattering_transmittance.v[i]); /* the layer between the points absorbs */
	}
	a.edge.medium = 2; /* differs from the interior that the layer states */
	assert_true(path_is_visible_in_media(&c, &a, &b, &there, &left));
	assert_false(there.has_matching_media);
	world_free(w);
}

/* A lamp in fog that states no medium, a lamp that states the medium around it, a point light outside the fog, and
 * one inside. */
static void edges_find_emitters_in_and_outside_fog(void **state)
{
	(void)state;
	/* clang-format off */
	struct world *w = world_from_text(8, 8,
		"%s"
		LAYER("0", "2", FOG("interior", "1,1,1", "0.5,0.5,0.5"))
		"<shape type='sphere'><float name='radius' value='0.2'/><emitter type='area'/></shape>"
		"<shape type='sphere'>"
			"<point name='center' x='1' y='0' z='0'/>"
			"<float name='radius' value='0.2'/>"
			"<emitter type='area'/>"
			FOG("exterior", "2,2,2", "0.5,0.5,0.5")
		"</shape>"
		"<emitter type='point'><point name='position' x='0' y='1' z='3'/></emitter>"
		"<emitter type='point'><point name='position' x='0' y='1' z='1'/></emitter>"
		"<emitter type='constant'/>",
		SENSOR("0,0,5", "0,0,0"));
	/* clang-format on */
	assert_int_equal(w->emitter_count, 5);
	static const uint32_t around[] = {1, 2, 0, 1, 0};
	for (int32_t i = 0; i < 5; i++) {
		struct emitter_point p;
		double pdf;
		const double u[] = {0.3, 0.6};
		assert_true(w->emitters[i].ops->sample_point(&w->emitters[i], u, &p, &pdf));
		struct path_vertex v = path_emitter_vertex(w, i, &p, 0);
		assert_int_equal(path_medium_of_emitter(w, &v, p.n), around[i]);
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(scattering_events_follow_their_density),
		cmocka_unit_test(stepped_grid_equals_homogeneous_layers),
		cmocka_unit_test(absorbing_grid_equals_absorbing_layers),
		cmocka_unit_test(transmittance_is_equal_in_both_directions),
		cmocka_unit_test(edges_find_emitters_in_and_outside_fog),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
