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
struct lengths {
	uint64_t path, bdpt;
	uint64_t rare;	 /* integrators with few light sub-paths */
	uint64_t spread; /* short chains from samples; rare_spread: with few light sub-paths */
	uint64_t rare_spread;
	uint64_t chain;	 /* chains over all techniques */
	uint64_t single; /* chains over single paths, in which a mutation yields less information */
};

static uint64_t samples_of(const struct lengths *n, const struct integrator_properties *r)
{
	const struct integrator *of = integrator_find(r->name);
	bool rare = of->light_every > 1;
	if (of->redistributes)
		return rare ? n->rare_spread : n->spread;
	return r->kind != PLAN_SAMPLES ? (r->has_mutations ? n->single : n->chain) : rare ? n->rare : n->bdpt;
}

static void check_all(const char *name, const char *file, const struct lengths *n)
{
	struct world *w = world_from_own_scene("integrators", file, 32, 32);
	static struct agreement_image reference, other;
	struct agreement_options path = {"path", n->path, 32, 0, 0};
	agreement_render(w, name, "path", &path, &reference);
	for (size_t i = 0; render_integrator_at(i); i++) {
		const struct integrator_properties *r = render_integrator_at(i);
		struct agreement_options side = {r->name, samples_of(n, r), 32, 0, 0};
		char test[64];
		if (strcmp(r->name, "path") == 0 || !samples_of(n, r))
			continue;
		snprintf(test, sizeof test, "%s %s", name, r->name);
		agreement_render(w, test, r->name, &side, &other);
		agreement_check(test, &other, &reference);
	}
	world_free(w);
}

/* Returns spp with FULL=1, else 0. */
static uint64_t at_length(uint64_t spp)
{
	return test_is_full() ? spp : 0;
}

static void test_diffuse(void **state)
{
	(void)state;
	check_all("diffuse", "diffuse.xml",
		  &(struct lengths){.path = 640,
				    .bdpt = 640,
				    .rare = 384,
				    .spread = 768,
				    .rare_spread = at_length(1440),
				    .chain = at_length(6656)});
}

static void test_glossy(void **state)
{
	(void)state;
	check_all("glossy", "glossy.xml",
		  &(struct lengths){.path = 1536,
				    .bdpt = 1536,
				    .rare = at_length(1280),
				    .spread = at_length(3456),
				    .rare_spread = 2432});
}

static void test_glass(void **state)
{
	(void)state;
	check_all("glass", "glass.xml",
		  &(struct lengths){.path = 3072,
				    .bdpt = 3072,
				    .rare = at_length(2048),
				    .spread = at_length(4000),
				    .rare_spread = at_length(5760)});
}

static void test_rough_glass(void **state)
{
	(void)state;
	check_all("rough glass", "rough-glass.xml",
		  &(struct lengths){.path = 2000,
				    .bdpt = 2000,
				    .spread = at_length(5760),
				    .chain = at_length(12800),
				    .single = at_length(21504)});
}

static void test_environment(void **state)
{
	(void)state;
	check_all(
		"environment", "environment.xml",
		&(struct lengths){
			.path = 512, .bdpt = 384, .spread = 512, .chain = at_length(6144), .single = at_length(12600)});
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_diffuse),	    cmocka_unit_test(test_glossy),	cmocka_unit_test(test_glass),
		cmocka_unit_test(test_rough_glass), cmocka_unit_test(test_environment),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
