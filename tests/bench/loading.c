/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The cost of loading a scene: a binary PLY of a million triangles against reading its bytes and building Embree's
 * structure, and many small shapes against half as many.
 */
#include "common/base/mem.h"
#include "tests/bench/bench.h"
#include "tests/bench/scenes.h"
#include "tests/bench/subject.h"
#include "tests/support/memory_assets.h"

#include <stdio.h>

enum { CELLS = 708 };
enum { FEW = 5000, MANY = 10000, SHAPE_BYTES_MAX = 160 };

/* Makes cubes and spheres side by side. */
static struct bench_file make_small_shapes(unsigned count)
{
	struct bench_file f = {bench_alloc((size_t)(count + 2) * SHAPE_BYTES_MAX, 1), 0};
	char *text = (char *)f.bytes;
	f.size = (size_t)snprintf(text, SHAPE_BYTES_MAX, "<scene version='3.0.0'><sensor type='perspective'/>");
	for (unsigned i = 0; i < count; i++)
		f.size += (size_t)snprintf(text + f.size, SHAPE_BYTES_MAX,
					   "<shape type='%s'><transform name='to_world'><scale value='0.3'/>"
					   "<translate x='%u' y='%u' z='9'/></transform></shape>",
					   i % 2 ? "sphere" : "cube", i % 100, i / 100);
	f.size += (size_t)snprintf(text + f.size, SHAPE_BYTES_MAX, "</scene>");
	return f;
}

static double load_seconds(const struct memory_file *files, struct world **out)
{
	struct asset_source assets = memory_assets(files);
	double begin = bench_cpu_seconds();
	*out = bench_world_from_assets(&assets, files[0].name, NULL);
	return bench_cpu_seconds() - begin;
}

/* Returns the seconds of reading a file from the system's page cache. */
static double read_seconds(FILE *from, struct bench_file *into, size_t size)
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
	struct bench_file ply = bench_make_wavy_ply(CELLS), copy = {bench_alloc(ply.size, 1), 0};
	FILE *f = tmpfile();
	if (!f || fwrite(ply.bytes, 1, ply.size, f) != ply.size) {
		bench_skip("a temporary file cannot be written");
	} else {
		const struct memory_file files[] = {
			{"s.xml", xml, sizeof xml - 1}, {"m.ply", copy.bytes, ply.size}, {NULL, NULL, 0}};
		struct series total = {0}, baseline = {0}, ratio = {0};
		for (int r = 0; r < 2 + BENCH_REPEATS; r++) {
			struct world *w;
			double reading = read_seconds(f, &copy, ply.size), loading = reading + load_seconds(files, &w),
			       needed = reading + subject_build_embree(w);
			world_free(w);
			if (r < 2)
				continue;
			series_add(&total, loading);
			series_add(&baseline, needed);
			series_add(&ratio, loading / needed);
		}
		bench_row("a million triangles, binary PLY", &total, "s", BENCH_NO_TARGET, 0);
		bench_row("reading the bytes, and Embree's structure", &baseline, "s", BENCH_NO_TARGET, 0);
		bench_row("ratio", &ratio, "", BENCH_AT_MOST, 3);
	}
	if (f)
		fclose(f);
	mem_free(ply.bytes);
	mem_free(copy.bytes);
}

static double load_small_seconds(const struct bench_file *xml)
{
	const struct memory_file files[] = {{"s.xml", xml->bytes, xml->size}, {NULL, NULL, 0}};
	struct world *w;
	double seconds = load_seconds(files, &w);
	world_free(w);
	return seconds;
}

static void time_small_shapes(void)
{
	struct bench_file few = make_small_shapes(FEW), many = make_small_shapes(MANY);
	struct series total = {0}, ratio = {0};
	for (int r = 0; r < 2 + BENCH_REPEATS; r++) {
		double half = load_small_seconds(&few), whole = load_small_seconds(&many);
		if (r < 2)
			continue;
		series_add(&total, whole);
		series_add(&ratio, whole / half);
	}
	bench_row("10,000 cubes and spheres", &total, "s", BENCH_NO_TARGET, 0);
	bench_row("... against 5,000 (quadratic: 4)", &ratio, "", BENCH_AT_MOST, 2.5);
	mem_free(few.bytes);
	mem_free(many.bytes);
}

void bench_loading(const char *bin)
{
	(void)bin;
	bench_group("loading", "reading a scene until it can be rendered");
	time_mesh();
	time_small_shapes();
}
