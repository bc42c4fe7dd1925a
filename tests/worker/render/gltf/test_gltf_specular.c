/* SPDX-License-Identifier: Apache-2.0 */
/*
 * KHR_materials_specular with its textures, to the values of the BSDF: an image of one colour is the factor, one of two
 * pixels is at each of them another material, also where light enters.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/scene_parts.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/image/srgb.h"
#include "worker/render/render.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define PI 3.14159265358979323846

/* Two pixels, side by side, in the order blue, green, red, alpha. One component is 1: then the index is the same. */
static const unsigned char pixels[2][4] = {{140, 255, 160, 51}, {255, 150, 130, 204}};

/* An image of the first pixel alone, or of both, uncompressed. */
static size_t make_image(unsigned char *out, int width)
{
	const unsigned char head[18] = {[2] = 2, [12] = (unsigned char)width, [14] = 1, [16] = 32, [17] = 0x28};
	memcpy(out, head, sizeof head);
	memcpy(out + sizeof head, pixels, 4 * (size_t)width);
	return sizeof head + 4 * (size_t)width;
}

struct material {
	struct scene scene;
	struct arena arena;
	struct bsdf bsdf;
};

/* base and more: of the material; specular: of the extension. textures[0]: of one pixel, [1]: of two. */
static void make_material(struct material *m, const char *base, const char *more, const char *specular)
{
	static const char format[] =
		"{\"asset\": {\"version\": \"2.0\"}, \"scene\": 0, \"scenes\": [{\"nodes\": [0]}], \"nodes\": [{\"mesh\": 0}],"
		"\"meshes\": [{\"primitives\": [{\"attributes\": {\"POSITION\": 0, \"TEXCOORD_0\": 1}, \"material\": 0}]}],"
		"\"materials\": [{\"pbrMetallicRoughness\": {\"metallicFactor\": 0, \"roughnessFactor\": 0.6, "
		"\"baseColorFactor\": [%s, 1]}, \"extensions\": {%s\"KHR_materials_specular\": {%s}}}],"
		"\"textures\": [{\"source\": 0, \"sampler\": 0}, {\"source\": 1, \"sampler\": 0}], "
		"\"samplers\": [{\"magFilter\": 9728}], \"images\": [{\"uri\": \"a.tga\"}, {\"uri\": \"b.tga\"}],"
		"\"accessors\": [{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\", "
		"\"min\": [0, 0, 0], \"max\": [1, 1, 0]}, {\"bufferView\": 0, \"byteOffset\": 36, \"componentType\": 5126, "
		"\"count\": 3, \"type\": \"VEC2\"}], \"bufferViews\": [{\"buffer\": 0, \"byteLength\": 60}], "
		"\"buffers\": [{\"uri\": \"b.bin\", \"byteLength\": 60}]}";
	static const float corners[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1};
	unsigned char one[64], two[64];
	char json[4096];
	struct error e;
	snprintf(json, sizeof json, format, base, more, specular);
	const struct memory_file files[] = {{"s.gltf", json, strlen(json)},
					    {"b.bin", corners, sizeof corners},
					    {"a.tga", one, make_image(one, 1)},
					    {"b.tga", two, make_image(two, 2)},
					    {0}};
	struct asset_source assets = memory_assets(files);
	*m = (struct material){0};
	if (scene_read_all(&m->scene, &assets, "s.gltf", render_plugins(), NULL, 0, false, &e))
		fail_msg("%s", e.text);
	if (m->scene.problem_count)
		fail_msg("%s", m->scene.problems[0]);
	const struct bsdf_build build = {.arena = &m->arena, .is_dialect_3 = true, .assets = &assets};
	if (bsdf_create(&m->bsdf, scene_find_object(&m->scene, "bsdf of materials[0]"), &build, &e))
		fail_msg("%s", e.text);
}

static void release_material(struct material *m)
{
	scene_fini(&m->scene);
	arena_fini(&m->arena);
}

static vec3 direction(double z, double phi)
{
	double s = sqrt((1 - z) * (1 + z));
	return (vec3){s * cos(phi), s * sin(phi), z};
}

static spectrum evaluate_bsdf(const struct material *m, double u, vec3 wo, vec3 wi)
{
	static const struct wavelengths w = {.nm = {430, 500, 570, 640}};
	const struct bsdf_point at = {
		.texture_point = {.u = u, .v = 0.5}, .wavelengths = &w, .transport = TRANSPORT_RADIANCE};
	return m->bsdf.ops->eval(&m->bsdf, &at, wo, wi);
}

/* At u, a is b. The spectra of images are interpolated in a table: they differ by up to 0.7 % from those of factors. */
static void expect_same_bsdf(const struct material *a, double u, const struct material *b, int kind)
{
	int seen = 0;
	for (int i = 0; i < 400; i++) {
		double side = i % 3 ? 1 : -1, other = i % 2 ? 1 : -1;
		vec3 wo = direction(side * (0.05 + 0.9 * (i % 20) / 20), 0.4),
		     wi = direction(other * (0.05 + 0.9 * (i / 20) / 20), 0.3 * i);
		spectrum p = evaluate_bsdf(a, u, wo, wi), q = evaluate_bsdf(b, u, wo, wi);
		for (int l = 0; l < SPECTRUM_LANES; l++)
			if (!(fabs(p.v[l] - q.v[l]) <= (kind ? 1e-2 : 1e-6) * q.v[l]))
				fail_msg("%d at %g: %.9g is not %.9g", kind, u, p.v[l], q.v[l]);
		seen += q.v[0] > 0;
	}
	assert_true(seen > 60);
}

#define GLASS "\"KHR_materials_transmission\": {\"transmissionFactor\": 0.8}, \"KHR_materials_ior\": {\"ior\": 1.7}, "
#define STRENGTH "\"specularTexture\": {\"index\": %d}, \"specularFactor\": 0.9"
#define COLOUR "\"specularColorTexture\": {\"index\": %d}"

static void test_textures_equal_factors(void **state)
{
	(void)state;
	static const char *const more[] = {"", GLASS, "\"KHR_materials_clearcoat\": {\"clearcoatFactor\": 0.5}, "};
	for (int kind = 0; kind < 3; kind++)
		for (size_t k = 0; k < sizeof more / sizeof *more; k++) {
			struct material maps[2], of_pixel[2];
			for (int i = 0; i < 2; i++) {
				char text[256];
				double rgb[3], strength = kind == 1 ? 1 : 0.9 * pixels[i][3] / 255;
				for (int c = 0; c < 3; c++)
					rgb[c] = kind ? srgb_to_linear(pixels[i][2 - c] / 255.0) : 1;
				if (kind == 0)
					snprintf(text, sizeof text, STRENGTH, i);
				else if (kind == 1)
					snprintf(text, sizeof text, COLOUR, i);
				else
					snprintf(text, sizeof text, STRENGTH ", " COLOUR, i, i);
				make_material(&maps[i], "0.8, 0.3, 0.1", more[k], text);
				snprintf(text, sizeof text,
					 "\"specularFactor\": %.17g, \"specularColorFactor\": [%.17g, %.17g, %.17g]",
					 strength, rgb[0], rgb[1], rgb[2]);
				make_material(&of_pixel[i], "0.8, 0.3, 0.1", more[k], text);
			}
			expect_same_bsdf(&maps[0], 0.2, &of_pixel[0], kind);
			expect_same_bsdf(&maps[0], 0.8, &of_pixel[0], kind);
			expect_same_bsdf(&maps[1], 0.2, &of_pixel[0], kind);
			expect_same_bsdf(&maps[1], 0.8, &of_pixel[1], kind);
			assert_false(scene_has_note(&maps[0].scene, "specular"));
			for (int i = 0; i < 2; i++) {
				release_material(&maps[i]);
				release_material(&of_pixel[i]);
			}
		}
}

/* The colour scales what is reflected at normal incidence alone: black surfaces still reflect grazing light. */
static void test_black_surfaces_reflect_grazing_light(void **state)
{
	(void)state;
	struct material none, some;
	make_material(&none, "0, 0, 0", "", "\"specularColorFactor\": [0, 0, 0]");
	make_material(&some, "0, 0, 0", "", "\"specularColorFactor\": [0.25, 0.25, 0.25]");
	for (int i = 0; i < 18; i++) {
		double z = 0.05 + 0.05 * i, grazing = pow(1 - z, 5);
		spectrum p = evaluate_bsdf(&none, 0.5, direction(z, 0), direction(z, PI)),
			 q = evaluate_bsdf(&some, 0.5, direction(z, 0), direction(z, PI));
		for (int l = 0; l < SPECTRUM_LANES; l++)
			if (!(q.v[l] > 0 && fabs(p.v[l] / q.v[l] - grazing / (0.01 + 0.99 * grazing)) <= 1e-6))
				fail_msg("at a cosine of %g: %.9g of %.9g", z, p.v[l], q.v[l]);
	}
	release_material(&none);
	release_material(&some);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_textures_equal_factors),
		cmocka_unit_test(test_black_surfaces_reflect_grazing_light),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
