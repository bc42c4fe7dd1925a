/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Attributes of meshes as textures, against independent ways to obtain the same values: colours that are a linear
 * function of the position, against this function, on meshes that are mirrored, displaced or emit light; vertex
 * colours against a picture; one mesh with a number for each triangle against one mesh per number. Invalid attributes
 * are refused by name.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/pictures.h"
#include "tests/support/render_picture.h"
#include "tests/support/worlds.h"
#include "worker/render/texture/attribute_table.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 8, TRIANGLES = 2 * (SIDE - 1) * (SIDE - 1), HEATS = 5, TEXT_MAX = 1 << 14 };

static const struct wavelengths colour = {.nm = {450, 550, 600, 700}};

#define VIEW SENSOR("0.3,0.2,4", "0,0,0")
#define SKY "<emitter type='constant'/>"
#define FIELD(property, attribute) \
	"<texture type='mesh_attribute' name='" property "'><string name='name' value='" attribute "'/></texture>"
#define PLY(file, inner) "<shape type='ply'><string name='filename' value='" file "'/>" inner "</shape>"
#define DIFFUSE(inner) "<bsdf type='diffuse'>" inner "</bsdf>"

/* Computes the colour of the node in column i and row j: the sum of one term per column and one per row, so that
 * bilinear interpolation between four nodes is linear in each triangle. The values are exact in the 8 bits of a
 * picture. */
static void node_colour(int i, int j, double rgb[3])
{
	rgb[0] = (i + j) / 16.0;
	rgb[1] = (2 * (i % 3) + j) / 16.0;
	rgb[2] = (7 - i + (j % 2 ? 4 : 1)) / 16.0;
}

static int triangle_heat(int triangle)
{
	return triangle * 3 % HEATS;
}

/* Writes the grid over [-1,1]^2 at z = 0, with its nodes at the centres of a picture's pixels, and returns its size.
 * heat: only the triangles with this value, or all if -1. linear: the colours are a linear function of the position. */
static size_t write_grid(char *text, int heat, bool linear)
{
	char *at = text, *end = text + TEXT_MAX;
	int count = 0;
	for (int t = 0; t < TRIANGLES; t++)
		count += heat < 0 || triangle_heat(t) == heat;
#define PUT(...) at += snprintf(at, (size_t)(end - at), __VA_ARGS__)
	PUT("ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
	    "property float u\nproperty float v\nproperty float r\nproperty float g\nproperty float b\n"
	    "property float pair_0\nproperty float pair_1\nproperty float wild\n"
	    "element face %d\nproperty list uchar int vertex_indices\nproperty float heat\nend_header\n",
	    SIDE * SIDE, count);
	for (int k = 0; k < SIDE * SIDE; k++) {
		double u = (k % SIDE + 0.5) / SIDE, v = (k / SIDE + 0.5) / SIDE, x = 2 * u - 1, y = 1 - 2 * v, rgb[3];
		node_colour(k % SIDE, k / SIDE, rgb);
		if (linear)
			rgb[0] = (x + 1) / 2, rgb[1] = (y + 1) / 2, rgb[2] = (2 + x - y) / 4;
		PUT("%.9g %.9g 0 %.9g %.9g %.9g %.9g %.9g %.9g %.9g %s\n", x, y, u, v, rgb[0], rgb[1], rgb[2], v,
		    u / 2 - 1, k == 3 ? "1e300" : "0");
	}
	for (int t = 0; t < TRIANGLES; t++) {
		int p = t / 2 / (SIDE - 1) * SIDE + t / 2 % (SIDE - 1), odd = t % 2;
		if (heat < 0 || triangle_heat(t) == heat)
			PUT("3 %d %d %d %.9g\n", p + odd, p + SIDE, p + 1 + odd * SIDE,
			    triangle_heat(t) / (double)HEATS);
	}
#undef PUT
	return (size_t)(at - text);
}

static char grid[TEXT_MAX], linear_grid[TEXT_MAX], heat_files[HEATS][TEXT_MAX];
static struct pictures pictures;

static struct world *make_world(const char *body)
{
	static char xml[TEXT_MAX];
	static char names[HEATS][4];
	struct memory_file files[HEATS + 5];
	int n = snprintf(xml, sizeof xml, "<scene version='3.0.0'>" VIEW "%s</scene>", body), f = 0;
	files[f++] = (struct memory_file){"s.xml", xml, (size_t)n};
	files[f++] = (struct memory_file){"grid.ply", grid, write_grid(grid, -1, false)};
	files[f++] = (struct memory_file){"linear.ply", linear_grid, write_grid(linear_grid, -1, true)};
	if (pictures.count == 0) {
		double rgb[3 * SIDE * SIDE];
		for (int k = 0; k < SIDE * SIDE; k++)
			node_colour(k % SIDE, k / SIDE, rgb + 3 * k);
		pictures_add(&pictures, SIDE, SIDE, rgb);
	}
	files[f++] = (struct memory_file){"p0", pictures.file[0].bytes, pictures.file[0].size};
	for (int h = 0; h < HEATS; h++) {
		snprintf(names[h], sizeof names[h], "h%d", h);
		files[f++] = (struct memory_file){names[h], heat_files[h], write_grid(heat_files[h], h, false)};
	}
	files[f] = (struct memory_file){NULL, NULL, 0};
	return world_from_files(16, 16, files);
}

/* Returns the reflectance of a diffuse surface at each wavelength. */
static spectrum diffuse_reflectance(const struct world *w, const struct surface_point *x)
{
	const struct bsdf *b = &w->bsdfs[w->shape_bindings[x->prim.shape].bsdf];
	struct bsdf_point p = world_bsdf_point(x, &colour, TRANSPORT_RADIANCE);
	return spectrum_scale(M_PI, b->ops->eval(b, &p, (vec3){0, 0, 1}, (vec3){0, 0, 1}));
}

static void assert_close(spectrum a, spectrum b, double tolerance)
{
	for (int l = 0; l < SPECTRUM_LANES; l++)
		if (!(fabs(a.v[l] - b.v[l]) <= tolerance * fabs(b.v[l])))
			fail_msg("lane %d: %.9g is not %.9g", l, a.v[l], b.v[l]);
}

/* The linear colour of write_grid() as a function of the position; lengths of the world are those of the scene but
 * for a power of two. */
static void expected_linear_colour(const struct world *w, vec3 p, double rgb[3])
{
	vec3 q = vec3_madd(w->center, 1 / w->scale, p);
	rgb[0] = (q.x + 1) / 2;
	rgb[1] = (q.y + 1) / 2;
	rgb[2] = (2 + q.x - q.y) / 4;
}

static void assert_linear(const struct world *w, uint32_t shape, bool mirrored)
{
	const struct geom_shape *s = &w->shapes[shape];
	for (uint32_t t = 0; t < s->triangle_count; t++) {
		struct surface_point x;
		double rgb[3];
		surface_on_triangle(s, (struct prim_ref){shape, t, 0}, 0.2, 0.1 + (t % 7) / 10.0, &x);
		vec3 p = x.p;
		if (mirrored)
			p.x = -p.x;
		expected_linear_colour(w, p, rgb);
		assert_close(diffuse_reflectance(w, &x), color_eval_rgb_reflectance(rgb, &colour), 1e-5);
	}
}

/* Flipped normals, winding and splitting turn and move vertices; the attributes must move with them. */
static void test_attributes_follow_their_vertices(void **state)
{
	(void)state;
#define LINEAR DIFFUSE(FIELD("reflectance", "vertex_color"))
	struct world *w = make_world(
		SKY PLY("linear.ply", LINEAR) PLY("linear.ply", LINEAR "<boolean name='flip_normals' value='true'/>")
			PLY("linear.ply", LINEAR "<transform name='to_world'><scale x='-1'/></transform>") PLY(
				"linear.ply", LINEAR
				"<boolean name='face_normals' value='true'/><float name='displacement' value='0'/>"
				"<integer name='displacement_level' value='1'/>")
				PLY("linear.ply", LINEAR
				    "<float name='displacement' value='0'/><integer name='displacement_level' value='2'/>"));
	assert_int_equal(w->shape_count, 5);
	for (uint32_t i = 0; i < 5; i++)
		assert_linear(w, i, i == 2);
	assert_int_equal(w->shapes[4].triangle_count, 16 * TRIANGLES);
	/* one material for each of the two shapes */
	assert_true(w->shape_bindings[0].bsdf != w->shape_bindings[1].bsdf && w->bsdfs[0].is_textured &&
		    w->bsdfs[0].color_kind == COLOR_KIND_OTHER);
	world_free(w);
}

/* Instances share a mesh with its attributes, and share a BSDF where they share triangles; mirrored instances have
 * triangles, and with them attributes, in reversed order. */
static void test_instances_have_the_attributes_of_their_mesh(void **state)
{
	(void)state;
#define INSTANCE(inner) "<shape type='instance'><ref id='g'/><transform name='to_world'>" inner "</transform></shape>"
	struct world *w =
		make_world(SKY "<shape type='shapegroup' id='g'>" PLY("linear.ply", LINEAR) "</shape>" INSTANCE(
			"<translate z='-0.1'/>") INSTANCE("<scale x='-1'/>") INSTANCE("<translate z='0.1'/>"));
	assert_int_equal(w->sharing_shape_count, 3);
	for (uint32_t i = 0; i < 3; i++)
		assert_linear(w, i, i == 1);
	assert_true(w->shape_bindings[0].bsdf == w->shape_bindings[2].bsdf &&
		    w->shape_bindings[0].bsdf != w->shape_bindings[1].bsdf);
	world_free(w);
}

/* Compares the colours of shapes 0 and 1 at the same points. */
static void assert_same_colours(const struct world *w)
{
	for (uint32_t t = 0; t < TRIANGLES; t++)
		for (int k = 0; k < 8; k++) {
			struct surface_point a, b;
			double b1 = k / 10.0, b2 = (7 - k) / 9.0 * (t % 5) / 4;
			surface_on_triangle(&w->shapes[0], (struct prim_ref){0, t, 0}, b1, b2, &a);
			surface_on_triangle(&w->shapes[1], (struct prim_ref){1, t, 0}, b1, b2, &b);
			assert_close(diffuse_reflectance(w, &a), diffuse_reflectance(w, &b), 1e-5);
		}
}

/* A picture whose pixels have the colours of the vertices. */
static void test_attributes_match_a_picture(void **state)
{
	(void)state;
	struct world *w = make_world(SKY PLY("grid.ply", DIFFUSE(FIELD("reflectance", "vertex_color"))) PLY(
		"grid.ply", DIFFUSE("<texture type='bitmap' name='reflectance'>"
				    "<string name='filename' value='p0'/></texture>")));
	assert_same_colours(w);
	world_free(w);
}

/* An image looked up by other coordinates: pairs of numbers at the vertices that are an affine map of (u,v), against
 * this map. */
static void test_images_may_use_other_coordinates(void **state)
{
	(void)state;
#define BITMAP(inner) \
	DIFFUSE("<texture type='bitmap' name='reflectance'><string name='filename' value='p0'/>" inner "</texture>")
	struct world *w = make_world(SKY PLY("grid.ply", BITMAP("<string name='coordinates' value='vertex_pair'/>"))
					     PLY("grid.ply", BITMAP("<transform name='to_uv'><matrix value='0 1 0 0 "
								    "0.5 0 0 -1 0 0 1 0 0 0 0 1'/></transform>")));
	assert_same_colours(w);
	world_free(w);
}

/* One mesh per heat with the colour of this heat, against one mesh with all heats: the images are equal bit by bit. */
static void test_face_attributes_match_separate_meshes(void **state)
{
	(void)state;
	char text[TEXT_MAX], *at = text + snprintf(text, sizeof text, "%s", SKY);
	for (int h = 0; h < HEATS; h++)
		at += snprintf(at, (size_t)(text + sizeof text - at),
			       "<shape type='ply'><string name='filename' value='h%d'/><bsdf type='diffuse'>"
			       "<float name='reflectance' value='%.9g'/></bsdf></shape>",
			       h, (double)(float)(h / (double)HEATS));
	/* With the choice of emitters by position, the probabilities would differ: the walks behind it end where a
	 * whole material is black. */
	worlds_accuracy = "emitter-choice=power";
	struct world *many = make_world(text),
		     *one = make_world(SKY PLY("grid.ply", DIFFUSE(FIELD("reflectance", "face_heat"))));
	worlds_accuracy = NULL;
	assert_true(one->bsdfs[0].color_kind == COLOR_KIND_CONSTANT && !one->effects.colour);
	const struct render_picture_options how = {.integrator = "path", .test = "faces", .spp = 4, .max_depth = 3};
	struct picture a, b;
	double sum = 0;
	render_picture_xyz(many, &how, &a);
	render_picture_xyz(one, &how, &b);
	for (size_t i = 0; i < (size_t)16 * 16; i++)
		for (int k = 0; k < 3; k++) {
			assert_true(a.rgb[k][i] == b.rgb[k][i]);
			sum += (double)a.rgb[k][i];
		}
	assert_true(sum > 0);
	picture_fini(&a);
	picture_fini(&b);
	/* Triangles without area are dropped together with their numbers:
	 * tests/worker/render/shape/test_attributes.c. */
	world_free(many);
	world_free(one);
}

/* Points sampled on a light, and points that rays meet. */
static void test_lights_follow_attributes(void **state)
{
	(void)state;
	struct world *w =
		make_world(PLY("linear.ply", "<emitter type='area'>" FIELD("radiance", "vertex_color") "</emitter>"));
	const struct emitter *em = &w->emitters[0];
	assert_true(em->is_textured && em->color_kind == COLOR_KIND_OTHER && em->power > 0);
	for (int i = 0; i < 200; i++) {
		const double u[2] = {(i + 0.5) / 200, (i * 7 % 200 + 0.5) / 200};
		struct emitter_point drawn;
		struct surface_point met;
		double pdf, rgb[3];
		assert_true(em->ops->sample_point(em, u, &drawn, &pdf));
		assert_true(surface_nearest(&w->shapes[0], (struct prim_ref){0, drawn.texture_point.prim, 0}, drawn.p,
					    &met));
		struct emitter_point as_met = world_emitter_point(&met);
		expected_linear_colour(w, drawn.p, rgb);
		spectrum expected = color_eval_rgb_illuminant(rgb, &colour);
		assert_close(em->ops->radiance(em, &drawn, drawn.n, &colour), expected, 1e-5);
		assert_close(em->ops->radiance(em, &as_met, drawn.n, &colour), expected, 1e-5);
		for (int l = 0; l < SPECTRUM_LANES; l++)
			assert_true(expected.v[l] <= em->brightness_bound);
	}
	world_free(w);
}

/* One material for meshes with different numbers; the smallest roughness is found wherever it lies. */
static void test_smallest_roughness_is_found(void **state)
{
	(void)state;
#define METAL "<bsdf type='roughconductor' id='m'>" FIELD("alpha", "face_heat") "</bsdf>"
	struct world *w =
		make_world(SKY METAL PLY("h3", "<ref id='m'/>") PLY("h1", "<ref id='m'/>") PLY("h4", "<ref id='m'/>"));
	const double heat[3] = {0.6, 0.2, 0.8};
	for (uint32_t i = 0; i < 3; i++) {
		const struct bsdf *b = &w->bsdfs[w->shape_bindings[i].bsdf];
		if (fabs(b->min_alpha - heat[i]) > 1e-6)
			fail_msg("%u: alpha %g", i, b->min_alpha);
	}
	world_free(w);
	/* The roughness of a colour is the mean of its components; one node has the smallest. */
	w = make_world(SKY PLY("linear.ply", "<bsdf type='roughconductor'>" FIELD("alpha", "vertex_color") "</bsdf>"));
	double least = INFINITY;
	for (int k = 0; k < SIDE * SIDE; k++) {
		double x = (k % SIDE + 0.5) / SIDE, y = 1 - (k / SIDE + 0.5) / SIDE;
		const double rgb[3] = {x, y, 0.5 + (x - y) / 2};
		least = fmin(least, (rgb[0] + rgb[1] + rgb[2]) / 3);
	}
	if (fabs(w->bsdfs[0].min_alpha - least) > 1e-5)
		fail_msg("alpha %g, not %g", w->bsdfs[0].min_alpha, least);
	world_free(w);
}

/* Colours in the place of a number are the means of their components, the same for all wavelengths. */
static void test_colours_as_numbers_are_their_means(void **state)
{
	(void)state;
	/* in the first triangle, at the barycentrics below */
	double x = 2 * 0.8 / SIDE - 1, y = 1 - 2 * 0.7 / SIDE;
	double mean = ((x + 1) / 2 + (y + 1) / 2 + (2 + x - y) / 4) / 3;
	char text[4096];
	snprintf(text, sizeof text,
		 SKY PLY("linear.ply", "<bsdf type='principled'>%s</bsdf>")
			 PLY("linear.ply", "<bsdf type='principled'><float name='roughness' value='%.17g'/></bsdf>"),
		 FIELD("roughness", "vertex_color"), mean);
	struct world *w = make_world(text);
	const struct bsdf *got = &w->bsdfs[w->shape_bindings[0].bsdf], *want = &w->bsdfs[w->shape_bindings[1].bsdf];
	assert_true(got->is_textured && !want->is_textured && got->color_kind == want->color_kind);
	struct surface_point at;
	surface_on_triangle(&w->shapes[0], (struct prim_ref){0, 0, 0}, 0.2, 0.3, &at);
	struct bsdf_point p = world_bsdf_point(&at, &colour, TRANSPORT_RADIANCE);
	const vec3 wo = vec3_normalize((vec3){0.3, 0.1, 0.8}), wi = vec3_normalize((vec3){-0.2, 0.1, 0.7});
	assert_close(got->ops->eval(got, &p, wo, wi), want->ops->eval(want, &p, wo, wi), 1e-6);
	world_free(w);
}

/* Parameters whose attribute may exceed 1: the index of a metal, an exponent, an absorption. */
static void test_unbounded_parameters_may_exceed_one(void **state)
{
	(void)state;
#define TENFOLD(property)                                                                            \
	"<texture type='mesh_attribute' name='" property "'><string name='name' value='face_heat'/>" \
	"<float name='scale' value='10'/></texture>"
#define NUMBER(property, value) "<float name='" property "' value='" value "'/>"
	static const char *const of[][2] = {
		{"<bsdf type='conductor'>" TENFOLD("eta") NUMBER("k", "3") "</bsdf>",
		 "<bsdf type='conductor'>" NUMBER("eta", "6") NUMBER("k", "3") "</bsdf>"},
		{"<bsdf type='roughconductor'>" TENFOLD("k") NUMBER("eta", "0.2") "</bsdf>",
		 "<bsdf type='roughconductor'>" NUMBER("k", "6") NUMBER("eta", "0.2") "</bsdf>"},
		{"<bsdf type='phong'>" TENFOLD("exponent") "</bsdf>",
		 "<bsdf type='phong'>" NUMBER("exponent", "6") "</bsdf>"},
		{"<bsdf type='principledthin'>" NUMBER("spec_trans", "0.5") TENFOLD("eta") "</bsdf>",
		 "<bsdf type='principledthin'>" NUMBER("spec_trans", "0.5") NUMBER("eta", "6") "</bsdf>"},
		{"<bsdf type='coating'>" TENFOLD("sigma_a") "<bsdf type='diffuse'/></bsdf>",
		 "<bsdf type='coating'>" NUMBER("sigma_a", "6") "<bsdf type='diffuse'/></bsdf>"},
	};
	for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
		char text[4096];
		snprintf(text, sizeof text, SKY PLY("h3", "%s") PLY("h3", "%s"), of[i][0], of[i][1]);
		struct world *w = make_world(text);
		const struct bsdf *got = &w->bsdfs[w->shape_bindings[0].bsdf],
				  *want = &w->bsdfs[w->shape_bindings[1].bsdf];
		assert_true(got->color_kind == want->color_kind && got->is_textured);
		assert_true(fabs(got->min_alpha - want->min_alpha) <= 1e-6 * want->min_alpha ||
			    got->min_alpha == want->min_alpha);
		struct surface_point x;
		surface_on_triangle(&w->shapes[0], (struct prim_ref){0, 0, 0}, 0.2, 0.3, &x);
		struct bsdf_point p = world_bsdf_point(&x, &colour, TRANSPORT_RADIANCE);
		const vec3 wo = vec3_normalize((vec3){0.3, 0.1, 0.8}), wi = vec3_normalize((vec3){-0.2, 0.1, 0.7});
		spectrum a, b;
		if (got->has_delta) {
			vec3 mirrored;
			double chance;
			a = bsdf_eval_delta(got, &p, wo, BSDF_REFLECT, &mirrored, &chance);
			b = bsdf_eval_delta(want, &p, wo, BSDF_REFLECT, &mirrored, &chance);
			assert_true(a.v[0] > 0);
			assert_close(a, b, 1e-6);
		}
		a = got->ops->eval(got, &p, wo, wi);
		b = want->ops->eval(want, &p, wo, wi);
		assert_true(a.v[0] > 0 || !got->has_smooth);
		assert_close(a, b, 1e-6);
		world_free(w);
	}
	/* Attributes of these parameters are colours like those of other parameters. */
	struct world *w = make_world(
		SKY PLY("linear.ply",
			"<bsdf type='coating'>" FIELD("sigma_a", "vertex_color") "<bsdf type='diffuse'/></bsdf>"));
	assert_true(w->bsdfs[0].color_kind == COLOR_KIND_OTHER);
	world_free(w);
}

/* Files of version 0.6 interpret floats at vertices as sRGB, unless the shape says otherwise. */
static void test_vertexcolors_are_srgb_in_0_6(void **state)
{
	(void)state;
#define COLOURS "<bsdf type='diffuse'><texture type='vertexcolors' name='reflectance'/></bsdf>"
	struct world *w = make_world(SKY PLY("grid.ply", COLOURS)
					     PLY("grid.ply", COLOURS "<boolean name='srgb' value='false'/>"));
	for (uint32_t i = 0; i < 2; i++) {
		struct surface_point x;
		double rgb[3];
		surface_on_triangle(&w->shapes[i], (struct prim_ref){i, 0, 0}, 0, 0, &x);
		node_colour(0, 0, rgb);
		for (int k = 0; k < 3 && i == 0; k++)
			rgb[k] = pow((rgb[k] + 0.055) / 1.055, 2.4) * (rgb[k] > 0.04045);
		assert_close(diffuse_reflectance(w, &x), color_eval_rgb_reflectance(rgb, &colour), 1e-5);
	}
	world_free(w);
}

static void test_equal_attributes_are_shared(void **state)
{
	(void)state;
	float a[6] = {0, 0.5, 1, 0.25, 0, 0}, b[6], c[6] = {0, 0.5, 1, 0.25, 0, 0.125};
	memcpy(b, a, sizeof b);
	struct attribute of[3] = {{.name = "vertex_a", .channels = 3, .value = a},
				  {.name = "vertex_b", .channels = 3, .value = b},
				  {.name = "vertex_c", .channels = 3, .value = c}};
	struct arena arena = {0};
	static struct attribute_pool pool;
	struct attribute_table t = {.vertex_count = 2, .attributes = of, .count = 3, .pool = &pool};
	const struct attribute_values *first = attribute_values_intern(&t, &of[0], false, &arena);
	assert_true(first && t.probes_per_triangle && first->value != a && memcmp(first->value, a, sizeof a) == 0);
	assert_true(first->min == 0 && first->max == 1 && !first->is_grey);
	assert_ptr_equal(attribute_values_intern(&t, &of[1], false, &arena), first);
	assert_ptr_not_equal(attribute_values_intern(&t, &of[2], false, &arena), first);
	const struct attribute_values *decoded = attribute_values_intern(&t, &of[1], true, &arena);
	assert_true(decoded != first && decoded->value[2] == 1 && decoded->value[1] < 0.25F);
	of[1].channels = 1; /* same bytes, but two numbers fewer per vertex */
	assert_ptr_not_equal(attribute_values_intern(&t, &of[1], false, &arena), first);
	arena_fini(&arena);
}

static const char large_ply[] =
	"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float q\n"
	"property float r\nproperty float g\nproperty float b\nelement face 1\nproperty list uchar int vertex_indices\n"
	"end_header\n0 0 0 1.5e9 1.5e9 1 2\n1 0 0 3 3 4 5\n0 1 0 3 3 4 5\n3 0 1 2\n";

static void expect_refused(const char *body, const char *sentence)
{
	static char xml[TEXT_MAX];
	int n = snprintf(xml, sizeof xml, "<scene version='3.0.0'>" VIEW SKY "%s</scene>", body);
	const struct memory_file files[] = {{"s.xml", xml, (size_t)n},
					    {"grid.ply", grid, write_grid(grid, -1, false)},
					    {"large.ply", large_ply, strlen(large_ply)},
					    {"p0", pictures.file[0].bytes, pictures.file[0].size},
					    {NULL, NULL, 0}};
	struct asset_source assets = memory_assets(files);
	struct render_summary m;
	struct render_options o = {0};
	struct scene s;
	struct error e = {""};
	int rc = scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e);
	if (!rc) {
		rc = world_check(&s, &assets, &o, &m, &e);
		scene_fini(&s);
	}
	if (rc >= 0 || !strstr(e.text, sentence))
		fail_msg("%s\n gave: %s\n not: %s", body, e.text, sentence);
}

static void test_invalid_attributes_are_refused(void **state)
{
	(void)state;
#define DIFFUSE_OF(attribute) DIFFUSE(FIELD("reflectance", attribute))
	expect_refused(
		PLY("grid.ply", DIFFUSE_OF("vertex_colour")),
		"the mesh of grid.ply (s.xml:1) has no attribute `vertex_colour`, only vertex_color, vertex_pair, "
		"vertex_wild, face_heat; did you mean `vertex_color`?");
	expect_refused("<shape type='rectangle'>" DIFFUSE_OF("vertex_color") "</shape>",
		       "the rectangle in s.xml:1 has no attribute `vertex_color`, nor any other");
	expect_refused("<shape type='sphere'>" DIFFUSE_OF("face_heat") "</shape>",
		       "the sphere in s.xml:1 has no attribute `face_heat`");
	expect_refused("<shape type='cube'>" COLOURS "</shape>", "the cube in s.xml:1 has no attribute `vertex_color`");
	expect_refused(PLY("grid.ply", DIFFUSE_OF("color")), "needs a name that begins with `vertex_` or `face_`");
	expect_refused(PLY("grid.ply", DIFFUSE_OF("vertex_pair")),
		       "`vertex_pair` of the mesh of grid.ply (s.xml:1) has two channels");
	expect_refused(PLY("grid.ply", DIFFUSE_OF("vertex_wild")), "has a value that is not finite, or beyond 1e12");
	expect_refused(PLY("grid.ply", BITMAP("<string name='coordinates' value='face_heat'/>")),
		       "`face_heat` of the mesh of grid.ply (s.xml:1) is not two numbers at each vertex");
	expect_refused(
		PLY("grid.ply",
		    "<bsdf type='normalmap'><bsdf type='diffuse'/><texture type='bitmap'><string name='filename' "
		    "value='p0'/><string name='coordinates' value='vertex_pair'/></texture></bsdf>"),
		"a map of heights or normals cannot have `coordinates`");
	expect_refused(
		"<emitter type='projector'><texture type='bitmap' name='irradiance'><string name='filename' value='p0'/>"
		"<string name='coordinates' value='vertex_pair'/></texture></emitter>",
		"attributes are only available on a mesh");
	expect_refused(PLY("grid.ply", "<bsdf type='bumpmap'><bsdf type='diffuse'/>" FIELD("", "face_heat") "</bsdf>"),
		       "an attribute of a mesh cannot be a bump or normal map");
	expect_refused(
		PLY("grid.ply", FIELD("displacement", "face_heat") "<integer name='displacement_level' value='1'/>"),
		"an attribute of a mesh cannot displace a surface");
	expect_refused(PLY("large.ply", "<bsdf type='conductor'>" FIELD("eta", "vertex_q") "</bsdf>"),
		       "the attribute has numbers up to 1.5e+09: they must be within [0, 1e+09]");
	expect_refused(PLY("large.ply", "<bsdf type='conductor'>" FIELD("eta", "vertex_color") "</bsdf>"),
		       "the attribute has numbers up to 1.5e+09: they must be within [0, 1e+09]");
	expect_refused("<emitter type='projector'>" FIELD("irradiance", "face_heat") "</emitter>",
		       "attributes are only available on a mesh");
}

static int teardown(void **state)
{
	(void)state;
	pictures_fini(&pictures);
	return 0;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_attributes_follow_their_vertices),
		cmocka_unit_test(test_instances_have_the_attributes_of_their_mesh),
		cmocka_unit_test(test_attributes_match_a_picture),
		cmocka_unit_test(test_images_may_use_other_coordinates),
		cmocka_unit_test(test_face_attributes_match_separate_meshes),
		cmocka_unit_test(test_lights_follow_attributes),
		cmocka_unit_test(test_smallest_roughness_is_found),
		cmocka_unit_test(test_vertexcolors_are_srgb_in_0_6),
		cmocka_unit_test(test_equal_attributes_are_shared),
		cmocka_unit_test(test_invalid_attributes_are_refused),
		cmocka_unit_test(test_unbounded_parameters_may_exceed_one),
		cmocka_unit_test(test_colours_as_numbers_are_their_means),
	};
	return cmocka_run_group_tests(tests, NULL, teardown);
}
