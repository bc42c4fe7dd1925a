/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Buffers stay open: the last one that is a file, because neighbouring accessors share it, and all that are in base64,
 * because decoding one again for each of many accessors could take hours. Decompressed views are kept as well. The file
 * of such a buffer is added to the list of the scene's files (the tree's includes), because no shape names it.
 *
 * Failures: accessors that contradict themselves, views that are too short, more numbers than a mesh may have.
 */
#include "worker/render/gltf/gltf_numbers.h"

#include "common/base/bytes.h"
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/asset/asset_keeper.h"
#include "worker/render/asset/asset_range.h"
#include "worker/render/gltf/gltf_buffer.h"
#include "worker/render/gltf/gltf_meshopt.h"

#include <string.h>

enum { COMPONENTS_MAX = 16 };
#define NUMBERS_MAX (UINT64_C(1) << 28)

struct gltf_open_buffer {
	struct asset_range range;
	const char *file; /* NULL: not open */
	uint64_t first_byte, byte_count;
	struct gltf_open_buffer *next;
};

/* ---- bytes ---- */

static void close_buffer(struct gltf *g, struct gltf_open_buffer *o)
{
	if (o && o->file)
		asset_range_close(&o->range, g->assets);
}

static size_t buffer_view_count(const struct gltf *g)
{
	return json_array_size(json_object_get(g->root, gltf_array_name(GLTF_BUFFER_VIEWS)));
}

void gltf_buffers_close(struct gltf *g)
{
	for (size_t i = 0; g->unpacked_views && i < buffer_view_count(g); i++)
		mem_free(g->unpacked_views[i].bytes);
	close_buffer(g, g->open_file);
	for (; g->decoded_buffers; g->decoded_buffers = g->decoded_buffers->next)
		close_buffer(g, g->decoded_buffers);
	g->open_file = NULL;
}

static bool list_file(struct gltf *g, const char *file)
{
	struct xml_tree *t = g->tree;
	for (uint32_t i = 0; i < t->include_count; i++)
		if (strcmp(t->included_files[i], file) == 0)
			return true;
	if (t->include_count == XML_FILES_MAX) {
		gltf_fail(g, NULL, E2BIG, "more than %d files", XML_FILES_MAX);
		return false;
	}
	t->included_files[t->include_count++] = file;
	return true;
}

static bool is_buffer_of_range(const struct gltf_open_buffer *o, const struct gltf_range *r)
{
	return o->file && o->first_byte == r->first_byte && o->byte_count == r->byte_count &&
	       strcmp(o->file, r->file) == 0;
}

/* Returns the entry of a buffer: that of the open buffer, or one with file NULL. NULL if out of memory. */
static struct gltf_open_buffer *find_buffer(struct gltf *g, const struct gltf_range *r)
{
	struct gltf_open_buffer *o = r->is_base64 ? g->decoded_buffers : g->open_file;
	while (r->is_base64 && o && !is_buffer_of_range(o, r))
		o = o->next;
	if (o && is_buffer_of_range(o, r))
		return o;
	if (o) {
		close_buffer(g, o);
		o->file = NULL;
		return o;
	}
	o = arena_alloc(g->arena, 1, sizeof *o);
	if (!o)
		gltf_fail(g, NULL, ENOMEM, "out of memory");
	else if (r->is_base64) {
		o->next = g->decoded_buffers;
		g->decoded_buffers = o;
	} else
		g->open_file = o;
	return o;
}

/* Returns NULL after a failure. */
static const struct gltf_open_buffer *open_buffer(struct gltf *g, const struct gltf_range *r)
{
	struct error inner;
	struct gltf_open_buffer *o = find_buffer(g, r);
	if (!o || o->file)
		return o;
	int rc = asset_range_open(&o->range, g->assets, r->file, r->first_byte, r->byte_count, r->is_base64, &inner);
	if (rc) {
		gltf_fail(g, NULL, -rc, "%s", inner.text);
		return NULL;
	}
	o->file = r->file;
	o->first_byte = r->first_byte;
	o->byte_count = r->byte_count;
	g->bytes_read += o->range.file.size;
	if (g->bytes_read > ASSET_KEEPER_BYTES_MAX)
		gltf_fail(g, NULL, E2BIG, "its files are requested again and again; %llu GB were read so far",
			  (unsigned long long)g->bytes_read >> 30);
	return !g->error_code && list_file(g, r->file) ? o : NULL;
}

/* Returns the stored bytes of a view, valid until another buffer is read. NULL after a failure. */
static const unsigned char *stored_bytes(struct gltf *g, const struct gltf_entry *view, uint64_t *count)
{
	struct gltf_range buffer;
	uint64_t first;
	const struct gltf_open_buffer *o;
	if (gltf_locate_buffer_view(g, view, &buffer, &first, count) || !(o = open_buffer(g, &buffer)))
		return NULL;
	if (first <= o->range.size && *count <= o->range.size - first)
		return o->range.bytes + first;
	gltf_fail(g, view, EINVAL, "it exceeds its buffer of %zu bytes", o->range.size);
	return NULL;
}

/* Returns the bytes of a view, decompressed if necessary: only once, since a file may have the numbers of all meshes
 * in one view. NULL after a failure. */
static const unsigned char *view_bytes(struct gltf *g, const struct gltf_entry *view, uint64_t *count)
{
	const json_t *packed = gltf_meshopt_extension(g, view);
	uint64_t size;
	if (!packed)
		return stored_bytes(g, view, count);
	if (!g->unpacked_views)
		g->unpacked_views = arena_alloc(g->arena, buffer_view_count(g), sizeof *g->unpacked_views);
	if (!g->unpacked_views) {
		gltf_fail(g, NULL, ENOMEM, "out of memory");
		return NULL;
	}
	struct gltf_unpacked_view *u = &g->unpacked_views[view->index];
	if (!u->bytes) {
		const unsigned char *bytes =
			stored_bytes(g, &(struct gltf_entry){view->array, view->index, packed}, &size);
		u->bytes = bytes ? gltf_meshopt_decode(g, view, packed, bytes, size, &u->byte_count) : NULL;
	}
	*count = u->byte_count;
	return u->bytes;
}

/* ---- numbers ---- */

static unsigned component_size(uint64_t component)
{
	return component == GLTF_BYTE || component == GLTF_UNSIGNED_BYTE     ? 1
	       : component == GLTF_SHORT || component == GLTF_UNSIGNED_SHORT ? 2
	       : component == GLTF_UNSIGNED_INT || component == GLTF_FLOAT   ? 4
									     : 0;
}

double gltf_normalized_value(double x, uint64_t component)
{
	switch (component) {
	case GLTF_BYTE:
		return fmax(x / 127, -1);
	case GLTF_UNSIGNED_BYTE:
		return x / 255;
	case GLTF_SHORT:
		return fmax(x / 32767, -1);
	case GLTF_UNSIGNED_SHORT:
		return x / 65535;
	default:
		return x;
	}
}

static double read_number(const unsigned char *p, uint64_t component, bool normalized)
{
	uint32_t bits = (uint32_t)get_bytes(p, (int)component_size(component));
	double x = bits;
	float f;
	if (component == GLTF_BYTE)
		x = (int8_t)bits;
	if (component == GLTF_SHORT)
		x = (int16_t)bits;
	if (component == GLTF_FLOAT) {
		memcpy(&f, &bits, sizeof f);
		x = (double)f;
	}
	return normalized ? gltf_normalized_value(x, component) : x;
}

static unsigned type_component_count(const char *type)
{
	static const struct {
		const char *name;
		unsigned count;
	} types[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
	for (size_t i = 0; i < sizeof types / sizeof *types; i++)
		if (strcmp(types[i].name, type) == 0)
			return types[i].count;
	return 0;
}

/* How an array of vectors is stored in a view. */
struct vector_layout {
	uint64_t component_type, stride, offset;
	bool is_normalized;
};

/* Stores the k-th vector of the view as vector target_indices[k], or as vector k if `target_indices` is NULL. */
static void read_vectors(struct gltf *g, const struct gltf_entry *a, const struct gltf_entry *view,
			 const struct vector_layout *p, uint64_t count, const double *target_indices,
			 struct gltf_vectors *out)
{
	uint64_t size, width = component_size(p->component_type), vector_size = width * out->component_count;
	const unsigned char *bytes = view_bytes(g, view, &size);
	if (!bytes)
		return;
	if (p->stride < vector_size || p->offset > size ||
	    (count > 0 &&
	     (size - p->offset < vector_size || (count - 1) > (size - p->offset - vector_size) / p->stride))) {
		gltf_fail(g, a, EINVAL, "it exceeds bufferViews[%zu]", view->index);
		return;
	}
	for (uint64_t i = 0; i < count; i++) {
		uint64_t index = target_indices ? (uint64_t)target_indices[i] : i;
		if (index >= out->count) {
			gltf_fail(g, a, EINVAL, "its sparse indices exceed its count");
			return;
		}
		for (unsigned k = 0; k < out->component_count; k++)
			out->values[index * out->component_count + k] = read_number(
				bytes + p->offset + i * p->stride + k * width, p->component_type, p->is_normalized);
		if (i % 65536 == 0)
			liveness_tick();
	}
}

static void read_sparse(struct gltf *g, const struct gltf_entry *a, const struct vector_layout *dense_layout,
			struct gltf_vectors *out)
{
	const json_t *sparse = gltf_object(g, a, a->json, "sparse"), *indices, *values;
	struct gltf_entry view[2];
	if (!sparse)
		return;
	uint64_t count = gltf_integer(g, a, sparse, "count", 0);
	indices = gltf_object(g, a, sparse, "indices");
	values = gltf_object(g, a, sparse, "values");
	if (!indices || !values || count > out->count ||
	    gltf_resolve(g, a, indices, "bufferView", GLTF_BUFFER_VIEWS, &view[0]) <= 0 ||
	    gltf_resolve(g, a, values, "bufferView", GLTF_BUFFER_VIEWS, &view[1]) <= 0) {
		gltf_fail(g, a, EINVAL, "its sparse part has no indices or values, or too many");
		return;
	}
	struct vector_layout p = {gltf_integer(g, a, indices, "componentType", 0), 0,
				  gltf_integer(g, a, indices, "byteOffset", 0), false};
	p.stride = component_size(p.component_type);
	struct gltf_vectors sparse_indices = {mem_alloc(count + 1, sizeof *sparse_indices.values), count, 1};
	if (!sparse_indices.values)
		gltf_fail(g, a, ENOMEM, "out of memory");
	else if (p.component_type != GLTF_UNSIGNED_BYTE && p.component_type != GLTF_UNSIGNED_SHORT &&
		 p.component_type != GLTF_UNSIGNED_INT)
		gltf_fail(g, a, EINVAL, "its sparse indices are not whole numbers");
	else
		read_vectors(g, a, &view[0], &p, count, NULL, &sparse_indices);
	p = *dense_layout;
	p.stride = (uint64_t)component_size(p.component_type) * out->component_count;
	p.offset = gltf_integer(g, a, values, "byteOffset", 0);
	if (!g->error_code)
		read_vectors(g, a, &view[1], &p, count, sparse_indices.values, out);
	gltf_vectors_fini(&sparse_indices);
}

bool gltf_vectors_read(struct gltf *g, const struct gltf_entry *accessor, const char *purpose, unsigned components,
		       struct gltf_vectors *out)
{
	struct gltf_entry view;
	unsigned type_components = type_component_count(gltf_string(g, accessor, accessor->json, "type", ""));
	struct vector_layout p = {gltf_integer(g, accessor, accessor->json, "componentType", 0), 0,
				  gltf_integer(g, accessor, accessor->json, "byteOffset", 0),
				  json_is_true(json_object_get(accessor->json, "normalized"))};
	*out = (struct gltf_vectors){NULL, gltf_integer(g, accessor, accessor->json, "count", 0), type_components};
	if (!type_components || (components && type_components != components) || !component_size(p.component_type))
		gltf_fail(g, accessor, EINVAL, "of a type that %s cannot have", purpose);
	if (out->count > NUMBERS_MAX / COMPONENTS_MAX)
		gltf_fail(g, accessor, E2BIG, "more than %llu vectors",
			  (unsigned long long)NUMBERS_MAX / COMPONENTS_MAX);
	if (!g->error_code && !(out->values = mem_alloc(out->count * type_components + 1, sizeof *out->values)))
		gltf_fail(g, accessor, ENOMEM, "out of memory");
	if (!g->error_code && gltf_resolve(g, accessor, accessor->json, "bufferView", GLTF_BUFFER_VIEWS, &view) > 0) {
		p.stride = gltf_integer(g, &view, view.json, "byteStride",
					(uint64_t)component_size(p.component_type) * type_components);
		read_vectors(g, accessor, &view, &p, out->count, NULL, out);
	}
	if (!g->error_code)
		read_sparse(g, accessor, &p, out);
	if (g->error_code)
		gltf_vectors_fini(out);
	return !g->error_code;
}

void gltf_vectors_fini(struct gltf_vectors *v)
{
	mem_free(v->values);
	v->values = NULL;
}
