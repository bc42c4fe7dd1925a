/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Colours at the vertices of glTF meshes (COLOR_0), against PLY files with the same numbers and materials that name
 * the attribute: the scattering is equal everywhere on the meshes.
 */
#include "tests/support/gltf_files.h"
#include "tests/support/mesh_files.h"
#include "tests/support/pictures.h"
#include "tests/support/worlds.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The texture coordinates of the strip, 0 or 65535 in two bytes each, are read as four channels of one byte each. */
#define LAST "\"normalized\": true, \"count\": 4, \"type\": \"VEC2\"}],"
#define BYTES \
	"\"normalized\": true, \"count\": 4, \"type\": \"VEC2\"},\n{\"bufferView\": 8, \"componentType\": 5121, " LAST

static const char strip_ply[] =
	"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float r\n"
	"property float g\nproperty float b\nproperty float vertex_alpha\nelement face 2\n"
	"property list uchar int vertex_indices\nend_header\n"
	"-1 0 -1 0 0 0 0\n-1 0 1 0 0 1 1\n1 0 -1 1 1 0 0\n1 0 1 1 1 1 1\n3 0 1 2\n3 1 3 2\n";

#define SHAPE(file, inner)                                                                                       \
	"<shape type='ply'><string name='filename' value='" file "'/><boolean name='srgb' value='false'/>" inner \
	"</shape>"
#define FIELD(property, attribute) \
	"<texture type='mesh_attribute'" property "><string name='name' value='" attribute "'/></texture>"
#define FLOAT(name, value) "<float name='" name "' value='" value "'/>"
#define BITMAP(name, more)                                                                       \
	"<texture name='" name "' type='bitmap'><string name='filename' value='rgb.hdr'/>"       \
	"<string name='filter_type' value='nearest'/><string name='wrap_mode_u' value='clamp'/>" \
	"<string name='wrap_mode_v' value='mirror'/>" more "</texture>"
#define RAW(channel) "<boolean name='raw' value='true'/><string name='channel' value='" channel "'/>"

/* clang-format off */
static const char twin_xml[] =
	"<scene version='3.0.0'>"
		SENSOR("0,3,9", "0,0,0")
		"<emitter type='constant'/>"
		SHAPE("strip.ply",
			"<bsdf type='mask'>"
				"<texture type='scale' name='opacity'>"
					FLOAT("scale", "0.5")
					FIELD("", "vertex_alpha")
				"</texture>"
				"<bsdf type='principled'>"
					"<boolean name='lambertian' value='true'/>"
					"<texture type='scale' name='base_color'>"
						"<rgb name='scale' value='0.8 0.4 0.2'/>"
						FIELD("", "vertex_color")
					"</texture>"
					FLOAT("metallic", "0")
					FLOAT("roughness", "1")
					FLOAT("eta", "1.5")
				"</bsdf>"
			"</bsdf>")
		SHAPE("solid.ply",
			"<bsdf type='principled'>"
				"<boolean name='lambertian' value='true'/>"
				"<texture type='scale' name='base_color'>"
					FIELD(" name='scale'", "vertex_color")
					"<texture type='scale'>"
						"<rgb name='scale' value='0.5 1 0.25'/>"
						BITMAP("x", "")
					"</texture>"
				"</texture>"
				"<texture name='metallic' type='scale'>"
					FLOAT("scale", "0.5")
					BITMAP("x", RAW("b"))
				"</texture>"
				BITMAP("roughness", RAW("g"))
				FLOAT("eta", "1.5")
			"</bsdf>")
	"</scene>";
/* clang-format on */

static size_t write_solid(char *text, size_t size)
{
	size_t n = (size_t)snprintf(
		text, size,
		"ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
		"property float u\nproperty float v\nproperty float r\nproperty float g\nproperty float b\n"
		"element face %d\nproperty list uchar int vertex_indices\nend_header\n",
		SOLID_VERTICES, SOLID_TRIANGLES);
	for (int i = 0; i < SOLID_VERTICES; i++) {
		const double *p = solid_position[i];
		n += (size_t)snprintf(text + n, size - n, "%g %g %g %.9g %.9g %g %g %g\n", p[0], p[1], p[2],
				      solid_uv[i][0], solid_uv[i][1], p[0], p[1], p[2]);
	}
	for (int i = 0; i < SOLID_TRIANGLES; i++)
		n += (size_t)snprintf(text + n, size - n, "3 %u %u %u\n", solid_index[i][0], solid_index[i][1],
				      solid_index[i][2]);
	return n;
}

static void make_gltf_files(struct gltf_files *f, const char *mode)
{
	char material[128];
	snprintf(material, sizeof material,
		 "{\"alphaMode\": \"%s\", \"pbrMetallicRoughness\": {\"metallicFactor\": 0, \"baseColorFactor\": [0.8, "
		 "0.4, 0.2, 0.5]",
		 mode);
	gltf_files_make(f);
	gltf_files_replace(f, LAST, BYTES);
	gltf_files_replace(f, "5121, \"normalized\": true, \"count\": 4, \"type\": \"VEC2\"}],",
			   "5121, \"normalized\": true, \"count\": 4, \"type\": \"VEC4\"}],");
	gltf_files_replace(f, "\"TEXCOORD_0\": 11}", "\"TEXCOORD_0\": 11, \"COLOR_0\": 13}");
	gltf_files_replace(f, "\"TEXCOORD_0\": 2}", "\"TEXCOORD_0\": 2, \"COLOR_0\": 1}");
	gltf_files_replace(f,
			   "{\"pbrMetallicRoughness\": {\"metallicFactor\": 0, \"baseColorFactor\": [0.8, 0.4, 0.2, 1]",
			   material);
	gltf_files_pack(f, GLTF_BINARY);
}

static void test_vertex_colours_render_like_the_xml_twin(void **state)
{
	(void)state;
	static struct gltf_files f;
	static char solid[2048];
	static const double rgb[12] = {0.5, 0.25, 0.75, 0.125, 0.5, 0.25, 0.75, 0.75, 0.5, 0.25, 0.75, 0.875};
	struct pictures p = {0};
	pictures_add(&p, 2, 2, rgb);
	make_gltf_files(&f, "BLEND");
	size_t count = 0;
	while (f.files[count].name)
		count++;
	f.files[count] = (struct memory_file){"rgb.hdr", p.file[0].bytes, p.file[0].size};
	const struct memory_file files[] = {{"twin.xml", twin_xml, sizeof twin_xml - 1},
					    {"strip.ply", strip_ply, sizeof strip_ply - 1},
					    {"solid.ply", solid, write_solid(solid, sizeof solid)},
					    f.files[count],
					    {0}};
	struct world *a = world_from_files(8, 8, f.files), *b = world_from_files(8, 8, files);
	const struct wavelengths colour = {.nm = {450, 550, 600, 700}};
	const vec3 wo = vec3_normalize((vec3){0.25, 0.5, 1}), wi = vec3_normalize((vec3){-0.25, 0.25, 1});
	double sum = 0;
	for (uint32_t s = 0; s < 2; s++) {
		const struct geom_shape *mesh = &a->shapes[s];
		assert_int_equal(mesh->triangle_count, b->shapes[s].triangle_count);
		assert_true(mesh->triangle_count == (s ? SOLID_TRIANGLES : 2));
		for (uint32_t k = 0; k < 16 * mesh->triangle_count; k++) {
			struct surface_point x;
			double b1 = (k % 4) / 3.0, b2 = (k / 4 % 4) / 3.0 * (1 - b1);
			surface_on_triangle(mesh, (struct prim_ref){s, k / 16, 0}, b1, b2, &x);
			struct bsdf_point at = world_bsdf_point(&x, &colour, TRANSPORT_RADIANCE);
			const struct bsdf *of_a = &a->bsdfs[a->shape_bindings[s].bsdf],
					  *of_b = &b->bsdfs[b->shape_bindings[s].bsdf];
			spectrum fa = of_a->ops->eval(of_a, &at, wo, wi), fb = of_b->ops->eval(of_b, &at, wo, wi);
			for (int l = 0; l < SPECTRUM_LANES; l++) {
				if (!(fabs(fa.v[l] - fb.v[l]) <= 1e-12 * fb.v[l])) /* the index is computed */
					fail_msg("shape %u, triangle %u, lane %d: %a, in the twin %a", s, k / 16, l,
						 fa.v[l], fb.v[l]);
				sum += fa.v[l];
			}
		}
	}
	assert_true(sum > 1);
	world_free(a);
	world_free(b);
	pictures_fini(&p);
}

/* A product with a vertex colour has no threshold; with opaque materials alpha has no effect. */
static void test_alpha_modes_limit_vertex_colours(void **state)
{
	(void)state;
	static struct gltf_files f;
	static const struct {
		const char *mode;
		int result;
	} cases[] = {{"MASK", -1}, {"OPAQUE", 0}};
	for (int i = 0; i < 2; i++) {
		make_gltf_files(&f, cases[i].mode);
		struct asset_source assets = memory_assets(f.files);
		struct scene s;
		struct error e = {""};
		int rc = scene_read(&s, &assets, f.files[0].name, render_plugins(), NULL, 0, &e);
		if ((rc < 0) != (cases[i].result < 0) ||
		    (rc && !strstr(e.text, "`alpha_of_COLOR_0_with_MASK` is not supported; --lenient")))
			fail_msg("%s: %d, %s", cases[i].mode, rc, e.text);
		if (!rc)
			scene_fini(&s);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_vertex_colours_render_like_the_xml_twin),
		cmocka_unit_test(test_alpha_modes_limit_vertex_colours),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
