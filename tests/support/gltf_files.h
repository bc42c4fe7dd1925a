/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A glTF scene made in memory, in the three forms that files have: a floor (a strip), two octahedra below a node, a
 * lamp (a fan), a point light and a camera. Its XML twin is tests/scenes/gltf/twin.xml. One thread.
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
	struct memory_file files[8]; /* the scene comes first */
};

/* gltf_files_make() makes the JSON and the buffer, and gltf_files_pack() turns them into files; it must be called
 * again after a change. The JSON refers to pictures as "rgb.hdr"; the caller adds them to the list. */
void gltf_files_make(struct gltf_files *f);
void gltf_files_pack(struct gltf_files *f, enum gltf_form form);
/* Compresses, after gltf_files_make(), the numbers of all meshes except the lamp's texture coordinates, with the
 * library's encoder. The buffer then no longer contains the uncompressed numbers. */
void gltf_files_compress(struct gltf_files *f, const char *extension);
/* Offset of the compressed bytes in the buffer. */
enum { GLTF_FILES_PLAIN_BYTES = 601 };
/* Replaces every `from` in the JSON by `to`; fails the test if there is none. */
void gltf_files_replace(struct gltf_files *f, const char *from, const char *to);

/* Returns "s.gltf" with `from` replaced (NULL: unchanged), and its buffer in a separate file. */
const struct memory_file *gltf_files_make_changed(struct gltf_files *f, const char *from, const char *to);
int gltf_files_read(const struct memory_file *files, bool lenient, struct scene *s, struct error *e);
/* Reads the scene of a changed file; fails the test if it is refused. */
struct scene gltf_files_read_changed(const char *from, const char *to, bool lenient);
/* Packs the files, which may have been changed, and reads the scene; fails the test if it is refused. */
struct scene gltf_files_read_packed(struct gltf_files *f, enum gltf_form form);

#endif
