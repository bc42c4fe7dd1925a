/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What it costs to load a scene: a binary PLY of a million triangles against reading its bytes and building Embree's
 * structure, and many small shapes against half as many.
 */
#include "common/base/bytes.h"
#include "common/base/mem.h"
#include "tests/bench/bench.h"
#include "tests/bench/scenes.h"
#include "tests/bench/subject.h"
#include "tests/support/memory_assets.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { CELLS = 708, SIDE = CELLS + 1, VERTEX_FLOATS = 8, FACE_BYTES = 1 + 3 * 4, HEADER_MAX = 512 };
enum { FEW = 5000, MANY = 10000, SHAPE_MAX = 160 };

struct file {
	unsigned char *bytes;
	size_t size;
};

static struct file room(size_t bytes)
{
	return (struct file){bench_alloc(bytes, 1), 0};
}

static void put_face(struct file *f, uint32_t a, uint32_t b, uint32_t c)
{
	const uint32_t corner[3] = {a, b, c};
	f->bytes[f->size++] = 3;
	for (int k = 0; k < 3; k++, f->size += 4)
		put32(f->bytes + f->size, corner[k]);
}

/* A wavy square with normals and texture coordinates, as exporters write them. */
static struct file make_ply(void)
{
	size_t vertices = (size_t)SIDE * SIDE, faces = 2 * (size_t)CELLS * CELLS;
	struct file f = room(HEADER_MAX + vertices * VERTEX_FLOATS * 4 + faces * FACE_BYTES);
	f.size = (size_t)snprintf((char *)f.bytes, HEADER_MAX,
				  "ply\nformat binary_little_endian 1.0\nelement vertex %zu\n"
				  "property float x\nproperty float y\nproperty float z\n"
				  "property float nx\nproperty float ny\nproperty float nz\n"
				  "property float u\nproperty float v\nelement face %zu\n"
				  "property list uchar int vertex_indices\nend_header\n",
				  vertices, faces);
	for (int i = 0; i < SIDE * SIDE; i++) {
		double u = (double)(i % SIDE) / CELLS, v = (double)(i / SIDE) / CELLS;
		const double vertex[VERTEX_FLOATS] = {2 * u - 1, 2 * v - 1, 0.05 * sin(40 * u) * sin(40 * v), 0, 0, 1,
						      u,	 v};
		for (int k = 0; k < VERTEX_FLOATS; k++, f.size += 4)
			put_float(f.bytes + f.size, (float)vertex[k]);
	}
	for (uint32_t j = 0; j < CELLS; j++)
		for (uint32_t i = 0; i < CELLS; i++) {
			uint32_t a = j * SIDE + i;
			put_face(&f, a, a + 1, a + SIDE + 1);
			put_face(&f, a, a + SIDE + 1, a + SIDE);
		}
	return f;
}

/* Cubes and spheres side by side. */
static struct file make_small(unsigned count)
{
	struct file f = room((size_t)(count + 2) * SHAPE_MAX);
	char *text = (char *)f.bytes;
	f.size = (size_t)snprintf(text, SHAPE_MAX, "<scene version='3.0.0'><sensor type='perspective'/>");
	for (unsigned i = 0; i < count; i++)
		f.size += (size_t)snprintf(text + f.size, SHAPE_MAX,
					   "<shape type='%s'><transform name='to_world'><scale value='0.3'/>"
					   "<translate x='%u' y='%u' z='9'/></transform></shape>",
					   i % 2 ? "sphere" : "cube", i % 100, i / 100);
	f.size += (size_t)snprintf(text + f.size, SHAPE_MAX, "</scene>");
	return f;
}

static double load_seconds(const struct memory_file *files, struct world **out)
{
	struct asset_source assets = memory_assets(files);
	double begin = bench_cpu_seconds();
	*out = bench_world_of(&assets, files[0].name, NULL);
	return bench_cpu_seconds() - begin;
}

/* From a file that the system has in memory. */
static double read_seconds(FILE *from, struct file *into, size_t size)
{
	struct error e;
	rewind(from);
	double begin = bench_cpu_seconds();
	into->size = fread(into->bytes, 1, size, from);
	double seconds = bench_cpu_seconds() - begin;
	if (into->size != size) {
		error_set(&e, EIO, "the temporary file cannot be read");
		bench_die(&e);
	}
	return seconds;
}

static void time_mesh(void)
{
	static const char xml[] =
		"<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/><shape type='ply'>"
		"<string name='filename' value='m.ply'/></shape></scene>";
	struct file ply = make_ply(), copy = room(ply.size);
	FILE *f = tmpfile();
	if (!f || fwrite(ply.bytes, 1, ply.size, f) != ply.size) {
		bench_skip("a temporary file cannot be written");
	} else {
		const struct memory_file files[] = {
			{"s.xml", xml, sizeof xml - 1}, {"m.ply", copy.bytes, ply.size}, {NULL, NULL, 0}};
		struct series all = {0}, least = {0}, ratio = {0};
		for (int r = 0; r < 2 + BENCH_REPEATS; r++) {
			struct world *w;
			double reading = read_seconds(f, &copy, ply.size), loading = reading + load_seconds(files, &w),
			       needed = reading + subject_build_raw(w);
			world_free(w);
			if (r < 2)
				continue;
			series_add(&all, loading);
			series_add(&least, needed);
			series_add(&ratio, loading / needed);
		}
		bench_row("a million triangles, binary PLY", &all, "s", BENCH_INFORMS, 0);
		bench_row("reading the bytes, and Embree's structure", &least, "s", BENCH_INFORMS, 0);
		bench_row("ratio", &ratio, "", BENCH_AT_MOST, 3);
	}
	if (f)
		fclose(f);
	mem_free(ply.bytes);
	mem_free(copy.bytes);
}

static double small_seconds(const struct file *xml)
{
	const struct memory_file files[] = {{"s.xml", xml->bytes, xml->size}, {NULL, NULL, 0}};
	struct world *w;
	double seconds = load_seconds(files, &w);
	world_free(w);
	return seconds;
}

static void time_small(void)
{
	struct file few = make_small(FEW), many = make_small(MANY);
	struct series all = {0}, ratio = {0};
	for (int r = 0; r < 2 + BENCH_REPEATS; r++) {
		double half = small_seconds(&few), whole = small_seconds(&many);
		if (r < 2)
			continue;
		series_add(&all, whole);
		series_add(&ratio, whole / half);
	}
	bench_row("10,000 cubes and spheres", &all, "s", BENCH_INFORMS, 0);
	bench_row("... against 5,000 (quadratic: 4)", &ratio, "", BENCH_AT_MOST, 2.5);
	mem_free(few.bytes);
	mem_free(many.bytes);
}

void bench_loading(const char *bin)
{
	(void)bin;
	bench_group("loading", "reading a scene until it can be rendered");
	time_mesh();
	time_small();
}
