/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Light that samples hardly ever find: a small lamp in a glass ball, a fiftieth of whose light is reflected inside
 * the glass first. `path` meets it once in a million samples, `bdpt` often. In fog no connection is refracted, and
 * `path` misses all light of a lamp in glass. The independent check is a render: the light missing in a short render
 * by path is the difference to bdpt.
 */
#include "tests/support/test_length.h"
#include "tests/support/worlds.h"
#include "worker/render/halfvec/refract.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrate_path.h"
#include "worker/render/unseen_light.h"

#include <errno.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

enum { WIDTH = 48, HEIGHT = 36, SAMPLES = 1 << 13, DEPTH = 4 };

struct light_search {
	struct path_context context;
	struct brightness map;
	uint64_t counters[BATCH_COUNTERS];
};

static void light_search_init(struct light_search *l, const struct world *w, uint64_t seed)
{
	struct error e;
	l->context = (struct path_context){.w = w,
					   .window = {0, 0, WIDTH, HEIGHT},
					   .min_depth = 1,
					   .max_depth = DEPTH,
					   .max_survival = PATH_SURVIVAL_MAX,
					   .refract = halfvec_refract,
					   .skips_classes = true,
					   .counters = l->counters};
	assert_int_equal(brightness_init_from_samples(&l->map, &l->context, path_trace_candidates, seed, RNG_TEST, 0,
						      SAMPLES, &e),
			 0);
}

/* Returns the mean contribution relative to the brightness at its position, without contributions brighter than usual
 * ones: both integrators have few fireflies here, and one of path's is as bright as the whole image. */
static double mean_relative_contribution(struct light_search *l, path_tracer *trace, uint64_t seed, uint64_t count)
{
	static struct path_sample sample;
	double sum = 0;
	for (uint64_t i = 0; i < count; i++) {
		struct sampler_random s;
		sampler_random_init(&s, seed, RNG_TEST, i, 1);
		trace(&l->context, &s.base, &sample);
		for (uint32_t k = 0; k < sample.splat_count; k++) {
			const struct splat *p = &sample.splats[k];
			double y = (p->xyz[0] + p->xyz[1] + p->xyz[2]) * brightness_inverse_at(&l->map, p->x, p->y);
			sum += y < 1 << 12 ? y : 0;
		}
	}
	return sum / (double)count;
}

static void path_lacks_light_that_bdpt_finds(void **state)
{
	(void)state;
	const uint64_t drawn = (1u << 17) / test_scale();
	static struct light_search l;
	struct world *w = world_from_own_scene("bulb", "scene.xml", WIDTH, HEIGHT);
	light_search_init(&l, w, 0);
	double path = mean_relative_contribution(&l, path_trace, 10, drawn),
	       both = mean_relative_contribution(&l, path_trace_bidirectional, 11, drawn), lacks = 1 - path / both;
	for (uint64_t seed = 0; seed < (test_is_scaled() ? 1 : 3); seed++) {
		struct plan_unseen by_path, by_bdpt;
		assert_int_equal(unseen_light_estimate(&l.context, &l.map, 0, seed, 0, SAMPLES, &by_path), 0);
		assert_int_equal(unseen_light_estimate(&l.context, &l.map, 1, seed, 0, SAMPLES, &by_bdpt), 0);
		printf("path lacks %.2f %% of the light; unseen by 64 samples: root mean square %.2f %%, by bdpt %.2f %%\n",
		       100 * lacks, 100 * sqrt(by_path.mean_squares[3]), 100 * sqrt(by_bdpt.mean_squares[3]));
		/* The light lies on a third of the image. */
		assert_true(test_is_scaled() ||
			    (sqrt(by_path.mean_squares[3]) > 0.7 * lacks && sqrt(by_path.mean_squares[3]) < 3 * lacks));
		assert_true(by_bdpt.mean_squares[3] < 0.02 * by_path.mean_squares[3]);
		for (int i = 1; i < PLAN_UNSEEN_COUNT; i++)
			assert_true(by_path.mean_squares[i] <= by_path.mean_squares[i - 1]);
		assert_true(by_path.mean_squares[PLAN_UNSEEN_COUNT - 1] <
			    0.01 * by_path.mean_squares[3]); /* 7 billion samples find it */
	}
	assert_true(test_is_scaled() || (lacks > 0.01 && lacks < 0.04));
	brightness_fini(&l.map);
	world_free(w);
}

/* clang-format off */
#define AT(inner) "<transform name='to_world'>" inner "</transform>"
#define FOGGY_ROOM                                                                                                              \
	SENSOR("0,0.2,1.9", "0,-0.3,-1")                                                                                        \
	"<shape type='cube'>" AT("<scale value='2'/>") "<bsdf type='diffuse'><rgb name='reflectance' value='0.5,0.45,0.35'/>"     \
	"</bsdf></shape>"                                                                                                       \
	"<medium type='homogeneous' id='fog'><rgb name='sigma_t' value='%s'/><rgb name='albedo' value='0.9,0.8,0.6'/></medium>"   \
	"<shape type='cube'>" AT("<scale value='1.95'/>") "<bsdf type='null'/><ref name='interior' id='fog'/></shape>"           \
	"<shape type='rectangle'>" AT("<scale value='1.8'/><rotate x='1' angle='90'/><translate y='1.9'/>")                       \
	"<emitter type='area'><rgb name='radiance' value='1,1,1'/></emitter></shape>"                                            \
	"<shape type='sphere'><point name='center' value='1.3,0.5,1'/><float name='radius' value='0.3'/>"                        \
	"<bsdf type='dielectric'/><ref name='exterior' id='fog'/></shape>"                                                      \
	"<shape type='sphere'><point name='center' value='1.35,0.45,1.05'/><float name='radius' value='0.001'/>"                 \
	"<emitter type='area'><float name='radiance' value='1e6'/></emitter></shape>"
/* clang-format on */

/* The means of 131,072 samples each are known to a few per cent. Path lacks more than a tenth of the light, which
 * lies everywhere, so the root mean square of the unseen light is about this share; the light that events in the fog
 * send to the camera is not measured. */
static void path_lacks_light_that_bdpt_finds_in_fog(void **state)
{
	(void)state;
	const uint64_t drawn = (1u << 17) / test_scale();
	static struct light_search l;
	struct world *w = world_from_text(WIDTH, HEIGHT, FOGGY_ROOM, "0.05,0.05,0.1");
	assert_true(w->effects.scattering);
	light_search_init(&l, w, 0);
	double path = mean_relative_contribution(&l, path_trace, 10, drawn),
	       both = mean_relative_contribution(&l, path_trace_bidirectional, 11, drawn), lacks = (both - path) / path;
	for (uint64_t seed = 0; seed < (test_is_scaled() ? 1 : 3); seed++) {
		struct plan_unseen by_path, by_bdpt;
		assert_int_equal(unseen_light_estimate(&l.context, &l.map, 0, seed, 0, SAMPLES, &by_path), 0);
		assert_int_equal(unseen_light_estimate(&l.context, &l.map, 1, seed, 0, SAMPLES, &by_bdpt), 0);
		double share = lacks / (1 + lacks);
		printf("in fog path lacks %.1f %% of the light; unseen by 64 samples: root mean square %.1f %%, by bdpt %.2f %%\n",
		       100 * share, 100 * sqrt(by_path.mean_squares[3]), 100 * sqrt(by_bdpt.mean_squares[3]));
		assert_true(test_is_scaled() ||
			    (sqrt(by_path.mean_squares[3]) > 0.5 * share && sqrt(by_path.mean_squares[3]) < 2 * share));
		assert_true(by_bdpt.mean_squares[3] < 0.02 * by_path.mean_squares[3]);
	}
	brightness_fini(&l.map);
	world_free(w);
}

static struct plan_request request_of(const char *integrator, enum plan_kind kind)
{
	struct plan_request r = {
		.kind = kind, .width = WIDTH, .height = HEIGHT, .spp = 16, .min_depth = 1, .max_depth = DEPTH};
	snprintf(r.integrator, sizeof r.integrator, "%s", integrator);
	return r;
}

static double unseen_light_of_request(const struct world *w, struct plan_request r)
{
	struct plan_request again = r;
	struct error e;
	assert_int_equal(render_unseen_light(w, &r, &e), 0);
	assert_int_equal(render_unseen_light(w, &again, &e), 0);
	assert_memory_equal(&r, &again, sizeof r);
	return r.unseen.mean_squares[3];
}

static void unseen_light_is_estimated_for_requests_of_samples(void **state)
{
	(void)state;
	struct error e;
	struct world *bulb = world_from_own_scene("bulb", "scene.xml", WIDTH, HEIGHT),
		     *box = world_from_own_scene("box", "box.xml", WIDTH, HEIGHT);
	double path = unseen_light_of_request(bulb, request_of("path", PLAN_SAMPLES));
	assert_true(path > 5e-5);
	assert_true(unseen_light_of_request(bulb, request_of("erpt", PLAN_SAMPLES)) < 0.1 * path);
	/* Chains find the light that samples of bdpt find. */
	double chains = unseen_light_of_request(bulb, request_of("hslt", PLAN_CHAINS));
	assert_true(chains < 0.1 * path && chains == unseen_light_of_request(bulb, request_of("bdpt", PLAN_SAMPLES)));

	assert_true(unseen_light_of_request(box, request_of("path", PLAN_SAMPLES)) == 0); /* no lobe is narrow */
	struct plan_request crop = request_of("path", PLAN_SAMPLES);
	crop.crop_width = crop.crop_height = 8;
	assert_true(unseen_light_of_request(bulb, crop) == path);
	struct plan_request invalid_request = request_of("path", PLAN_SAMPLES);
	invalid_request.width = 0;
	assert_int_equal(render_unseen_light(bulb, &invalid_request, &e), -EINVAL);
	struct world *fog = world_from_text(WIDTH, HEIGHT, FOGGY_ROOM, "0.05,0.05,0.1");
	assert_true(unseen_light_of_request(fog, request_of("path", PLAN_SAMPLES)) > 1e-3);
	world_free(bulb);
	world_free(box);
	world_free(fog);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(path_lacks_light_that_bdpt_finds),
					   cmocka_unit_test(path_lacks_light_that_bdpt_finds_in_fog),
					   cmocka_unit_test(unseen_light_is_estimated_for_requests_of_samples)};
	return cmocka_run_group_tests_name("worker/render/unseen_light", tests, NULL, NULL);
}
