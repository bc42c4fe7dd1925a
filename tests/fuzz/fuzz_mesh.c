/* SPDX-License-Identifier: Apache-2.0 */
/*
 * libFuzzer: files of meshes. The first byte chooses the format as which the rest is read.
 */
#include "tests/fuzz/seeds.h"
#include "tests/support/memory_assets.h"
#include "tests/support/mesh_files.h"
#include "tests/support/scene_tables.h"

#include <stdio.h>
#include <string.h>

static const char *const types[] = {"obj", "ply", "serialized", "linearcurve", "bsplinecurve", "hair", "sdfgrid"};
enum { TYPES = sizeof types / sizeof *types };

static void write_seed(uint8_t type, uint64_t number, const struct mesh_file *f)
{
	static unsigned char bytes[1 + sizeof f->bytes];
	bytes[0] = type;
	memcpy(bytes + 1, f->bytes, f->size);
	seed_write_file("mesh", number, bytes, 1 + f->size);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	(void)argc, (void)argv;
	if (!seeds_are_requested())
		return 0;
	static struct mesh_file f;
	for (enum ply_kind k = 0; k < PLY_KINDS; k++) {
		mesh_file_make_ply(&f, k);
		write_seed(1, k, &f);
	}
	static const char attributes[] =
		"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
		"property float w_0\nproperty float w_1\nproperty uchar r\nproperty uchar g\nproperty uchar b\n"
		"element face 2\nproperty float heat\nproperty list uchar int vertex_indices\nproperty short id\nend_header\n"
		"0 0 0 1 2 1 2 3\n1 0 0 3 4 4 5 6\n1 1 0 5 6 7 8 9\n0 1 0 7 8 0 0 0\n0.5 4 0 1 2 3 7\n0 3 0 0 1 8\n";
	memcpy(f.bytes, attributes, f.size = sizeof attributes - 1);
	write_seed(1, 20, &f);
	for (int version = 3; version <= 5; version++) {
		mesh_file_make_serialized(&f, version, version == 4, 11, 2);
		write_seed(2, 10 + (uint64_t)version, &f);
	}
	static const char curves[] =
		"0 0 0 0.1\n1 0 0 0.2\n1 1 0 0.2\n0 1 1 0\n\n0 0 1 0.1\n0 0 1 0.1\n0 0 2 2\n0 0 1 0.1\n",
			  hair[] = "BINARY_HAIR\4\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0"
				   "\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\0\x80\x7f"
				   "\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x80\x3f\0\0\0\0\0\0\0\0";
	for (uint8_t type = 3; type < 5; type++) {
		memcpy(f.bytes, curves, f.size = sizeof curves - 1);
		write_seed(type, 20 + (uint64_t)type, &f);
	}
	memcpy(f.bytes, hair, f.size = sizeof hair - 1);
	write_seed(5, 25, &f);
	static const char grid[48 + 27 * 4] = "VOL\3\1\0\0\0\3\0\0\0\3\0\0\0\3\0\0\0\1";
	memcpy(f.bytes, grid, f.size = sizeof grid);
	for (size_t i = 0; i < 27; i++)
		f.bytes[48 + 4 * i + 3] = i % 2 ? 0x3f : 0xbf;
	write_seed(6, 26, &f);
	exit(0);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	if (size == 0)
		return 0;
	char xml[256];
	snprintf(xml, sizeof xml,
		 "<scene version='3.0.0'><shape type='%s'><string name='filename' value='m'/></shape></scene>",
		 types[bytes[0] % TYPES]);
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {"m", bytes + 1, size - 1}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene scene;
	struct error e;
	if (scene_read(&scene, &assets, "s.xml", scene_tables(), NULL, 0, &e))
		return 0;
	struct arena arena = {.limit = 256 << 20};
	struct shape_geometry g;
	uint64_t dropped;
	if (!shape_build(scene.objects[0], &assets, &arena, &g, &dropped, &e) && g.kind == SHAPE_CURVE)
		shape_curves_to_mesh(&g, scene.objects[0], &arena, &dropped, &e);
	arena_fini(&arena);
	scene_fini(&scene);
	return 0;
}
