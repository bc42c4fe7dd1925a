/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Every integrator of the registry against the path tracer, on small scenes (tests/scenes/integrators) that each
 * exercise one feature: diffuse light and textures, glossy metal, smooth glass, rough glass, shading normals, light
 * from infinity. Statistics as in tests/support/agreement.h. Chains take minutes where light passes through glass and
 * need FULL=1 there.
 */
#include "worker/render/path/integrator.h"
#include "worker/render/render.h"
#include "tests/support/agreement.h"
#include "tests/support/test_length.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Samples per pixel that the power requires; 0: the scene tests nothing new of this integrator. */
struct sample_counts {
	uint64_t path, bdpt;
	uint64_t rare_light;	/* integrators with few light sub-paths */
	uint64_t redistributed; /* short chains from samples; rare_light_redistributed: with few light sub-paths */
	uint64_t rare_light_redistributed;
	uint64_t chain;		    /* chains over all techniques */
	uint64_t single_path_chain; /* chains over single paths, in which a mutation yields less information */
};

static uint64_t samples_for_integrator(const struct sample_counts *n, const struct integrator_properties *r)
{
	const struct integrator *of = integrator_find(r->name);
	bool rare = of->light_subpath_interval > 1;
	if (of->redistributes)
		return rare ? n->rare_light_redistributed : n->redistributed;
	return r->kind != PLAN_SAMPLES ? (r->has_mutations ? n->single_path_chain : n->chain)
	       : rare		       ? n->rare_light
				       : n->bdpt;
}

static void check_all(const char *name, const char *file, const struct sample_counts *n)
{
	struct world *w = world_from_own_scene("integrators", file, 32, 32);
	static struct agreement_image reference, other;
	struct agreement_options path = {"path", n->path, 32, 0, 0};
	agreement_render(w, name, "path", &path, &reference);
	for (size_t i = 0; render_integrator_at(i); i++) {
		const struct integrator_properties *r = render_integrator_at(i);
		struct agreement_options side = {r->name, samples_for_integrator(n, r), 32, 0, 0};
		char test[64];
		if (strcmp(r->name, "path") == 0 || !samples_for_integrator(n, r))
			continue;
		snprintf(test, sizeof test, "%s %s", name, r->name);
		agreement_render(w, test, r->name, &side, &other);
		agreement_check(test, &other, &reference);
	}
	world_free(w);
}

/* Returns spp with FULL=1, else 0. */
static uint64_t spp_if_full(uint64_t spp)
{
	return test_is_full() ? spp : 0;
}

static void integrators_agree_on_diffuse_light(void **state)
{
	(void)state;
	check_all("diffuse", "diffuse.xml",
		  &(struct sample_counts){.path = 640,
					  .bdpt = 640,
					  .rare_light = 384,
					  .redistributed = 768,
					  .rare_light_redistributed = spp_if_full(1440),
					  .chain = spp_if_full(6656)});
}

static void integrators_agree_on_glossy_surfaces(void **state)
{
	(void)state;
	check_all("glossy", "glossy.xml",
		  &(struct sample_counts){.path = 1536,
					  .bdpt = 1536,
					  .rare_light = spp_if_full(1280),
					  .redistributed = spp_if_full(3456),
					  .rare_light_redistributed = 2432});
}

static void integrators_agree_on_smooth_glass(void **state)
{
	(void)state;
	check_all("glass", "glass.xml",
		  &(struct sample_counts){.path = 3072,
					  .bdpt = 3072,
					  .rare_light = spp_if_full(2048),
					  .redistributed = spp_if_full(4000),
					  .rare_light_redistributed = spp_if_full(5760)});
}

static void integrators_agree_on_rough_glass(void **state)
{
	(void)state;
	check_all("rough glass", "rough-glass.xml",
		  &(struct sample_counts){.path = 2000,
					  .bdpt = 2000,
					  .redistributed = spp_if_full(5760),
					  .chain = spp_if_full(12800),
					  .single_path_chain = spp_if_full(21504)});
}

static void integrators_agree_under_an_environment(void **state)
{
	(void)state;
	check_all("environment", "environment.xml",
		  &(struct sample_counts){.path = 512,
					  .bdpt = 384,
					  .redistributed = 512,
					  .chain = spp_if_full(6144),
					  .single_path_chain = spp_if_full(12600)});
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(integrators_agree_on_diffuse_light),
		cmocka_unit_test(integrators_agree_on_glossy_surfaces),
		cmocka_unit_test(integrators_agree_on_smooth_glass),
		cmocka_unit_test(integrators_agree_on_rough_glass),
		cmocka_unit_test(integrators_agree_under_an_environment),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
