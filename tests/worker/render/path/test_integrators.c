/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Every integrator of the registry against the path tracer, on small scenes that each exercise something of their own:
 * diffuse light and textures, glossy metal, smooth glass, rough glass, shading normals, light from infinity.
 * Chains take minutes where light comes through glass: FULL=1.
 */
#include "worker/render/path/integrator.h"
#include "worker/render/render.h"
#include "tests/support/agree.h"
#include "tests/support/length.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Samples a pixel, as many as the power asks for; 0: the scene says nothing new of such an integrator. */
struct lengths {
	uint64_t path, bdpt;
	uint64_t rare;	 /* of few light sub-paths */
	uint64_t spread; /* of short chains from samples; rare_spread: from samples with few light sub-paths */
	uint64_t rare_spread;
	uint64_t chain;	 /* of chains of all techniques */
	uint64_t single; /* of chains of single paths, whose states say less a mutation */
};

static uint64_t samples_of(const struct lengths *n, const struct render_integrator *r)
{
	const struct integrator *of = integrator_find(r->name);
	bool rare = of->light_every > 1;
	if (of->redistributes)
		return rare ? n->rare_spread : n->spread;
	return r->kind != PLAN_SAMPLES ? (r->has_mutations ? n->single : n->chain) : rare ? n->rare : n->bdpt;
}

static void check_all(const char *name, struct world *w, const struct lengths *n)
{
	static struct agree_image reference, other;
	struct agree_side path = {"path", n->path, 32, 0, 0};
	agree_render(w, name, "path", &path, &reference);
	for (size_t i = 0; render_integrator_at(i); i++) {
		const struct render_integrator *r = render_integrator_at(i);
		struct agree_side side = {r->name, samples_of(n, r), 32, 0, 0};
		char test[64];
		if (strcmp(r->name, "path") == 0 || !samples_of(n, r))
			continue;
		snprintf(test, sizeof test, "%s %s", name, r->name);
		agree_render(w, test, r->name, &side, &other);
		agree_check(test, &other, &reference);
	}
	world_free(w);
}

/* Samples of what FULL=1 alone compares. */
static uint64_t at_length(uint64_t spp)
{
	return test_full() ? spp : 0;
}

#define DEPTH(k) "<integrator type='path'><integer name='max_depth' value='" k "'/></integrator>"
#define DIFFUSE(rgb) "<bsdf type='diffuse'><rgb name='reflectance' value='" rgb "'/></bsdf>"
#define AT(inner) "<transform name='to_world'>" inner "</transform>"

/* A closed room of side 4 around the origin; the camera looks from the front wall to the back. */
/* clang-format off */
#define ROOM                                                                                                                    \
	SENSOR("0,0.2,1.9", "0,-0.3,-1")                                                                                        \
	"<shape type='cube'>" AT("<scale value='2'/>") DIFFUSE("0.5,0.45,0.35") "</shape>"
/* clang-format on */
/* Light from a large square below the ceiling. */
/* clang-format off */
#define LAMP                                                                                                                    \
	"<shape type='rectangle'>" AT("<scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>")                       \
	"<emitter type='area'><rgb name='radiance' value='3,2.5,2'/></emitter></shape>"
/* clang-format on */
#define BALL(center, radius, bsdf)                                                                                     \
	"<shape type='sphere'><point name='center' value='" center "'/><float name='radius' value='" radius "'/>" bsdf \
	"</shape>"

static void test_diffuse(void **state)
{
	(void)state;
	check_all("diffuse",
		  world_of_text(32, 32,
				DEPTH("3") ROOM LAMP "<shape type='cube'>" AT(
					"<scale value='0.5'/><rotate y='1' angle='25'/><translate y='-1.5' z='-0.5'/>")
					DIFFUSE("0.7,0.2,0.1") "</shape>"),
		  &(struct lengths){.path = 640,
				    .bdpt = 640,
				    .rare = 512,
				    .spread = 1000,
				    .rare_spread = at_length(1440),
				    .chain = at_length(6656)});
}

static void test_glossy(void **state)
{
	(void)state;
	check_all(
		"glossy",
		world_of_text(
			32, 32,
			DEPTH("3") ROOM LAMP "<shape type='rectangle'>" AT(
				"<scale value='1.9'/><rotate x='1' angle='-90'/><translate y='-1.2'/>") "<bsdf type='roughconductor'><string name='material' value='Au'/><float name='alpha' value='0.15'/>"
													"<string name='distribution' value='ggx'/></bsdf></shape>" BALL(
														"0.4,-0.5,-0.6",
														"0.6",
														"<bsdf type='phong'><float name='exponent' value='30'/></bsdf>")
														BALL("-0.9,-0.7,-0.4",
														     "0.4",
														     "<bsdf type='plastic'/>")
															BALL("-0.5,0.6,-0.9", "0.4", "<bsdf type='roughplastic'><float name='alpha' value='0.2'/></bsdf>") "<shape type='rectangle'>" AT(
																"<scale value='0.5'/><translate x='0.9' y='0.5' z='-0.3'/>") "<bsdf type='mask'><float name='opacity' value='0.4'/><bsdf type='blendbsdf'><bsdf type='diffuse'/>"
																							     "<bsdf type='conductor'><string name='material' value='Ag'/></bsdf></bsdf></bsdf></shape>"),
		&(struct lengths){.path = 1536,
				  .bdpt = 1536,
				  .rare = at_length(1280),
				  .spread = at_length(3456),
				  .rare_spread = 3456});
}

static void test_glass(void **state)
{
	(void)state;
	check_all("glass",
		  world_of_text(32, 32,
				DEPTH("6") ROOM LAMP BALL("0,-0.6,-0.3", "0.8",
							  "<bsdf type='mask'><float name='opacity' value='0.8'/>"
							  "<bsdf type='dielectric'><float name='int_ior' value='1.5'/>"
							  "<float name='ext_ior' value='1'/></bsdf></bsdf>")),
		  &(struct lengths){.path = 3072,
				    .bdpt = 3072,
				    .rare = at_length(2048),
				    .spread = 4000,
				    .rare_spread = at_length(5760)});
}

static void test_rough_glass(void **state)
{
	(void)state;
	check_all("rough glass",
		  world_of_text(32, 32,
				DEPTH("4") ROOM LAMP BALL(
					"0,-0.6,-0.3", "0.8",
					"<bsdf type='roughdielectric'><float name='int_ior' value='1.5'/>"
					"<float name='ext_ior' value='1'/><float name='alpha' value='0.25'/></bsdf>")),
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
		"environment",
		world_of_text(
			32, 32,
			DEPTH("4") SENSOR("0,1,5", "0,0,0") "<shape type='rectangle'>" AT(
				"<scale value='6'/><rotate x='1' angle='-90'/><translate y='-1'/>")
				DIFFUSE("0.5,0.5,0.6") "</shape>" BALL(
					"0,0,0", "1",
					"<bsdf type='roughdielectric'><float name='alpha' value='0.3'/></bsdf>") "<emitter type='constant'><rgb name='radiance' value='0.8,0.9,1'/></emitter>"),
		&(struct lengths){.path = 512, .bdpt = 512, .spread = 900, .chain = at_length(6144), .single = 12600});
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_diffuse),	    cmocka_unit_test(test_glossy),	cmocka_unit_test(test_glass),
		cmocka_unit_test(test_rough_glass), cmocka_unit_test(test_environment),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
