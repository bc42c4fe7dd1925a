/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Valid files, damaged at random (fixed seed): the readers return either a consistent result or an error with a
 * message. Under the sanitizers this is a small fuzzer; tests/fuzz has the large ones.
 */
#include "tests/support/memory_assets.h"
#include "tests/support/sample_images.h"
#include "tests/support/scene_tables.h"
#include "worker/render/math/rng.h"
#include "tests/support/image_read.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { VARIANTS = 3000, FILE_BYTES_MAX = 8192 };

static size_t index_below(double u, size_t n)
{
	return (size_t)(u * (double)n);
}

/* Writes a damaged copy with one to four changes: a bit flipped, a byte replaced, a range removed or repeated, the
 * end cut off. */
static size_t damage_copy(unsigned char *out, const unsigned char *in, size_t size, uint64_t index)
{
	memcpy(out, in, size);
	double u[4];
	rng_uniform4(0x6d757461, RNG_TEST, index, 0, 0, u);
	uint64_t steps = 1 + index_below(u[0], 4);
	for (uint64_t s = 0; s < steps && size > 0; s++) {
		rng_uniform4(0x6d757461, RNG_TEST, index, 1 + s, 0, u);
		size_t at = index_below(u[1], size), n = 1 + index_below(u[2] * u[2], size - at);
		switch (index_below(u[0], 5)) {
		case 0:
			out[at] ^= (unsigned char)(1 << index_below(u[3], 8));
			break;
		case 1:
			out[at] = (unsigned char)index_below(u[3], 256);
			break;
		case 2:
			memmove(out + at, out + at + n, size - at - n);
			size -= n;
			break;
		case 3:
			if (size + n > FILE_BYTES_MAX)
				break;
			memmove(out + at + n, out + at, size - at);
			size += n;
			break;
		default:
			size = u[3] < 0.2 ? at : size;
			break;
		}
	}
	return size;
}

static void check_geometry(const struct shape_geometry *g)
{
	const struct mesh *m = &g->mesh;
	assert_true(g->kind == SHAPE_MESH || g->sphere.radius > 0);
	for (uint32_t i = 0; i < m->triangle_count; i++)
		for (int k = 0; k < 3; k++)
			assert_true(m->index[i][k] < m->vertex_count);
	for (uint32_t i = 0; i < m->vertex_count; i++)
		for (int k = 0; k < 3; k++)
			assert_true(isfinite(m->position[i][k]) && (!m->normal || isfinite(m->normal[i][k])));
}

/* Returns the number of variants that were read as a scene with all its shapes and settings. */
static int is_read_in_full(const struct memory_file *files)
{
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e = {""};
	struct arena arena = {.limit = 64 << 20};
	if (scene_read(&s, &assets, "s.xml", scene_tables(), NULL, 0, &e)) {
		assert_true(e.text[0]);
		return 0;
	}
	struct scene_settings set;
	int good = scene_settings_read(&s, 0, 0, 1, &set, &e) == 0;
	for (uint32_t i = 0; i < s.object_count; i++) {
		struct shape_geometry g;
		uint64_t dropped;
		if (s.objects[i]->cls != PLUGIN_SHAPE)
			continue;
		if (shape_build(s.objects[i], &assets, &arena, &g, &dropped, &e) == 0)
			check_geometry(&g);
		else
			good = 0;
	}
	arena_fini(&arena);
	scene_fini(&s);
	return good;
}

static const char valid_scene[] =
	"<?xml version='1.0' encoding='utf-8'?>\n<scene version='0.6.0'><default name='x' value='0.5'/><mode/>"
	"<sensor type='perspective'><float name='fov' value='40'/><transform name='toWorld'><lookat origin='0,0,5' target='0 0 0' "
	"up='0 1 0'/></transform><film type='ldrfilm'><integer name='width' value='64'/><rfilter type='tent'/></film></sensor>"
	"<texture type='bitmap' id='t'><string name='filename' value='m.obj'/></texture><alias id='t' as='k'/>"
	"<bsdf type='twosided' id='m'><bsdf type='phong'><ref name='diffuseReflectance' id='k'/></bsdf></bsdf>"
	"<bsdf type='roughconductor'><float name='alpha' value='$x'/><spectrum name='eta' value='400:1, 500:2'/>"
	"<srgb name='k' value='#ff8800'/></bsdf>"
	"<shape type='obj'><string name='filename' value='m.obj'/><transform name='toWorld'><rotate x='1' angle='90'/>"
	"<scale x='2' y='1' z='-1'/><matrix value='1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1'/></transform><ref id='m'/></shape>"
	"<shape type='sphere'><point name='center' x='1' y='0' z='0'/><emitter type='area'><rgb name='radiance' value='1 2 3'/>"
	"</emitter></shape></scene>";

static const char valid_mesh[] =
	"# cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1e0\nvt 0 0\nvt 1 0\nvt 1 1 0\nvn 0 0 1\nvn 0 3 4\n"
	"g one\nusemtl two\nf 1/1/1 2/2/1 3/3/1 4/1/1\nf -1//2 1//1 \\\n2//2\nf 1 5 4\n";

static void test_damaged_scenes_are_read_or_refused(void **state)
{
	(void)state;
	static unsigned char bytes[FILE_BYTES_MAX];
	int good = 0;
	for (uint64_t i = 0; i < VARIANTS; i++) {
		size_t n = damage_copy(bytes, (const unsigned char *)valid_scene, sizeof valid_scene - 1, i);
		const struct memory_file files[] = {
			{"s.xml", bytes, n}, {"m.obj", valid_mesh, sizeof valid_mesh - 1}, {0}};
		good += is_read_in_full(files);
	}
	assert_true(good > 0 && good < VARIANTS / 2); /* the damage is neither harmless nor always fatal */
}

static void test_damaged_meshes_are_read_or_refused(void **state)
{
	(void)state;
	static unsigned char bytes[FILE_BYTES_MAX];
	int good = 0;
	for (uint64_t i = 0; i < VARIANTS; i++) {
		size_t n = damage_copy(bytes, (const unsigned char *)valid_mesh, sizeof valid_mesh - 1, i);
		const struct memory_file files[] = {
			{"s.xml", valid_scene, sizeof valid_scene - 1}, {"m.obj", bytes, n}, {0}};
		good += is_read_in_full(files);
	}
	assert_true(good > 0 && good < VARIANTS);
}

static void read_damaged_images(const unsigned char *file, size_t size)
{
	static unsigned char bytes[FILE_BYTES_MAX];
	assert_true(size <= FILE_BYTES_MAX);
	for (uint64_t i = 0; i < VARIANTS; i++) {
		size_t n = damage_copy(bytes, file, size, i);
		const struct memory_file files[] = {{"i", bytes, n}, {0}};
		struct asset_source assets = memory_assets(files);
		struct arena arena = {.limit = 64 << 20};
		struct image img;
		struct error e = {""};
		if (image_read(&assets, "i", false, &arena, &img, &e))
			assert_true(e.text[0]);
		else
			for (size_t k = 0; k < (size_t)img.width * img.height * img.channels; k++)
				assert_true(isfinite(img.pixels[k]));
		arena_fini(&arena);
	}
}

static void test_damaged_images_are_read_or_refused(void **state)
{
	(void)state;
	static const unsigned char orange[] = {220, 130, 40};
	static const unsigned char hdr[] =
		"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n\2\2\0\10\210\200\203\1\5\2\3\4\5\6\210"
		"\7\210\210\2\2\0\10\210\200\203\1\5\2\3\4\5\6\210\7\210\210";
	size_t size;
	unsigned char *file = sample_png(5, 4, SAMPLE_RGBA, 8, 1, &size);
	read_damaged_images(file, size);
	free(file);
	file = sample_png(5, 4, SAMPLE_PALETTE, 8, 0, &size);
	read_damaged_images(file, size);
	free(file);
	for (int progressive = 0; progressive < 2; progressive++) {
		file = sample_jpeg(17, 9, orange, 3, progressive, &size);
		read_damaged_images(file, size);
		free(file);
	}
	read_damaged_images(hdr, sizeof hdr - 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_damaged_scenes_are_read_or_refused),
		cmocka_unit_test(test_damaged_meshes_are_read_or_refused),
		cmocka_unit_test(test_damaged_images_are_read_or_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
