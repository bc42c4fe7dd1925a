/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scenes of the benchmarks: meshes are made in memory, as OBJ or PLY files, and read from there or written into a
 * folder; the others are files of the project, or of the folder that HSLT_SCENES names. Any failure ends the bench.
 */
#include "worker/render/render.h"
#include "tests/bench/scenes.h"

#include "common/base/bytes.h"
#include "common/base/mem.h"
#include "tests/bench/bench.h"
#include "tests/support/memory_assets.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FLOOR_CELLS = 500, BALL_CELLS = 500, LINE_BYTES_MAX = 96 };
enum { VERTEX_FLOATS = 8, FACE_BYTES = 1 + 3 * 4, HEADER_BYTES_MAX = 512 };

struct text_buffer {
	char *bytes;
	size_t size, capacity;
};

static void text_buffer_init(struct text_buffer *t, size_t lines)
{
	*t = (struct text_buffer){.bytes = bench_alloc(lines, LINE_BYTES_MAX), .capacity = lines * LINE_BYTES_MAX};
}

__attribute__((format(printf, 2, 3))) static void text_buffer_append(struct text_buffer *t, const char *format, ...)
{
	va_list ap;
	va_start(ap, format);
	t->size += (size_t)vsnprintf(t->bytes + t->size, t->capacity - t->size, format, ap);
	va_end(ap);
}

/* Appends a grid of (cells + 1) x (cells + 1) vertices of a surface over the unit square, with two triangles per cell.
 */
static void append_grid(struct text_buffer *t, int cells, void (*surface)(double u, double v, double p[3]))
{
	int side = cells + 1;
	text_buffer_init(t, (size_t)side * (size_t)side + 2 * (size_t)cells * (size_t)cells);
	for (int j = 0; j < side; j++)
		for (int i = 0; i < side; i++) {
			double p[3];
			surface((double)i / cells, (double)j / cells, p);
			text_buffer_append(t, "v %.7g %.7g %.7g\n", p[0], p[1], p[2]);
		}
	for (int j = 0; j < cells; j++)
		for (int i = 0; i < cells; i++) {
			int a = j * side + i + 1, b = a + 1, c = a + side, d = c + 1;
			text_buffer_append(t, "f %d %d %d\nf %d %d %d\n", a, b, d, a, d, c);
		}
}

static void hill_surface(double u, double v, double p[3])
{
	p[0] = 4 * u - 2;
	p[2] = 2 - 4 * v;
	p[1] = -1.9 + 0.08 * sin(31 * u) * cos(27 * v) + 0.01 * sin(411 * u + 3 * sin(97 * v)) * sin(377 * v);
}

static void ball_surface(double u, double v, double p[3])
{
	double phi = 2 * M_PI * u, theta = M_PI * (0.002 + 0.996 * v);
	double r = 0.8 + 0.03 * sin(14 * theta) * cos(12 * phi) + 0.004 * sin(90 * theta) * sin(80 * phi);
	p[0] = r * sin(theta) * cos(phi) + 0.3;
	p[1] = r * cos(theta) - 0.7;
	p[2] = -r * sin(theta) * sin(phi) - 0.4;
}

/* clang-format off */
#define LAMP(x)                                                                                                                 \
	"<shape type='rectangle'><transform name='to_world'><scale value='0.5'/><rotate x='1' angle='90'/><translate x='" x    \
	"' y='1.9'/></transform><emitter type='area'><rgb name='radiance' value='12,11,9'/></emitter></shape>"
/* clang-format on */

static const char million_xml[] =
	"<scene version='3.0.0'><integrator type='path'><integer name='max_depth' value='8'/></integrator>"
	"<sensor type='perspective'><float name='fov' value='60'/><transform name='to_world'><lookat origin='-0.4,0.3,1.9' "
	"target='0,-0.6,-1' up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='256'/><integer name='height' "
	"value='192'/></film></sensor>"
	"<shape type='cube'><transform name='to_world'><scale value='2'/></transform><bsdf type='diffuse'><rgb name='reflectance' "
	"value='0.6,0.55,0.5'/></bsdf></shape>"
	"<shape type='obj'><string name='filename' value='hills.obj'/><bsdf type='diffuse'><rgb name='reflectance' "
	"value='0.3,0.5,0.2'/></bsdf></shape>"
	"<shape type='obj'><string name='filename' value='ball.obj'/><bsdf type='roughconductor'><string name='material' value='Au'/>"
	"<string name='distribution' value='ggx'/><float name='alpha' value='0.2'/></bsdf></shape>" LAMP("-1")
		LAMP("1") "</scene>";

static struct world *build_world(const struct asset_source *assets, const char *file, const struct render_options *o,
				 const struct scene_define *defines, uint32_t define_count)
{
	struct error e;
	struct scene s;
	struct world *w = NULL;
	int rc = scene_read(&s, assets, file, render_plugins(), defines, define_count, &e);
	if (!rc) {
		rc = world_new(&w, &s, assets, o, &e);
		scene_fini(&s);
	}
	if (rc)
		bench_die(&e);
	return w;
}

struct world *bench_world_from_assets(const struct asset_source *assets, const char *file,
				      const struct render_options *o)
{
	return build_world(assets, file, o, NULL, 0);
}

struct world *bench_world_million(void)
{
	struct text_buffer floor, dented_ball;
	append_grid(&floor, FLOOR_CELLS, hill_surface);
	append_grid(&dented_ball, BALL_CELLS, ball_surface);
	const struct memory_file files[] = {{"million.xml", million_xml, sizeof million_xml - 1},
					    {"hills.obj", floor.bytes, floor.size},
					    {"ball.obj", dented_ball.bytes, dented_ball.size},
					    {NULL, NULL, 0}};
	struct asset_source assets = memory_assets(files);
	struct world *w = bench_world_from_assets(&assets, "million.xml", NULL);
	mem_free(floor.bytes);
	mem_free(dented_ball.bytes);
	return w;
}

void bench_write_file(const char *folder, const char *name, const void *bytes, size_t size)
{
	char path[4096];
	snprintf(path, sizeof path, "%s/%s", folder, name);
	FILE *f = fopen(path, "wb");
	if (!f || fwrite(bytes, 1, size, f) != size || fclose(f)) {
		perror(path);
		exit(1);
	}
}

void bench_write_million(const char *folder)
{
	struct text_buffer t;
	bench_write_file(folder, "million.xml", million_xml, sizeof million_xml - 1);
	append_grid(&t, FLOOR_CELLS, hill_surface);
	bench_write_file(folder, "hills.obj", t.bytes, t.size);
	mem_free(t.bytes);
	append_grid(&t, BALL_CELLS, ball_surface);
	bench_write_file(folder, "ball.obj", t.bytes, t.size);
	mem_free(t.bytes);
}

static void append_face(struct bench_file *f, uint32_t a, uint32_t b, uint32_t c)
{
	const uint32_t corner[3] = {a, b, c};
	f->bytes[f->size++] = 3;
	for (int k = 0; k < 3; k++, f->size += 4)
		put32(f->bytes + f->size, corner[k]);
}

struct bench_file bench_make_wavy_ply(uint32_t cells)
{
	uint32_t side = cells + 1;
	size_t vertices = (size_t)side * side, faces = 2 * (size_t)cells * cells;
	struct bench_file f = {bench_alloc(HEADER_BYTES_MAX + vertices * VERTEX_FLOATS * 4 + faces * FACE_BYTES, 1), 0};
	f.size = (size_t)snprintf((char *)f.bytes, HEADER_BYTES_MAX,
				  "ply\nformat binary_little_endian 1.0\nelement vertex %zu\n"
				  "property float x\nproperty float y\nproperty float z\n"
				  "property float nx\nproperty float ny\nproperty float nz\n"
				  "property float u\nproperty float v\nelement face %zu\n"
				  "property list uchar int vertex_indices\nend_header\n",
				  vertices, faces);
	for (size_t i = 0; i < vertices; i++) {
		double u = (double)(i % side) / cells, v = (double)(i / side) / cells;
		const double vertex[VERTEX_FLOATS] = {2 * u - 1, 2 * v - 1, 0.05 * sin(40 * u) * sin(40 * v), 0, 0, 1,
						      u,	 v};
		for (int k = 0; k < VERTEX_FLOATS; k++, f.size += 4)
			put_float(f.bytes + f.size, (float)vertex[k]);
	}
	for (uint32_t j = 0; j < cells; j++)
		for (uint32_t i = 0; i < cells; i++) {
			uint32_t a = j * side + i;
			append_face(&f, a, a + 1, a + side + 1);
			append_face(&f, a, a + side + 1, a + side);
		}
	return f;
}

const char *bench_box_path(void)
{
	static char path[4096];
	const char *scenes = getenv("HSLT_SCENES");
	if (scenes) {
		snprintf(path, sizeof path, "%s/cornell-box/scene.xml", scenes);
		if (access(path, R_OK) == 0)
			return path;
	}
	return "tests/scenes/box/box.xml";
}

struct world *bench_world_box(const char **name)
{
	char folder[4096];
	snprintf(folder, sizeof folder, "%s", bench_box_path());
	char *slash = strrchr(folder, '/');
	*slash = 0;
	*name = strstr(folder, "cornell-box") ? "cornell-box"
					      : "the box of tests/scenes (HSLT_SCENES names no cornell-box)";
	struct asset_source assets = asset_source_for_folder(folder);
	struct render_options small = {.width = 160, .height = 160};
	return bench_world_from_assets(&assets, slash + 1, &small);
}

struct world *bench_world(const char *path, bool shipped, const struct render_options *o)
{
	const char *scenes = getenv("HSLT_SCENES");
	char folder[4096];
	if (!shipped && !scenes)
		return NULL;
	snprintf(folder, sizeof folder, "%s/%s", shipped ? "." : scenes, path);
	if (access(folder, R_OK))
		return NULL;
	char *slash = strrchr(folder, '/');
	*slash = 0;
	struct asset_source assets = asset_source_for_folder(folder);
	return bench_world_from_assets(&assets, slash + 1, o);
}

struct world *bench_world_displaced(void)
{
	static const struct scene_define levels[] = {{"ground", "9"}, {"ball", "8"}};
	struct asset_source assets = asset_source_for_folder("tests/scenes/displaced");
	return build_world(&assets, "scene.xml", NULL, levels, 2);
}
