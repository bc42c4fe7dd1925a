/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An effect that a scene does not call for changes nothing: each effect is forced on where it is off, and the image
 * stays the same. Bit for bit (sums of each block of each group) if the effect draws nothing different; otherwise the
 * two images agree by t over 32 groups, level 1e-6 per comparison, with a power that finds 2 % on a block and 0.5 % on
 * the mean (agreement.h prints both). The cases after "all in chains" take minutes, and run only with FULL=1.
 */
#include "worker/render/render.h"
#include "tests/support/agreement.h"
#include "tests/support/test_length.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define DEPTH "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
#define VIEW DEPTH SENSOR("0,0.2,1.9", "0,-0.3,-1")
/* clang-format off */
#define WALLS                                                                                                                   \
	"<shape type='cube'><transform name='to_world'><scale value='2'/></transform>"                                          \
	"<bsdf type='diffuse'><float name='reflectance' value='0.5'/></bsdf></shape>"
#define LAMP                                                                                                                    \
	"<shape type='rectangle'><transform name='to_world'><scale value='1.6'/><rotate x='1' angle='90'/><translate y='1.9'/>" \
	"</transform><emitter type='area'><float name='radiance' value='3'/></emitter></shape>"
/* clang-format on */
#define POINT \
	"<emitter type='point'><point name='position' x='0.5' y='1.2' z='0'/><float name='intensity' value='3'/></emitter>"
#define BALL(bsdf)                                                                                               \
	"<shape type='sphere'><point name='center' value='0,-0.6,-0.3'/><float name='radius' value='0.8'/>" bsdf \
	"</shape>"
/* A floor seen from above under a wide lamp, and glass under the sky: nearly uniform, so that chains agree within
 * seconds. */
#define FROM_ABOVE \
	"<integrator type='path'><integer name='max_depth' value='2'/></integrator>" SENSOR("0,3,0.5", "0,0,0")
/* clang-format off */
#define PLATE(inner)                                                                                                            \
	"<shape type='rectangle'><transform name='to_world'><scale value='6'/><rotate x='1' angle='-90'/></transform>" inner     \
	"</shape>"
#define LIT_PLATE                                                                                                               \
	FROM_ABOVE PLATE("") "<shape type='rectangle'><transform name='to_world'><scale value='6'/><rotate x='1' angle='90'/>"  \
			     "<translate y='5'/></transform><emitter type='area'><float name='radiance' value='3'/></emitter></shape>"
/* clang-format on */
#define POINT_OVER_PLATE  \
	FROM_ABOVE PLATE( \
		"") "<emitter type='point'><point name='position' x='0' y='5' z='0'/><float name='intensity' value='9'/></emitter>"
#define PANE              \
	FROM_ABOVE PLATE( \
		"<bsdf type='dielectric'/>") "<emitter type='constant'><float name='radiance' value='1'/></emitter>"
/* clang-format off */
#define GLASS_UNDER_THE_SKY                                                                                                     \
	DEPTH SENSOR("0,1,5", "0,-0.2,0") "<emitter type='constant'><float name='radiance' value='1'/></emitter>"               \
	"<shape type='sphere'><point name='center' value='0,-0.2,0'/><float name='radius' value='0.8'/><bsdf type='dielectric'/></shape>"
/* clang-format on */

static struct world *build_with_effects(const char *scene, const char *effects)
{
	worlds_effects = effects;
	struct world *w = world_from_text(16, 16, "%s", scene);
	worlds_effects = NULL;
	return w;
}

static bool is_effect_on(const struct world *w, const char *name)
{
	struct render_summary s;
	world_summary(w, &s);
	return render_effect_is_on(&s, name);
}

/* ---- bits ---- */

enum { BITS_BOOTSTRAP = 256 };

static const struct {
	const char *integrator, *mutations;
} integrators[] = {
	{"path", NULL},
	{"bdpt", NULL},
	{"pssmlt", NULL},
	{"hslt", "bidirectional=0.1,hslt=0.5,rejoin=0.3,light=0.1"},
};

static void check_bits(const char *scene, const char *effect)
{
	static struct agreement_image plain, forced;
	char text[64];
	snprintf(text, sizeof text, "+%s", effect);
	struct world *a = build_with_effects(scene, NULL), *b = build_with_effects(scene, text);
	assert_false(is_effect_on(a, effect));
	assert_true(is_effect_on(b, effect));
	for (size_t i = 0; i < sizeof integrators / sizeof *integrators; i++) {
		const struct agreement_options options = {integrators[i].integrator, 256, 16, 1, 4};
		agreement_render_with_mutations(a, effect, "bits", &options, BITS_BOOTSTRAP, integrators[i].mutations,
						&plain);
		agreement_render_with_mutations(b, effect, "bits", &options, BITS_BOOTSTRAP, integrators[i].mutations,
						&forced);
		if (memcmp(plain.mean, forced.mean, sizeof plain.mean) != 0)
			fail_msg("%s forced on changes bits of %s", effect, integrators[i].integrator);
		assert_int_equal(plain.counters[COUNT_ACCEPTED], forced.counters[COUNT_ACCEPTED]);
		assert_true(plain.mean[0][AGREEMENT_CELLS] > 0);
	}
	world_free(a);
	world_free(b);
}

static void test_bits(void **state)
{
	(void)state;
	static const char *const unused_effects[] = {"aperture",     "half-vectors", "specular",
						     "glossy",	     "transmission", "textures",
						     "displacement", "environment",  "delta-light"};
	for (size_t i = 0; i < sizeof unused_effects / sizeof *unused_effects; i++)
		check_bits(VIEW WALLS LAMP, unused_effects[i]);
	check_bits(VIEW WALLS POINT, "area-light");
	check_bits(VIEW WALLS POINT, "emitter-move");
	check_bits(VIEW BALL("<bsdf type='conductor'><string name='material' value='none'/></bsdf>") LAMP, "diffuse");
	/* Glass in a closed box is left out of the world unless an effect is forced on. */
	/* clang-format off */
	check_bits(
		VIEW WALLS LAMP
		"<shape type='cube'>"
			"<transform name='to_world'><scale value='0.4'/><translate y='-0.6'/></transform>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' value='0,-0.6,0'/>"
			"<float name='radius' value='0.3'/>"
			"<bsdf type='dielectric'/>"
		"</shape>",
		"textures");
	/* clang-format on */
	/* Only the floor scatters: paths of more than two edges carry nothing, but are tried. */
	/* clang-format off */
	check_bits(
		DEPTH
		SENSOR("0,1,5", "0,-0.2,0")
		"<shape type='rectangle'>"
			"<transform name='to_world'><scale value='3'/><rotate x='1' angle='-90'/></transform>"
		"</shape>"
		POINT,
		"depth");
	/* clang-format on */
}

/* ---- statistics ---- */

static const struct comparison {
	const char *name, *scene, *effects, *effect, *integrator;
	uint64_t spp, forced_spp; /* one wavelength per path is noisier than four, and four are noisier than grey */
	const char *mutations, *forced_mutations; /* half of the mutations are independent, so that blocks agree to 2 %
						   * within seconds */
} comparisons[] = {
	{"colour", VIEW WALLS LAMP, "+colour", "colour", "path", 1536, 1536, NULL, NULL},
	{"dispersion", GLASS_UNDER_THE_SKY, "+dispersion", "dispersion", "path", 256, 512, NULL, NULL},
	{"all in chains", LIT_PLATE, "all", "half-vectors", "hslt", 16384, 20480, "bidirectional=0.5,rejoin=0.5",
	 "bidirectional=0.5,hslt=0.2,lens=0.1,light=0.1,wavelength=0.1"},
	{"dispersion in chains", PANE, "+dispersion", "dispersion", "hslt", 18432, 43008, "bidirectional=0.5,hslt=0.5",
	 "bidirectional=0.5,hslt=0.3,wavelength=0.2"},
	{"emitter moves in chains", POINT_OVER_PLATE, "+emitter-move", "emitter-move", "hslt", 16384, 16384,
	 "bidirectional=0.5,rejoin=0.5", "bidirectional=0.5,hslt=0.3,light=0.2"},
};

static void test_agreement(void **state)
{
	const struct comparison *t = *state;
	static struct agreement_image plain, forced;
	struct world *a = build_with_effects(t->scene, NULL), *b = build_with_effects(t->scene, t->effects);
	const struct agreement_options options = {t->integrator, t->spp, 32, 0, 0},
				       forced_options = {t->integrator, t->forced_spp, 32, 0, 0};
	assert_false(is_effect_on(a, t->effect));
	assert_true(is_effect_on(b, t->effect));
	agreement_render_with_mutations(a, t->name, "plain", &options, AGREEMENT_BOOTSTRAP, t->mutations, &plain);
	agreement_render_with_mutations(b, t->name, "forced", &forced_options, AGREEMENT_BOOTSTRAP, t->forced_mutations,
					&forced);
	agreement_check(t->name, &forced, &plain);
	world_free(a);
	world_free(b);
}

int main(void)
{
	enum { COMPARED = sizeof comparisons / sizeof *comparisons, SHORT = 3 };
	struct CMUnitTest tests[COMPARED + 1] = {cmocka_unit_test(test_bits)};
	for (size_t i = 0; i < COMPARED; i++)
		tests[i + 1] = (struct CMUnitTest){comparisons[i].name, test_agreement, NULL, NULL,
						   (void *)(uintptr_t)&comparisons[i]};
	return _cmocka_run_group_tests("effects", tests, (test_is_full() ? COMPARED : SHORT) + 1, NULL, NULL);
}
