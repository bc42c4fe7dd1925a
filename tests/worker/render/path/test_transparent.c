/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A connection through surfaces passes only surfaces between its ends, never the surface on which the far end lies,
 * although rounding lets a ray to that end meet this surface as well. Past the very edge of an occluder, such a ray
 * may get through although the visibility test found the ends blocked; so the connections of ends that see each other
 * are checked here. Deterministic.
 */
#include "tests/support/worlds.h"
#include "worker/render/path/next_event.h"
#include "worker/render/path/path.h"
#include "worker/render/path/sampler.h"
#include "worker/render/path/transparent.h"
#include "worker/render/path/visible.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

struct tally {
	unsigned open, blocked, passed;
};

static void count_connection(struct path_context *c, unsigned t, const struct path_vertex *y, struct tally *sum)
{
	const struct path_vertex *z = &c->camera[t - 1];
	double distance2;
	spectrum transmittance;
	path_direction(z, y, &distance2);
	if (!(distance2 > 0))
		return;
	bool open = path_is_visible(c, z, y);
	bool through = path_trace_passed(c, t > 1 ? z - 1 : NULL, z, y, &transmittance);
	if (open)
		assert_false(through);
	*(open ? &sum->open : through ? &sum->passed : &sum->blocked) += 1;
	c->passed_count = 0;
}

/* The ends lie on masks and thin glass, flat, round or made of several faces, that emit or reflect light. */
static void connections_do_not_pass_the_surface_of_the_far_end(void **state)
{
	(void)state;
	uint64_t counters[BATCH_COUNTERS] = {0};
	static struct path_context c;
	struct tally sum = {0};
	/* clang-format off */
	struct world *w = world_from_text(32, 32, "%s",
		SENSOR("0,1,5", "0,0,0")
		"<bsdf type='mask' id='half'><float name='opacity' value='.5'/><bsdf type='twosided'><bsdf type='diffuse'/></bsdf>"
			"</bsdf>"
		"<shape type='rectangle'><transform name='to_world'><scale value='5'/><rotate x='1' angle='-90'/>"
			"<translate y='-1'/></transform></shape>"
		"<shape type='rectangle'><transform name='to_world'><rotate x='1' y='.3' angle='70'/><translate y='1.5'/></transform>"
			"<ref id='half'/><emitter type='area'/></shape>"
		"<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/><translate x='.3' y='1.2'/></transform>"
			"<bsdf type='thindielectric'/><emitter type='area'/></shape>"
		"<shape type='sphere'><point name='center' x='-.8' y='0' z='0'/><float name='radius' value='.6'/><ref id='half'/>"
			"<emitter type='area'/></shape>"
		"<shape type='sphere'><point name='center' x='0' y='0' z='.9'/><float name='radius' value='.3'/></shape>"
		"<shape type='cube'><transform name='to_world'><scale value='.4'/><rotate y='1' x='.2' angle='30'/>"
			"<translate x='.8'/></transform><ref id='half'/></shape>");
	/* clang-format on */
	c = (struct path_context){
		.w = w, .window = {0, 0, 32, 32}, .min_depth = 1, .max_depth = 4, .counters = counters};
	assert_true(path_allows_see_through(&c));
	for (uint64_t i = 0; i < 16384; i++) {
		struct sampler_random s;
		struct path_vertex y;
		double film[2], pdf;
		sampler_random_init(&s, 0x656e64, RNG_TEST, i, 0);
		unsigned camera = path_walk_camera(&c, &s.base, 3, film), light = path_walk_light(&c, &s.base, 3);
		for (unsigned t = 2; t <= camera; t++) {
			if (c.camera[t - 1].kind != VERTEX_SURFACE || !path_scatters_smoothly(&c.camera[t - 1]))
				continue;
			if (path_sample_next_event(&c, &c.camera[t - 1], &y, &pdf))
				count_connection(&c, t, &y, &sum);
			for (unsigned k = 2; k <= light; k++)
				count_connection(&c, t, &c.light[k - 1], &sum);
		}
	}
	print_message("%u connections are open, %u pass surfaces, %u are blocked\n", sum.open, sum.passed, sum.blocked);
	assert_true(sum.open > 5000 && sum.passed > 2000 && sum.blocked > 1000);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(connections_do_not_pass_the_surface_of_the_far_end)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
