/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A glTF scene made in memory, in the three forms that files have: a floor that is a strip, two octahedra below a node,
 * a lamp that is a fan, a point light and a camera. Its XML twin is tests/scenes/gltf/twin.xml. One thread.
 */
#ifndef TESTS_SUPPORT_GLTF_FILES_H
#define TESTS_SUPPORT_GLTF_FILES_H

#include "tests/support/memory_assets.h"
#include "worker/render/scene/scene.h"

enum gltf_form { GLTF_EXTERNAL, GLTF_EMBEDDED, GLTF_BINARY, GLTF_FORMS };

struct gltf_files {
	char json[1 << 15];
	unsigned char buffer[1 << 11], file[1 << 16];
	size_t buffer_size, file_size;
	struct memory_file list[8]; /* the scene first */
};

/* The JSON and the buffer; gltf_files_pack makes files of them, to be called again after a change. The JSON names the
 * pictures "rgb.hdr"; the caller adds them to the list. */
void gltf_files_make(struct gltf_files *f);
void gltf_files_pack(struct gltf_files *f, enum gltf_form form);
/* After gltf_files_make: the numbers of all meshes but the lamp's coordinates, compressed by the library's encoder;
 * what they were is not in the buffer any more. */
void gltf_files_compress(struct gltf_files *f, const char *extension);
/* Where the compressed bytes begin in the buffer. */
enum { GLTF_FILES_PLAIN = 601 };
/* Every `from` in the JSON becomes `to`; fails the test where there is none. */
void gltf_files_replace(struct gltf_files *f, const char *from, const char *to);

/* "s.gltf" with `from` replaced (NULL: as it is), its buffer in a file of its own. */
const struct memory_file *gltf_files_change(struct gltf_files *f, const char *from, const char *to);
int gltf_files_read(const struct memory_file *files, bool lenient, struct scene *s, struct error *e);
/* The scene of a changed file; fails the test where that is refused. */
struct scene gltf_files_scene(const char *from, const char *to, bool lenient);
/* Packs what was changed; the same. */
struct scene gltf_files_packed(struct gltf_files *f, enum gltf_form form);

#endif
