/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Assets that are loaded once although a scene names them often: an image in many materials, against one material and
 * against as many files; the mesh of a shapegroup with many instances, against one instance and against copies. Seconds
 * are those of loading in this process. Memory is the peak of hslt-render for one sample per pixel, minus that for a
 * scene without image and mesh.
 */
#include "common/base/mem.h"
#include "tests/bench/bench.h"
#include "tests/bench/process.h"
#include "tests/bench/scenes.h"
#include "worker/cli/image/picture.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { IMAGE_SIDE = 2048, MATERIALS = 64, FILES = 2 };
enum { CELLS = 100, INSTANCES = 10000, COPIES = 32 };

struct scene_folder {
	const char *bin;
	char folder[64], log[80];
};

static FILE *write_scene_begin(const struct scene_folder *p, const char *name)
{
	char path[128];
	snprintf(path, sizeof path, "%s/%s", p->folder, name);
	FILE *f = fopen(path, "w");
	if (!f) {
		perror(path);
		exit(1);
	}
	fprintf(f, "<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/>\n");
	return f;
}

static void write_scene_end(FILE *f)
{
	fprintf(f, "</scene>\n");
	if (fclose(f)) {
		perror("bench: a scene cannot be written");
		exit(1);
	}
}

static void write_transform(FILE *f, int i)
{
	fprintf(f, "<transform name='to_world'><translate x='%d' y='%d' z='9'/></transform>", 3 * (i % 100),
		3 * (i / 100));
}

/* Writes MATERIALS rectangles with a material each, which use the images p0.png, p1.png, ... in turn; with images 0,
 * all of them share one material. */
static void write_textured(const struct scene_folder *p, const char *name, int images)
{
	FILE *f = write_scene_begin(p, name);
	static const char bsdf[] = "<bsdf type='diffuse' id='b%d'><texture type='bitmap' name='reflectance'><string "
				   "name='filename' value='p%d.png'/></texture></bsdf>\n";
	if (images == 0)
		fprintf(f, bsdf, 0, 0);
	for (int i = 0; i < MATERIALS; i++) {
		if (images > 0)
			fprintf(f, bsdf, i, i % images);
		fprintf(f, "<shape type='rectangle'>");
		write_transform(f, i);
		fprintf(f, "<ref id='b%d'/></shape>\n", images > 0 ? i : 0);
	}
	write_scene_end(f);
}

/* Writes gradients with noise, which cost as much to decode as a photograph. */
static void write_images(const struct scene_folder *p)
{
	unsigned char *rgb = bench_alloc((size_t)IMAGE_SIDE * IMAGE_SIDE, 3), *png;
	uint32_t noise = 1;
	size_t size;
	struct error e;
	for (size_t i = 0; i < (size_t)IMAGE_SIDE * IMAGE_SIDE * 3; i++) {
		noise = noise * 1664525 + 1013904223;
		rgb[i] = (unsigned char)(i / 3 % IMAGE_SIDE / 9 + (noise >> 28));
	}
	if (picture_encode_png(rgb, IMAGE_SIDE, IMAGE_SIDE, &png, &size, &e))
		bench_die(&e);
	for (int i = 0; i < FILES; i++) {
		char name[16];
		snprintf(name, sizeof name, "p%d.png", i);
		bench_write_file(p->folder, name, png, size);
	}
	mem_free(png);
	mem_free(rgb);
}

static void write_instances(const struct scene_folder *p, const char *name, int count)
{
	FILE *f = write_scene_begin(p, name);
	fprintf(f, "<shape type='shapegroup' id='g'><shape type='ply'><string name='filename' value='m.ply'/></shape>"
		   "</shape>\n");
	for (int i = 0; i < count; i++) {
		fprintf(f, "<shape type='instance'><ref id='g'/>");
		write_transform(f, i);
		fprintf(f, "</shape>\n");
	}
	write_scene_end(f);
}

static void write_copies(const struct scene_folder *p, const char *name, int count)
{
	FILE *f = write_scene_begin(p, name);
	for (int i = 0; i < count; i++) {
		fprintf(f, "<shape type='ply'><string name='filename' value='m.ply'/>");
		write_transform(f, i);
		fprintf(f, "</shape>\n");
	}
	write_scene_end(f);
}

static double load_seconds(const struct scene_folder *p, const char *name)
{
	struct asset_source assets = asset_source_for_folder(p->folder);
	double begin = bench_cpu_seconds();
	world_free(bench_world_from_assets(&assets, name, NULL));
	return bench_cpu_seconds() - begin;
}

static double peak_megabytes(const struct scene_folder *p, const char *name)
{
	struct process render;
	process_start(&render, p->bin, p->log,
		      "hslt-render %s/%s -o %s/out.exr --integrator path --spp 1 --size 64 --threads 1", p->folder,
		      name, p->folder);
	return 1e-6 * process_wait_peak(&render);
}

static void measure_shared_textures(const struct scene_folder *p, double empty)
{
	write_images(p);
	write_textured(p, "one.xml", 0);
	write_textured(p, "many.xml", 1);
	write_textured(p, "files.xml", FILES);
	struct series one = {0}, many = {0}, files = {0};
	for (int r = 0; r < 1 + BENCH_REPEATS; r++) {
		double base = load_seconds(p, "one.xml"), shared = load_seconds(p, "many.xml"),
		       different = load_seconds(p, "files.xml");
		if (r == 0)
			continue;
		series_add(&one, base);
		series_add(&many, shared / base);
		series_add(&files, different / base);
	}
	double memory = peak_megabytes(p, "one.xml") - empty;
	bench_row("a 2048x2048 PNG, one material", &one, "s", BENCH_NO_TARGET, 0);
	bench_row("... 64 materials that name it / one", &many, "", BENCH_AT_MOST, 1.1);
	bench_row("... 64 that name two such files / one", &files, "", BENCH_NO_TARGET, 0);
	bench_single("its memory, one material", memory, "MB", BENCH_NO_TARGET, 0);
	bench_single("... 64 materials that name it / one", (peak_megabytes(p, "many.xml") - empty) / memory, "",
		     BENCH_AT_MOST, 1.1);
	bench_single("... 64 that name two such files / one", (peak_megabytes(p, "files.xml") - empty) / memory, "",
		     BENCH_NO_TARGET, 0);
}

static void measure_shared_instances(const struct scene_folder *p, double empty)
{
	struct bench_file ply = bench_make_wavy_ply(CELLS);
	bench_write_file(p->folder, "m.ply", ply.bytes, ply.size);
	mem_free(ply.bytes);
	write_instances(p, "instance.xml", 1);
	write_instances(p, "instances.xml", INSTANCES);
	write_copies(p, "copies.xml", COPIES);
	struct series single = {0}, many = {0}, share = {0};
	for (int r = 0; r < 1 + BENCH_REPEATS; r++) {
		double one = load_seconds(p, "instance.xml"), all = load_seconds(p, "instances.xml"),
		       copies = load_seconds(p, "copies.xml");
		if (r == 0)
			continue;
		series_add(&single, one);
		series_add(&many, all);
		series_add(&share, (all - one) / (INSTANCES - 1) / ((copies - one) / (COPIES - 1)));
	}
	double one = peak_megabytes(p, "instance.xml") - empty, all = peak_megabytes(p, "instances.xml") - empty,
	       copies = peak_megabytes(p, "copies.xml") - empty;
	bench_row("a mesh of 20,000 triangles, one instance", &single, "s", BENCH_NO_TARGET, 0);
	bench_row("... 10,000 instances", &many, "s", BENCH_NO_TARGET, 0);
	bench_row("time of an instance / of a copy (of 32)", &share, "", BENCH_AT_MOST, 0.01);
	bench_single("memory, one instance", one, "MB", BENCH_NO_TARGET, 0);
	bench_single("... 10,000 instances", all, "MB", BENCH_NO_TARGET, 0);
	bench_single("memory of an instance / of a copy (of 32)",
		     (all - one) / (INSTANCES - 1) / ((copies - one) / (COPIES - 1)), "", BENCH_AT_MOST, 0.01);
}

void bench_sharing(const char *bin)
{
	struct scene_folder p = {.bin = bin, .folder = "/tmp/hslt-bench.XXXXXX"};
	bench_group("sharing", "what a scene names often is loaded once");
	if (!process_program_exists(bin, "hslt-render")) {
		bench_skip("hslt-render is not built");
		return;
	}
	process_make_folder(p.folder);
	snprintf(p.log, sizeof p.log, "%s/log", p.folder);
	FILE *f = write_scene_begin(&p, "empty.xml");
	fprintf(f, "<shape type='rectangle'/>\n");
	write_scene_end(f);
	double empty = peak_megabytes(&p, "empty.xml");
	measure_shared_textures(&p, empty);
	measure_shared_instances(&p, empty);
	process_remove_folder(p.folder);
}
