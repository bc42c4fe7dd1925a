/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Rays counted by a pilot (worker/render/count_rays.h): as many as the render's own leases take, the same count for the
 * same request, and not many more rays than needed. A time-limited render with these counts has a bootstrap of one
 * quarter of its time, even in a room that hardly loses light. Rays are counted, not seconds.
 */
#include "tests/support/leases.h"
#include "tests/support/test_length.h"
#include "tests/support/worlds.h"
#include "worker/cli/render/local_run.h"
#include "worker/render/count_rays.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

enum { SIZE = 64, SECONDS = 2, RAYS_PER_SECOND = 2000000 };

static const char *const integrator_names[] = {"hslt", "pssmlt", "bdpt", "bdpt8", "path"};
enum { NAMES = sizeof integrator_names / sizeof *integrator_names };

/* Under sanitizers, only hslt of the five integrators is tested. */
static int next_integrator(void)
{
	return test_is_scaled() ? NAMES : 1;
}

/* A sphere around the camera that emits light and reflects 99 %, so that paths hardly end. */
static struct world *bright_sphere(void)
{
	return world_from_text(
		SIZE, SIZE,
		"<integrator type='path'><integer name='max_depth' value='-1'/></integrator>" SENSOR(
			"0,0,0.3",
			"0,0,1") "<shape type='sphere'><boolean name='flip_normals' value='true'/>"
				 "<bsdf type='diffuse'><rgb name='reflectance' value='%s'/></bsdf>"
				 "<emitter type='area'><rgb name='radiance' value='1,1,1'/></emitter></shape>",
		"0.99,0.99,0.99");
}

static struct world *dull_room(void)
{
	return world_from_own_scene("box", "box.xml", SIZE, SIZE);
}

static struct plan_request request_of(const struct world *w, const char *integrator)
{
	const struct integrator_properties *i = render_integrator_find(integrator);
	struct plan_request r = {.kind = i->kind,
				 .width = w->settings.width,
				 .height = w->settings.height,
				 .border = w->settings.border,
				 .seconds = SECONDS,
				 .min_depth = 1,
				 .max_depth = w->settings.max_depth};
	struct render_summary summary;
	struct error e = {""};
	snprintf(r.integrator, sizeof r.integrator, "%s", integrator);
	world_summary(w, &summary);
	if (i->has_mutations && render_canonical_mutations(NULL, &summary, r.mixture, &e))
		fail_msg("%s", e.text);
	return r;
}

static struct plan_rays count_rays(const struct world *w, const struct plan_request *r)
{
	struct plan_rays rays;
	struct error e = {""};
	if (render_count_rays(w, r, &rays, &e))
		fail_msg("%s", e.text);
	return rays;
}

static struct plan make_plan(const struct plan_request *r)
{
	struct plan p;
	struct error e = {""};
	if (plan_make(r, &p, &e))
		fail_msg("%s", e.text);
	return p;
}

static double ray_count_of_batch(const struct batch *b)
{
	return (double)batch_ray_count(b->counters);
}

static double bootstrap_rays(const struct world *w, const struct plan *p)
{
	double sum = 0;
	for (uint32_t group = 0; group < p->groups; group++)
		for (uint32_t part = 0; part < p->parts; part++) {
			const struct lease_key k = {.kind = LEASE_BOOTSTRAP, .group = group, .part = part};
			struct batch b = leases_run(w, p, k, NULL);
			sum += ray_count_of_batch(&b);
			batch_fini(&b);
		}
	return sum;
}

/* Without a pilot, the plan would have 16,384 bootstrap samples, of 8,000 rays each with hslt. */
static void a_bright_room_has_a_short_bootstrap(void **state)
{
	(void)state;
	struct world *w = bright_sphere();
	for (int i = 0; i < NAMES; i += next_integrator()) {
		struct plan_request r = request_of(w, integrator_names[i]);
		r.rays = count_rays(w, &r);
		struct plan p = make_plan(&r);
		double rays = bootstrap_rays(w, &p), quarter = (double)SECONDS * RAYS_PER_SECOND / 4;
		print_message("%s: %.0f rays a bootstrap sample, %.1f a step; %d samples, %.2f of a quarter\n",
			      integrator_names[i], r.rays.bootstrap, r.rays.step, (int)p.bootstrap, rays / quarter);
		assert_true(rays <= fmax(1.15 * quarter, 1.15 * 256 * r.rays.bootstrap));
		assert_true(rays <= 3 * quarter); /* 256 is the smallest bootstrap */
		assert_true((double)p.chains * r.rays.bootstrap <= fmax(quarter / 2, 16 * r.rays.bootstrap));
		assert_true(p.bootstrap < 16384 || r.kind == PLAN_SAMPLES);
	}
	world_free(w);
}

/* The render's own random numbers give nearly the same counts. */
static void pilot_counts_the_rays_of_a_render(void **state)
{
	(void)state;
	struct world *worlds[] = {bright_sphere(), dull_room()};
	static const atomic_bool never;
	for (int i = 0; i < 2 * NAMES; i++) {
		const struct world *w = worlds[i % 2];
		if (i / 2 % next_integrator() || (test_is_scaled() && i % 2 == 0)) /* sanitized: the dull room alone */
			continue;
		struct plan_request r = request_of(w, integrator_names[i / 2]);
		struct plan_rays rays = count_rays(w, &r), again = count_rays(w, &r);
		assert_memory_equal(&rays, &again, sizeof rays);
		r.seconds = 0;
		r.spp = r.kind == PLAN_CHAINS ? 4 : 1;
		r.groups = 4;
		r.bootstrap = 256;
		r.chains = r.kind == PLAN_CHAINS ? 16 : 0;
		struct plan p = make_plan(&r);
		struct local_run run = {.world = w, .plan = &p, .threads = 1, .stop = &never};
		struct error e = {""};
		if (local_run(&run, &e))
			fail_msg("%s", e.text);
		struct canvas_counts all;
		canvas_sum_counts(run.canvas, false, &all);
		double step = (double)batch_ray_count(all.counters) / (double)all.counters[COUNT_SAMPLES],
		       bootstrap = bootstrap_rays(w, &p) / (double)p.bootstrap;
		print_message("%s: %.1f of %.1f rays a bootstrap sample, %.2f of %.2f a step\n",
			      integrator_names[i / 2], rays.bootstrap, bootstrap, rays.step, step);
		assert_true(fabs(log(rays.bootstrap / bootstrap)) < log(1.25));
		assert_true(fabs(log(rays.step / step)) < log(1.5));
		canvas_free(run.canvas);
	}
	world_free(worlds[0]);
	world_free(worlds[1]);
}

/* A request with another seed gives other counts. */
static void seed_changes_the_ray_count(void **state)
{
	(void)state;
	struct world *w = dull_room();
	struct plan_request r = request_of(w, "hslt");
	struct plan_rays one = count_rays(w, &r);
	r.seed = 1;
	struct plan_rays other = count_rays(w, &r);
	assert_memory_not_equal(&one, &other, sizeof one);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_bright_room_has_a_short_bootstrap),
		cmocka_unit_test(pilot_counts_the_rays_of_a_render),
		cmocka_unit_test(seed_changes_the_ray_count),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
