/* SPDX-License-Identifier: Apache-2.0 */
/* A height field is compared with the same mesh written as OBJ, and its normals with those of the function that it
 * samples. */
#include "tests/support/built_shape.h"
#include "tests/support/pictures.h"
#include "tests/support/sample_images.h"
#include "worker/render/render.h"
#include "worker/render/shape/shape.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 9, HEIGHT = 5 };

static const void *height_picture;
static size_t picture_size;
static char mesh_text[1 << 16];

/* Builds a shape of 0.6; its files are a.hdr and m.obj. */
static struct built_shape build(const char *type, const char *content)
{
	char xml[2048];
	snprintf(xml, sizeof xml, "<scene version='0.6.0'>\n<shape type='%s'>%s</shape></scene>", type, content);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)},
					    {"a.hdr", height_picture, picture_size},
					    {"m.obj", mesh_text, strlen(mesh_text)},
					    {0}};
	return built_shape_make(files, render_plugins());
}

static struct built_shape build_ok(const char *type, const char *content)
{
	struct built_shape b = build(type, content);
	if (b.result)
		fail_msg("%s", b.error.text);
	return b;
}

#define FILENAME "<string name='filename' value='a.hdr'/>"
#define PLACE \
	"<transform name='toWorld'><rotate x='1' angle='-90'/><scale x='3' y='2' z='0.5'/><translate x='7'/></transform>"

static double height(uint32_t x, uint32_t y)
{
	return (double)((x * 5 + y * 3) % 8) / 8;
}

static void encode_picture(struct pictures *p, uint32_t width, uint32_t height_, double (*f)(uint32_t x, uint32_t y))
{
	double *rgb = calloc((size_t)width * height_ * 3, sizeof *rgb);
	assert_non_null(rgb);
	for (uint32_t y = 0; y < height_; y++)
		for (uint32_t x = 0; x < width; x++)
			for (int k = 0; k < 3; k++)
				rgb[3 * (y * width + x) + (uint32_t)k] = f(x, y);
	pictures_add(p, width, height_, rgb);
	free(rgb);
	height_picture = p->file[p->count - 1].bytes;
	picture_size = p->file[p->count - 1].size;
}

/* Writes the mesh: rows of the picture from y = -1 on, with quads cut from (x, y) to (x + 1, y + 1). */
static void write_obj(double scale)
{
	size_t n = 0;
	for (int y = 0; y < HEIGHT; y++)
		for (int x = 0; x < WIDTH; x++)
			n += (size_t)snprintf(mesh_text + n, sizeof mesh_text - n,
					      "v %.17g %.17g %.17g\nvt %.17g %.17g\n", -1 + 2.0 * x / (WIDTH - 1),
					      -1 + 2.0 * y / (HEIGHT - 1), scale * height((uint32_t)x, (uint32_t)y),
					      1.0 * x / (WIDTH - 1), 1.0 * y / (HEIGHT - 1));
	for (int y = 0; y + 1 < HEIGHT; y++)
		for (int x = 0; x + 1 < WIDTH; x++) {
			int a = y * WIDTH + x + 1, b = a + 1, c = a + WIDTH, d = c + 1;
			n += (size_t)snprintf(mesh_text + n, sizeof mesh_text - n,
					      "f %d/%d %d/%d %d/%d\nf %d/%d %d/%d %d/%d\n", c, c, a, a, d, d, d, d, a,
					      a, b, b);
		}
}

static void test_heightfield_equals_its_mesh(void **state)
{
	(void)state;
	struct pictures p = {0};
	encode_picture(&p, WIDTH, HEIGHT, height);
	write_obj(-1.5);
	struct built_shape field = build_ok("heightfield",
					    FILENAME PLACE "<float name='scale' value='-1.5'/>"
							   "<boolean name='shadingNormals' value='false'/>"),
			   mesh = build_ok("obj", "<string name='filename' value='m.obj'/>" PLACE
						  "<boolean name='faceNormals' value='true'/>"
						  "<boolean name='flipTexCoords' value='false'/>");
	const struct mesh *a = &field.geometry.mesh, *b = &mesh.geometry.mesh;
	assert_int_equal(a->triangle_count, 2 * (WIDTH - 1) * (HEIGHT - 1));
	assert_int_equal(b->triangle_count, a->triangle_count);
	assert_true(!a->normal && !b->normal && a->uv && b->uv);
	for (uint32_t i = 0; i < a->triangle_count; i++)
		for (int k = 0; k < 3; k++) {
			uint32_t v = a->index[i][k], w = b->index[i][k];
			for (int c = 0; c < 3; c++)
				assert_true(fabs(a->position[v][c] - b->position[w][c]) < 1e-6);
			for (int c = 0; c < 2; c++)
				assert_true(fabs(a->uv[v][c] - b->uv[w][c]) < 1e-12);
		}
	built_shape_fini(&field);
	built_shape_fini(&mesh);
	pictures_fini(&p);
}

static double slope_height(uint32_t x, uint32_t y)
{
	return x / 8.0 + y / 16.0;
}

static double bowl_height(uint32_t x, uint32_t y)
{
	double a = (double)x - 8, b = (double)y - 8;
	return (a * a + b * b) / 64;
}

/* The normals of a plane are exact, also at the borders; those of a bowl up to the square of a pixel's width. */
static void test_normals_follow_the_heights(void **state)
{
	(void)state;
	struct pictures p = {0};
	encode_picture(&p, WIDTH, HEIGHT, slope_height);
	struct built_shape b = build_ok("heightfield", FILENAME "<float name='scale' value='2'/>");
	assert_non_null(b.geometry.mesh.normal);
	/* z = 2 (4 (x + 1) / 8 + 2 (y + 1) / 16) = x + y / 4 + ... */
	double length = sqrt(1 + 1.0 / 16 + 1);
	for (uint32_t i = 0; i < b.geometry.mesh.vertex_count; i++) {
		const double *n = b.geometry.mesh.normal[i];
		assert_true(fabs(n[0] + 1 / length) < 1e-6 && fabs(n[1] + 0.25 / length) < 1e-6);
	}
	built_shape_fini(&b);
	encode_picture(&p, 17, 17, bowl_height);
	b = build_ok("heightfield", FILENAME "<boolean name='flipNormals' value='true'/>");
	for (uint32_t i = 0; i < b.geometry.mesh.vertex_count; i++) {
		const double *q = b.geometry.mesh.position[i], *n = b.geometry.mesh.normal[i];
		if (fabs(q[0]) > 0.9 || fabs(q[1]) > 0.9)
			continue;
		/* z = x^2 + y^2 */
		double l = sqrt(4 * q[0] * q[0] + 4 * q[1] * q[1] + 1), dx = n[0] - 2 * q[0] / l,
		       dy = n[1] - 2 * q[1] / l;
		if (!(fabs(dx) < 0.25 / 64 && fabs(dy) < 0.25 / 64 && n[2] < 0))
			fail_msg("at %g %g the normal is off by %g %g", q[0], q[1], dx, dy);
	}
	built_shape_fini(&b);
	pictures_fini(&p);
}

/* The texture of the picture determines whether numbers are used as stored, or decoded like colours. */
static void test_texture_decides_how_pixels_are_decoded(void **state)
{
	(void)state;
	unsigned char *png = sample_png(4, 3, SAMPLE_RGB, 8, 0, &picture_size);
	height_picture = png;
	static const char *const ways[] = {
		FILENAME,
		"<texture type='bitmap'>" FILENAME "</texture>",
		"<texture type='bitmap'>" FILENAME "<float name='gamma' value='1'/></texture>",
		"<texture type='bitmap'>" FILENAME "<string name='channel' value='g'/><float name='gamma' value='1'/>"
		"</texture>",
		"<texture type='bitmap'>" FILENAME "<float name='gamma' value='2'/></texture>",
	};
	for (int i = 0; i < 5; i++) {
		struct built_shape b = build_ok("heightfield", ways[i]);
		double rgb[3];
		for (int k = 0; k < 3; k++) {
			double x = sample_value(2, 1, k) / 255.0;
			rgb[k] = i == 4 ? x * x : i >= 2 ? x : x <= 0.04045 ? x / 12.92 : pow((x + 0.055) / 1.055, 2.4);
		}
		double wanted = i == 3 ? rgb[1] : 0.212671 * rgb[0] + 0.71516 * rgb[1] + 0.072169 * rgb[2];
		double z = b.geometry.mesh.position[1 * 4 + 2][2];
		if (!(fabs(z - wanted) < 1e-6))
			fail_msg("way %d: a height of %g, not %g", i, z, wanted);
		built_shape_fini(&b);
	}
	free(png);
}

/* As in the documentation of Mitsuba 0.6, a bitmap inside `scale`, here nested in another one. */
static void test_scale_textures_scale_the_heights(void **state)
{
	(void)state;
	struct pictures p = {0};
	encode_picture(&p, WIDTH, HEIGHT, height);
	struct built_shape
		a = build_ok("heightfield", FILENAME "<float name='scale' value='-0.75'/>"),
		b = build_ok("heightfield",
			     "<float name='scale' value='3'/><texture type='scale'><float name='scale' value='-0.5'/>"
			     "<texture type='scale'><float name='scale' value='0.5'/>"
			     "<texture type='bitmap'>" FILENAME "</texture></texture></texture>");
	assert_int_equal(a.geometry.mesh.vertex_count, b.geometry.mesh.vertex_count);
	for (uint32_t i = 0; i < a.geometry.mesh.vertex_count; i++)
		assert_memory_equal(a.geometry.mesh.position[i], b.geometry.mesh.position[i],
				    sizeof a.geometry.mesh.position[i]);
	assert_true(fabs(a.geometry.mesh.position[1][2] - -0.75 * height(1, 0)) < 1e-5);
	built_shape_fini(&a);
	built_shape_fini(&b);
	pictures_fini(&p);
}

static void expect_refused(const char *content, const char *sentence)
{
	struct built_shape b = build("heightfield", content);
	if (b.result >= 0 || !strstr(b.error.text, sentence))
		fail_msg("%s\n gave %d: %s", content, b.result, b.error.text);
	built_shape_fini(&b);
}

/* The bitmap may have any name, and be defined elsewhere. */
static void test_bitmap_may_be_named_or_referenced(void **state)
{
	(void)state;
#define ELSEWHERE(inside) "</shape><texture id='t' type='bitmap'>" FILENAME "</texture>" inside "<shape type='sphere'>"
	static const char *const ways[] = {
		"<texture type='bitmap' name='heights'>" FILENAME "</texture>",
		"<ref id='t'/>" ELSEWHERE(""),
		"<ref id='t' name='texture'/>" ELSEWHERE(""),
		"<ref id='s'/>" ELSEWHERE("<texture id='s' type='scale'><ref id='t' name='x'/></texture>"),
		"<ref id='t'/><bsdf type='diffuse'><ref id='t' name='reflectance'/></bsdf>" ELSEWHERE(""),
	};
	struct pictures p = {0};
	encode_picture(&p, WIDTH, HEIGHT, height);
	struct built_shape wanted = build_ok("heightfield", FILENAME);
	for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
		struct built_shape b = build_ok("heightfield", ways[i]);
		assert_int_equal(b.geometry.mesh.vertex_count, wanted.geometry.mesh.vertex_count);
		for (uint32_t k = 0; k < b.geometry.mesh.vertex_count; k++)
			assert_memory_equal(b.geometry.mesh.position[k], wanted.geometry.mesh.position[k],
					    sizeof b.geometry.mesh.position[k]);
		built_shape_fini(&b);
	}
	built_shape_fini(&wanted);
	pictures_fini(&p);
}

static void test_invalid_heightfields_are_refused(void **state)
{
	(void)state;
	struct pictures p = {0};
	encode_picture(&p, 1, 5, height);
	expect_refused("", "s.xml:2: <shape type=\"heightfield\">: needs either a filename or a bitmap inside");
	expect_refused(FILENAME "<texture type='bitmap'>" FILENAME "</texture>", "needs either a filename or a bitmap");
	expect_refused("<texture type='checkerboard'/>", "the heights of a heightfield come from a bitmap");
	expect_refused("<texture type='scale'><rgb name='scale' value='1 2 3'/><texture type='bitmap'>" FILENAME
		       "</texture></texture>",
		       "<texture type=\"scale\">: the heights of a heightfield come from a bitmap");
	expect_refused("<texture type='scale'/>", "needs either a filename or a bitmap inside");
	expect_refused(FILENAME, "an image of 1 x 5 pixels is too small; heights need 2 x 2");
	expect_refused("<string name='filename' value='m.obj'/>", "m.obj");
	expect_refused("<string name='filename' value='none.png'/>", "none.png: no such file");
	pictures_fini(&p);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_heightfield_equals_its_mesh),
					   cmocka_unit_test(test_normals_follow_the_heights),
					   cmocka_unit_test(test_texture_decides_how_pixels_are_decoded),
					   cmocka_unit_test(test_scale_textures_scale_the_heights),
					   cmocka_unit_test(test_bitmap_may_be_named_or_referenced),
					   cmocka_unit_test(test_invalid_heightfields_are_refused)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
