/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Materials of glTF as the scene reader translates them: base colour and metal, the layers and volumes of extensions
 * (clearcoat, sheen, transmission, anisotropy, specular reflection), emitting surfaces, images in buffers, WebP, and
 * unsupported formats. Features without an equivalent are named in a note or refused.
 */
#include "tests/support/gltf_files.h"
#include "tests/support/pictures.h"
#include "tests/support/scene_parts.h"
#include "worker/render/medium/medium.h"
#include "worker/render/texture/raster.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void assert_near(double got, double want)
{
	if (!(fabs(got - want) <= 1e-12 * fabs(want)))
		fail_msg("%.17g is not %.17g", got, want);
}

#define IOR "\"KHR_materials_ior\": {"
/* Layers that `principled` represents in its own way, textures for two of them, and details that are left out with a
 * note. */
static void test_layers_become_principled_parameters(void **state)
{
	(void)state;
	static const char third[] = "bsdf of materials[2]";
	struct scene s = gltf_files_read_changed(
		IOR,
		"\"KHR_materials_clearcoat\": {\"clearcoatFactor\": 0.5, \"clearcoatTexture\": {\"index\": 0}, "
		"\"clearcoatRoughnessFactor\": 0.5, \"clearcoatRoughnessTexture\": {\"index\": 0}, "
		"\"clearcoatNormalTexture\": {\"index\": 0}}, \"KHR_materials_iridescence\": {\"iridescenceFactor\": 1}, "
		"\"KHR_materials_sheen\": {\"sheenColorFactor\": [0.5, 0.25, 0.125]}, " IOR,
		false);
	const struct scene_node *coat = node_ref(scene_find_object(&s, third), "coat");
	assert_string_equal(coat->type, "scale");
	assert_near(node_float(coat, "scale", 0), 0.5);
	assert_string_equal(node_string(node_child(coat, PLUGIN_TEXTURE, 0), "channel", ""), "r");
	const struct scene_node *rough = node_ref(scene_find_object(&s, third), "coat_roughness");
	assert_string_equal(node_string(node_child(rough, PLUGIN_TEXTURE, 0), "channel", ""), "g");
	assert_near(node_float(scene_find_object(&s, third), "sheen", 0), 0.5);
	assert_near(node_float(scene_find_object(&s, third), "sheen_tint", 0), 0.75);
	assert_true(scene_has_note(&s, "sheen is that of") && scene_has_note(&s, "thin films") &&
		    scene_has_note(&s, "clear coats use the normals"));
	scene_fini(&s);

	s = gltf_files_read_changed("\"transmissionFactor\": 1",
				    "\"transmissionFactor\": 1, \"transmissionTexture\": {\"index\": 0}", false);
	assert_string_equal(node_string(node_ref(scene_find_object(&s, third), "spec_trans"), "channel", ""), "r");
	scene_fini(&s);
}

/* Fails unless the medium only absorbs; such a medium is valid for the renderer. */
static void assert_absorbs_only(const struct scene_node *node)
{
	struct arena arena = {0};
	struct error e;
	struct medium m;
	const struct volume_build build = {.arena = &arena, .is_dialect_3 = true, .world_scale = 1};
	if (medium_create(&m, node, &build, &e))
		fail_msg("%s", e.text);
	assert_true(m.is_absorbing && !m.is_scattering);
	arena_fini(&arena);
}

/* After a distance of 2, one quarter of red light, one half of green light and nearly no blue light is left. */
static void test_attenuation_becomes_an_absorbing_medium(void **state)
{
	(void)state;
	static const char volume[] =
		"\"KHR_materials_volume\": {\"attenuationDistance\": 2, \"attenuationColor\": [0.25, 0.5, 0]",
			  third[] = "medium of materials[2]";
	char with[256], thin[256];
	snprintf(with, sizeof with, "%s, \"thicknessFactor\": 0.1}, " IOR, volume);
	snprintf(thin, sizeof thin, "%s}, " IOR, volume);
	struct scene s = gltf_files_read_changed(IOR, with, false);
	const struct scene_node *medium = scene_find_object(&s, third);
	const double *sigma_a = node_find_property(medium, "sigma_t")->value.as.rgb;
	assert_near(exp(-2 * sigma_a[0]), 0.25);
	assert_near(exp(-2 * sigma_a[1]), 0.5);
	assert_true(exp(-2 * sigma_a[2]) < 2e-6);
	assert_absorbs_only(medium);
	uint32_t inside = 0;
	for (uint32_t i = 0; i < s.object_count; i++)
		if (s.objects[i]->cls == PLUGIN_SHAPE && node_ref(s.objects[i], "interior") == medium)
			inside++;
	assert_true(inside > 0);
	scene_fini(&s);
	s = gltf_files_read_changed(IOR, thin, false);
	for (uint32_t i = 0; i < s.object_count; i++)
		assert_true(s.objects[i]->cls != PLUGIN_MEDIUM);
	scene_fini(&s);
}

/* A share of the light is transmitted diffusely, with a colour of its own; a metal transmits less of it, and glass
 * none. */
static void test_diffuse_transmission_is_a_share_of_the_light(void **state)
{
	(void)state;
#define FIRST "{\"pbrMetallicRoughness\": {\"metallicFactor\": 0, \"baseColorFactor\": [0.8, 0.4, 0.2, 1]}"
#define THROUGH(more)                                                                   \
	"\"KHR_materials_diffuse_transmission\": {\"diffuseTransmissionFactor\": 0.5, " \
	"\"diffuseTransmissionColorFactor\": [0.25, 0.5, 1]" more "}"
	static const char first[] = "bsdf of materials[0]";
	struct scene s = gltf_files_read_changed(FIRST, FIRST ", \"extensions\": {" THROUGH("") "}", false);
	const struct scene_node *blend = scene_find_object(&s, first), *sheet = node_child(blend, PLUGIN_BSDF, 1);
	assert_string_equal(blend->type, "blendbsdf");
	assert_near(node_float(blend, "weight", 0), 0.5);
	assert_string_equal(node_child(blend, PLUGIN_BSDF, 0)->type, "principled");
	assert_string_equal(sheet->type, "difftrans");
	assert_near(node_find_property(sheet, "transmittance")->value.as.rgb[0], 0.25);
	assert_false(scene_has_note(&s, "diffuse_transmission"));
	scene_fini(&s);
	s = gltf_files_read_changed(FIRST,
				    "{\"pbrMetallicRoughness\": {\"metallicFactor\": 0.75}, \"extensions\": {" THROUGH(
					    ", \"diffuseTransmissionTexture\": {\"index\": 0}, "
					    "\"diffuseTransmissionColorTexture\": {\"index\": 0}") "}",
				    false);
	blend = scene_find_object(&s, first);
	const struct scene_node *weight = node_ref(blend, "weight"),
				*colour = node_ref(node_child(blend, PLUGIN_BSDF, 1), "transmittance");
	assert_near(node_float(weight, "scale", 0), 0.125);
	assert_string_equal(node_string(node_child(weight, PLUGIN_TEXTURE, 0), "channel", ""), "a");
	assert_near(node_find_property(colour, "scale")->value.as.rgb[1], 0.5);
	scene_fini(&s);
	s = gltf_files_read_changed(IOR, THROUGH("") ", " IOR, false); /* the material transmits */
	assert_string_equal(scene_find_object(&s, "bsdf of materials[2]")->type, "principled");
	assert_true(scene_has_note(&s, "is left out if the material also transmits light otherwise"));
	scene_fini(&s);
#undef FIRST
#undef THROUGH
}

/* The two roughnesses of `principled` equal those of the format. */
static void test_anisotropy_gives_the_roughnesses_of_the_format(void **state)
{
	(void)state;
	static const char third[] = "bsdf of materials[2]";
	struct scene s = gltf_files_read_changed(
		IOR, "\"KHR_materials_anisotropy\": {\"anisotropyStrength\": 0.6}, " IOR, false);
	const struct scene_node *bsdf = scene_find_object(&s, third);
	double x = node_float(bsdf, "anisotropic", 0), r = node_float(bsdf, "roughness", 0), aspect = sqrt(1 - 0.9 * x);
	assert_true(x > 0);
	assert_near(r * r / aspect, 0.25 + 0.75 * 0.36);
	assert_near(r * r * aspect, 0.25);
	scene_fini(&s);
	static const char *const left_out[] = {
		"\"KHR_materials_anisotropy\": {\"anisotropyStrength\": 0.6, \"anisotropyRotation\": 1}, " IOR,
		"\"KHR_materials_anisotropy\": {\"anisotropyStrength\": 0.6, \"anisotropyTexture\": {}}, " IOR};
	for (int i = 0; i < 2; i++) {
		s = gltf_files_read_changed(IOR, left_out[i], false);
		assert_null(node_find_property(scene_find_object(&s, third), "anisotropic"));
		assert_true(scene_has_note(&s, "anisotropy is left out if it has a texture or a rotation"));
		scene_fini(&s);
	}
}

static void test_materials_are_converted(void **state)
{
	(void)state;
	static const char second[] = "bsdf of materials[1]", third[] = "bsdf of materials[2]";
	struct scene s =
		gltf_files_read_changed("\"metallicFactor\": 0.5,",
					"\"metallicFactor\": 0.5},\n\"alphaMode\": \"MASK\", \"alphaCutoff\": 0.25, "
					"\"normalTexture\": {\"index\": 0, \"scale\": 2}, \"x\": {",
					false);
	const struct scene_node *mask = scene_find_object(&s, second), *map = node_child(mask, PLUGIN_BSDF, 0),
				*opacity = node_ref(mask, "opacity");
	assert_string_equal(mask->type, "mask");
	assert_string_equal(node_string(opacity, "channel", ""), "a");
	assert_near(node_float(opacity, "threshold", 0), 0.25);
	assert_string_equal(map->type, "normalmap");
	assert_true(node_bool(map, "handedness", false));
	assert_true(node_float(map, "scale", 0) == 2);
	assert_false(node_bool(map, "use_shadowing_function", true));
	assert_false(node_bool(map, "flip_invalid_normals", true));
	assert_string_equal(node_child(map, PLUGIN_BSDF, 0)->type, "principled");
	scene_fini(&s);

	/* Unknown modes are refused; a lenient reader shows the material as opaque. */
	static const char unknown[] = "\"metallicFactor\": 0.5},\n\"alphaMode\": \"MASKED\", \"x\": {";
	static struct gltf_files f;
	struct error e;
	assert_true(gltf_files_read(gltf_files_make_changed(&f, "\"metallicFactor\": 0.5,", unknown), false, &s, &e) <
		    0);
	assert_non_null(strstr(e.text, "`alphaMode \"MASKED\"` is not supported; --lenient leaves it out"));
	s = gltf_files_read_changed("\"metallicFactor\": 0.5,", unknown, true);
	assert_true(node_float(scene_find_object(&s, second), "opacity", 0) == 1);
	assert_true(scene_has_note(&s, "the parameter `alphaMode \"MASKED\"` is not supported and left out (lenient)"));
	scene_fini(&s);

	/* Abbe's number is 20 / dispersion: (n(d) - 1) / (n(F) - n(C)). */
	s = gltf_files_read_changed(IOR, "\"KHR_materials_dispersion\": {\"dispersion\": 0.5}, " IOR, false);
	const struct scene_node *glass = scene_find_object(&s, third);
	double b = node_float(glass, "int_cauchy_b", 0);
	assert_string_equal(glass->type, "roughdielectric");
	assert_near(0.75 / (b / (0.48613 * 0.48613) - b / (0.65627 * 0.65627)), 40);
	assert_near(node_float(glass, "alpha", 0), 0.25);
	assert_null(node_find_property(glass, "specular_transmittance"));
	scene_fini(&s);

	/* A coloured specular reflection, like that of `principled`. */
	s = gltf_files_read_changed(
		"\"metallicFactor\": 0, \"roughnessFactor\": 0.5},\n\"extensions\": {\"KHR_materials_transmission\": ",
		"\"metallicFactor\": 0, \"roughnessFactor\": 0.5, \"baseColorFactor\": [0.25, 0.81, 0.04, 1]},\n"
		"\"extensions\": {\"KHR_materials_dispersion\": {\"dispersion\": 0.5}, \"KHR_materials_transmission\": ",
		false);
	glass = scene_find_object(&s, third);
	assert_string_equal(glass->type, "roughdielectric");
	const struct property *colour = node_find_property(glass, "specular_transmittance");
	assert_non_null(colour);
	assert_near(colour->value.as.rgb[0], 0.5);
	assert_near(colour->value.as.rgb[1], 0.9);
	assert_near(colour->value.as.rgb[2], 0.2);
	scene_fini(&s);

	s = gltf_files_read_changed(
		IOR,
		"\"KHR_materials_clearcoat\": {\"clearcoatFactor\": 0.5, \"clearcoatRoughnessFactor\": 0.25}, " IOR,
		false);
	assert_near(node_float(scene_find_object(&s, third), "coat", 0), 0.5);
	assert_near(node_float(scene_find_object(&s, third), "coat_roughness", 0), 0.25);
	assert_false(scene_has_note(&s, "clear coats"));
	scene_fini(&s);

	/* Unknown extensions are ignored with a note, even if the file does not list them. */
	s = gltf_files_read_changed(IOR, "\"ACME_materials_fur\": {}, " IOR, false);
	assert_true(scene_has_note(&s, "ACME_materials_fur of a material is not supported and ignored"));
	assert_false(scene_has_note(&s, "KHR_materials_ior"));
	scene_fini(&s);

	s = gltf_files_read_changed(", \"material\": 0}", "}", false);
	/* The format's default material, after the last one of the file. */
	scene_find_object(&s, "bsdf of materials[4]");
	scene_fini(&s);
}

/* The reflectance at normal incidence is min(r^2 c, 1) f: f is the strength, and c is `specular_color`, times its
 * largest component if that is above 1, which the index includes. Glass keeps its index. */
#define R2 ((0.75 / 2.75) * (0.75 / 2.75))
static void test_normal_reflectance_follows_the_format(void **state)
{
	(void)state;
	/* of the cases below */
	static const double of_others[][3] = {[3] = {0}, [4] = {0.25, 0.25, 0.25}, [5] = {0}, [6] = {0, 1, 0.5}},
			    of_glass[][3] = {[3] = {0}, [4] = {0.25, 0.25, 0.25}, [5] = {0}, [6] = {0, 1, 1}};
	static const struct {
		const char *members;
		double ior, expected_reflectance,
			strength; /* expected_reflectance: the square of the index's r; strength: -1: a texture */
		const char *colour, *glass_colour; /* "rgb", or the type of a texture; NULL: none */
	} files[] = {
		{"\"specularFactor\": 0.5", 1.75, R2, 0.5, NULL, NULL},
		{"\"specularColorFactor\": [2, 2, 2]", 1.75, 2 * R2, 1, NULL, NULL},
		{"\"specularColorFactor\": [100, 100, 100], \"specularFactor\": 0.25", 1.75, 1 / 1.21 * 0.81, 0.25,
		 NULL, NULL},
		{"\"specularColorFactor\": [0, 0, 0]", 1.5, 0.04, 1, "rgb", "rgb"},
		{"\"specularColorFactor\": [0.25, 0.25, 0.25]", 1.5, 0.04, 1, "rgb", "rgb"},
		{"\"specularColorFactor\": [0, 0, 0], \"specularColorTexture\": {\"index\": 0}", 1.5, 0.04, 1, "rgb",
		 "rgb"},
		{"\"specularColorFactor\": [0, 2, 1], \"specularFactor\": 0.5", 1.5, 2 * 0.04, 0.5, "rgb", "rgb"},
		{"\"specularColorTexture\": {\"index\": 0}", 1.5, 0.04, 1, "bitmap", "bitmap"},
		{"\"specularTexture\": {\"index\": 0}", 1.5, 0.04, -1, NULL, NULL},
		{"\"specularTexture\": {\"index\": 0}, \"specularFactor\": 0", 1.5, 0.04, 0, NULL, NULL},
	};
	for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
		for (int glass = 0; glass < 2; glass++) {
			char from[64], to[256];
			snprintf(from, sizeof from, "\"KHR_materials_%s\": {%s",
				 glass ? "transmission" : "emissive_strength", glass ? "" : "\"emissiveStrength\": 8}");
			snprintf(to, sizeof to, "\"KHR_materials_specular\": {%s}, %s%.2f}, %s", files[i].members,
				 glass ? "\"x\": {\"ior\": " : IOR "\"ior\": ", files[i].ior, from);
			struct scene s = gltf_files_read_changed(from, to, false);
			const struct scene_node *bsdf =
				scene_find_object(&s, glass ? "bsdf of materials[2]" : "bsdf of materials[3]");
			const struct property *colour = node_find_property(bsdf, "specular_color");
			const char *want = glass ? files[i].glass_colour : files[i].colour;
			double eta = node_float(bsdf, "eta", 0), root = (eta - 1) / (eta + 1);
			assert_near(root * root, glass ? R2 : files[i].expected_reflectance);
			assert_true((colour != NULL) == (want != NULL));
			if (want && strcmp(want, "rgb") == 0)
				for (int k = 0; k < 3; k++)
					assert_true(colour->value.as.rgb[k] == ((glass ? of_glass : of_others)[i][k]));
			else if (want)
				assert_string_equal(node_ref(bsdf, "specular_color")->type, want);
			if (files[i].strength < 0)
				assert_string_equal(node_string(node_ref(bsdf, "specular_strength"), "channel", ""),
						    "a");
			else
				assert_near(node_float(bsdf, "specular_strength", 1), files[i].strength);
			assert_true(scene_has_note(&s, "specular colours above 1") ==
				    (glass && (i == 1 || i == 2 || i == 6)));
			scene_fini(&s);
		}
}

/* Both sides of a doubleSided surface emit light. */
static void test_double_sided_surfaces_emit_on_both_sides(void **state)
{
	(void)state;
	static const char factor[] = "\"emissiveFactor\": [1, 0.5, 0.5]";
	static const char *const files[] = {factor, "\"doubleSided\": false, \"emissiveFactor\": [1, 0.5, 0.5]",
					    "\"doubleSided\": true, \"emissiveFactor\": [1, 0.5, 0.5]"};
	for (int i = 0; i < 3; i++) {
		struct scene s = gltf_files_read_changed(factor, files[i], false);
		assert_true(node_bool(scene_find_object(&s, "emitter of materials[3]"), "two_sided", false) ==
			    (i == 2));
		scene_fini(&s);
	}
}

/* A WebP image is preferred to the fallback image for readers without WebP. */
static void test_webp_is_preferred_to_its_fallback(void **state)
{
	(void)state;
	static struct gltf_files f;
	struct scene s;
	gltf_files_make(&f);
	gltf_files_replace(&f, "{\"source\": 0, ",
			   "{\"source\": 0, \"extensions\": {\"EXT_texture_webp\": {\"source\": 1}}, ");
	gltf_files_replace(&f, "{\"uri\": \"rgb.hdr\"}", "{\"uri\": \"rgb.hdr\"}, {\"uri\": \"b.webp\"}");
	gltf_files_replace(&f, "\"extensionsUsed\"",
			   "\"extensionsRequired\": [\"EXT_texture_webp\"], \"extensionsUsed\"");
	s = gltf_files_read_packed(&f, GLTF_EXTERNAL);
	const struct scene_node *scale = node_ref(scene_find_object(&s, "bsdf of materials[1]"), "base_color");
	assert_string_equal(node_string(node_child(scale, PLUGIN_TEXTURE, 0), "filename", ""), "b.webp");
	scene_fini(&s);
}

/* If the format of an image is not supported, the fallback image is used; without one, the error asks to convert the
 * image. */
static void test_unsupported_images_use_their_fallback(void **state)
{
	(void)state;
	static const char *const formats[] = {"KHR_texture_basisu", "EXT_texture_avif", "MSFT_texture_dds"};
	static struct gltf_files f;
	for (int i = 0; i < 3; i++)
		for (int both = 0; both < 2; both++) {
			char to[256], want[256];
			struct scene s;
			struct error e = {""};
			gltf_files_make(&f);
			snprintf(to, sizeof to, "{%s\"extensions\": {\"%s\": {\"source\": 1}}, ",
				 both ? "\"source\": 0, " : "", formats[i]);
			gltf_files_replace(&f, "{\"source\": 0, ", to);
			gltf_files_replace(&f, "{\"uri\": \"rgb.hdr\"}",
					   "{\"uri\": \"rgb.hdr\"}, {\"uri\": \"b.ktx2\"}");
			snprintf(to, sizeof to, "\"extensionsRequired\": [\"%s\"], \"extensionsUsed\"", formats[i]);
			gltf_files_replace(&f, "\"extensionsUsed\"", to);
			gltf_files_pack(&f, GLTF_EXTERNAL);
			int rc = gltf_files_read(f.files, false, &s, &e);
			if (both) {
				assert_int_equal(rc, 0);
				const struct scene_node *scale =
					node_ref(scene_find_object(&s, "bsdf of materials[1]"), "base_color");
				assert_string_equal(node_string(node_child(scale, PLUGIN_TEXTURE, 0), "filename", ""),
						    "rgb.hdr");
				scene_fini(&s);
				continue;
			}
			snprintf(
				want, sizeof want,
				"images of %s are not supported; export PNG, JPEG or WebP; --lenient leaves the texture out",
				formats[i]);
			assert_true(rc == -ENOTSUP && strstr(e.text, want));
			assert_int_equal(gltf_files_read(f.files, true, &s, &e), 0);
			assert_null(node_find_property(scene_find_object(&s, "bsdf of materials[1]"), "base_color"));
			assert_true(scene_has_note(&s, formats[i]));
			scene_fini(&s);
		}
}

/* A mesh without a material has the format's default, which is a metal, or Blender's, which is grey. */
static void test_mesh_without_material_gets_the_default(void **state)
{
	(void)state;
	static const char version[] = "{\"version\": \"2.0\"}";
	for (int blender = 0; blender < 2; blender++) {
		static struct gltf_files f;
		struct scene s;
		gltf_files_make(&f);
		gltf_files_replace(&f, ", \"material\": 0}", "}");
		if (blender)
			gltf_files_replace(
				&f, version,
				"{\"generator\": \"Khronos glTF Blender I/O v3.3.27\", \"version\": \"2.0\"}");
		s = gltf_files_read_packed(&f, GLTF_EXTERNAL);
		const struct scene_node *bsdf = scene_find_object(&s, "bsdf of materials[4]");
		assert_true(node_float(bsdf, "metallic", -1) == (blender ? 0 : 1));
		assert_near(node_float(bsdf, "eta", 0), 1.5);
		assert_true(node_float(bsdf, "specular_strength", 1) == (blender ? 0 : 1));
		scene_fini(&s);
	}
}

/* An image in the middle of a buffer equals the same image in a file, at every offset, in each form of the file
 * format. */
static void test_images_in_buffers_equal_those_in_files(void **state)
{
	(void)state;
	static const double rgb[12] = {0.5, 0.25, 0.75, 0.125, 0.5, 0.25, 0.75, 0.75, 0.5, 0.25, 0.75, 0.875};
	static struct gltf_files f;
	struct pictures p = {0};
	pictures_add(&p, 2, 2, rgb);
	for (int form = 0; form < GLTF_FORMS; form++)
		for (size_t offset = 0; offset < 4; offset++) {
			char view[128], length[64];
			struct scene s;
			struct error e;
			struct raster r = {0};
			const struct raster_options range = {0, 1, false, IMAGE_ALL};
			struct arena arena = {.limit = 1 << 20};
			gltf_files_make(&f);
			size_t at = f.buffer_size + offset, size = p.file[0].size;
			memset(f.buffer + f.buffer_size, 0x5a, offset);
			memcpy(f.buffer + at, p.file[0].bytes, size);
			snprintf(length, sizeof length, "\"byteLength\": %zu}]", f.buffer_size);
			f.buffer_size = at + size + 1;
			f.buffer[at + size] = 0x5a;
			snprintf(view, sizeof view,
				 "\"bufferViews\": [\n{\"buffer\": 0, \"byteOffset\": %zu, \"byteLength\": %zu},", at,
				 size);
			gltf_files_replace(&f, "\"bufferViews\": [", view);
			for (int i = 12; i >= 0; i--) {
				char from[32], to[32];
				snprintf(from, sizeof from, "{\"bufferView\": %d,", i);
				snprintf(to, sizeof to, "{\"bufferView\": %d,", i + 1);
				if (strstr(f.json, from))
					gltf_files_replace(&f, from, to);
			}
			gltf_files_replace(&f, "{\"uri\": \"rgb.hdr\"}",
					   "{\"bufferView\": 0, \"mimeType\": \"image/hdr\"}");
			char longer[64];
			snprintf(longer, sizeof longer, "\"byteLength\": %zu}]", f.buffer_size);
			gltf_files_replace(&f, length, longer);
			s = gltf_files_read_packed(&f, (enum gltf_form)form);
			const struct scene_node *bitmap =
				node_child(node_ref(scene_find_object(&s, "bsdf of materials[1]"), "base_color"),
					   PLUGIN_TEXTURE, 0);
			struct asset_source assets = memory_assets(f.files);
			if (raster_read(&r, bitmap, &assets, &range, &arena, &e))
				fail_msg("form %d, offset %zu: %s", form, offset, e.text);
			for (int i = 0; i < 12; i++)
				assert_near((double)indexed_image_value(&r.image, (size_t)i), rgb[i]);
			arena_fini(&arena);
			scene_fini(&s);
		}
	pictures_fini(&p);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_materials_are_converted),
		cmocka_unit_test(test_layers_become_principled_parameters),
		cmocka_unit_test(test_attenuation_becomes_an_absorbing_medium),
		cmocka_unit_test(test_diffuse_transmission_is_a_share_of_the_light),
		cmocka_unit_test(test_anisotropy_gives_the_roughnesses_of_the_format),
		cmocka_unit_test(test_normal_reflectance_follows_the_format),
		cmocka_unit_test(test_double_sided_surfaces_emit_on_both_sides),
		cmocka_unit_test(test_images_in_buffers_equal_those_in_files),
		cmocka_unit_test(test_mesh_without_material_gets_the_default),
		cmocka_unit_test(test_webp_is_preferred_to_its_fallback),
		cmocka_unit_test(test_unsupported_images_use_their_fallback),
	};
	return cmocka_run_group_tests_name("gltf_material", tests, NULL, NULL);
}
