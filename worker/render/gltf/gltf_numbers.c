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

struct gltf_open {
	struct asset_range part;
	const char *file; /* NULL: not open */
	uint64_t first, count;
	struct gltf_open *next;
};

/* ---- bytes ---- */

static void close_open(struct gltf *g, struct gltf_open *o)
{
	if (o && o->file)
		asset_range_close(&o->part, g->assets);
}

static size_t views_of(const struct gltf *g)
{
	return json_array_size(json_object_get(g->root, gltf_array_name(GLTF_BUFFER_VIEWS)));
}

void gltf_numbers_close(struct gltf *g)
{
	for (size_t i = 0; g->unpacked && i < views_of(g); i++)
		mem_free(g->unpacked[i].bytes);
	close_open(g, g->plain);
	for (; g->decoded; g->decoded = g->decoded->next)
		close_open(g, g->decoded);
	g->plain = NULL;
}

static bool list_file(struct gltf *g, const char *file)
{
	struct xml_tree *t = g->tree;
	for (uint32_t i = 0; i < t->include_count; i++)
		if (strcmp(t->includes[i], file) == 0)
			return true;
	if (t->include_count == XML_FILES_MAX) {
		gltf_fail(g, NULL, E2BIG, "more than %d files", XML_FILES_MAX);
		return false;
	}
	t->includes[t->include_count++] = file;
	return true;
}

static bool is_open(const struct gltf_open *o, const struct gltf_range *r)
{
	return o->file && o->first == r->first && o->count == r->count && strcmp(o->file, r->file) == 0;
}

/* Returns the entry of a buffer: that of the open buffer, or one with file NULL. NULL if out of memory. */
static struct gltf_open *find_open(struct gltf *g, const struct gltf_range *r)
{
	struct gltf_open *o = r->base64 ? g->decoded : g->plain;
	while (r->base64 && o && !is_open(o, r))
		o = o->next;
	if (o && is_open(o, r))
		return o;
	if (o) {
		close_open(g, o);
		o->file = NULL;
		return o;
	}
	o = arena_alloc(g->arena, 1, sizeof *o);
	if (!o)
		gltf_fail(g, NULL, ENOMEM, "out of memory");
	else if (r->base64) {
		o->next = g->decoded;
		g->decoded = o;
	} else
		g->plain = o;
	return o;
}

/* Returns NULL after a failure. */
static const struct gltf_open *open_buffer(struct gltf *g, const struct gltf_range *r)
{
	struct error inner;
	struct gltf_open *o = find_open(g, r);
	if (!o || o->file)
		return o;
	int rc = asset_range_open(&o->part, g->assets, r->file, r->first, r->count, r->base64, &inner);
	if (rc) {
		gltf_fail(g, NULL, -rc, "%s", inner.text);
		return NULL;
	}
	o->file = r->file;
	o->first = r->first;
	o->count = r->count;
	g->read += o->part.file.size;
	if (g->read > ASSET_KEEPER_BYTES_MAX)
		gltf_fail(g, NULL, E2BIG, "its files are requested again and again; %llu GB were read so far",
			  (unsigned long long)g->read >> 30);
	return !g->failed && list_file(g, r->file) ? o : NULL;
}

/* Returns the stored bytes of a view, valid until another buffer is read. NULL after a failure. */
static const unsigned char *stored_bytes(struct gltf *g, const struct gltf_at *view, uint64_t *count)
{
	struct gltf_range buffer;
	uint64_t first;
	const struct gltf_open *o;
	if (gltf_buffer_view(g, view, &buffer, &first, count) || !(o = open_buffer(g, &buffer)))
		return NULL;
	if (first <= o->part.size && *count <= o->part.size - first)
		return o->part.bytes + first;
	gltf_fail(g, view, EINVAL, "it exceeds its buffer of %zu bytes", o->part.size);
	return NULL;
}

/* Returns the bytes of a view, decompressed if necessary: only once, since a file may have the numbers of all meshes
 * in one view. NULL after a failure. */
static const unsigned char *view_bytes(struct gltf *g, const struct gltf_at *view, uint64_t *count)
{
	const json_t *packed = gltf_meshopt(g, view);
	uint64_t size;
	if (!packed)
		return stored_bytes(g, view, count);
	if (!g->unpacked)
		g->unpacked = arena_alloc(g->arena, views_of(g), sizeof *g->unpacked);
	if (!g->unpacked) {
		gltf_fail(g, NULL, ENOMEM, "out of memory");
		return NULL;
	}
	struct gltf_unpacked *u = &g->unpacked[view->index];
	if (!u->bytes) {
		const unsigned char *bytes =
			stored_bytes(g, &(struct gltf_at){view->array, view->index, packed}, &size);
		u->bytes = bytes ? gltf_meshopt_decode(g, view, packed, bytes, size, &u->count) : NULL;
	}
	*count = u->count;
	return u->bytes;
}

/* ---- numbers ---- */

static unsigned size_of(uint64_t component)
{
	return component == GLTF_BYTE || component == GLTF_UNSIGNED_BYTE     ? 1
	       : component == GLTF_SHORT || component == GLTF_UNSIGNED_SHORT ? 2
	       : component == GLTF_UNSIGNED_INT || component == GLTF_FLOAT   ? 4
									     : 0;
}

double gltf_normalized(double x, uint64_t component)
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
	uint32_t bits = (uint32_t)get_bytes(p, (int)size_of(component));
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
	return normalized ? gltf_normalized(x, component) : x;
}

static unsigned components_of(const char *type)
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
struct packed {
	uint64_t component, stride, offset;
	bool normalized;
};

/* Stores the k-th vector of the view as vector to[k], or as vector k if `to` is NULL. */
static void unpack(struct gltf *g, const struct gltf_at *a, const struct gltf_at *view, const struct packed *p,
		   uint64_t count, const double *to, struct gltf_vectors *out)
{
	uint64_t size, width = size_of(p->component), used = width * out->components;
	const unsigned char *bytes = view_bytes(g, view, &size);
	if (!bytes)
		return;
	if (p->stride < used || p->offset > size ||
	    (count > 0 && (size - p->offset < used || (count - 1) > (size - p->offset - used) / p->stride))) {
		gltf_fail(g, a, EINVAL, "it exceeds bufferViews[%zu]", view->index);
		return;
	}
	for (uint64_t i = 0; i < count; i++) {
		uint64_t at = to ? (uint64_t)to[i] : i;
		if (at >= out->count) {
			gltf_fail(g, a, EINVAL, "its sparse indices exceed its count");
			return;
		}
		for (unsigned k = 0; k < out->components; k++)
			out->x[at * out->components + k] =
				read_number(bytes + p->offset + i * p->stride + k * width, p->component, p->normalized);
		if (i % 65536 == 0)
			liveness_tick();
	}
}

static void read_sparse(struct gltf *g, const struct gltf_at *a, const struct packed *whole, struct gltf_vectors *out)
{
	const json_t *sparse = gltf_object(g, a, a->json, "sparse"), *indices, *values;
	struct gltf_at view[2];
	if (!sparse)
		return;
	uint64_t count = gltf_whole(g, a, sparse, "count", 0);
	indices = gltf_object(g, a, sparse, "indices");
	values = gltf_object(g, a, sparse, "values");
	if (!indices || !values || count > out->count ||
	    gltf_follow(g, a, indices, "bufferView", GLTF_BUFFER_VIEWS, &view[0]) <= 0 ||
	    gltf_follow(g, a, values, "bufferView", GLTF_BUFFER_VIEWS, &view[1]) <= 0) {
		gltf_fail(g, a, EINVAL, "its sparse part has no indices or values, or too many");
		return;
	}
	struct packed p = {gltf_whole(g, a, indices, "componentType", 0), 0, gltf_whole(g, a, indices, "byteOffset", 0),
			   false};
	p.stride = size_of(p.component);
	struct gltf_vectors at = {mem_alloc(count + 1, sizeof *at.x), count, 1};
	if (!at.x)
		gltf_fail(g, a, ENOMEM, "out of memory");
	else if (p.component != GLTF_UNSIGNED_BYTE && p.component != GLTF_UNSIGNED_SHORT &&
		 p.component != GLTF_UNSIGNED_INT)
		gltf_fail(g, a, EINVAL, "its sparse indices are not whole numbers");
	else
		unpack(g, a, &view[0], &p, count, NULL, &at);
	p = *whole;
	p.stride = (uint64_t)size_of(p.component) * out->components;
	p.offset = gltf_whole(g, a, values, "byteOffset", 0);
	if (!g->failed)
		unpack(g, a, &view[1], &p, count, at.x, out);
	gltf_vectors_fini(&at);
}

bool gltf_vectors_read(struct gltf *g, const struct gltf_at *a, const char *use, unsigned components,
		       struct gltf_vectors *out)
{
	struct gltf_at view;
	unsigned has = components_of(gltf_text(g, a, a->json, "type", ""));
	struct packed p = {gltf_whole(g, a, a->json, "componentType", 0), 0, gltf_whole(g, a, a->json, "byteOffset", 0),
			   json_is_true(json_object_get(a->json, "normalized"))};
	*out = (struct gltf_vectors){NULL, gltf_whole(g, a, a->json, "count", 0), has};
	if (!has || (components && has != components) || !size_of(p.component))
		gltf_fail(g, a, EINVAL, "of a type that %s cannot have", use);
	if (out->count > NUMBERS_MAX / COMPONENTS_MAX)
		gltf_fail(g, a, E2BIG, "more than %llu vectors", (unsigned long long)NUMBERS_MAX / COMPONENTS_MAX);
	if (!g->failed && !(out->x = mem_alloc(out->count * has + 1, sizeof *out->x)))
		gltf_fail(g, a, ENOMEM, "out of memory");
	if (!g->failed && gltf_follow(g, a, a->json, "bufferView", GLTF_BUFFER_VIEWS, &view) > 0) {
		p.stride = gltf_whole(g, &view, view.json, "byteStride", (uint64_t)size_of(p.component) * has);
		unpack(g, a, &view, &p, out->count, NULL, out);
	}
	if (!g->failed)
		read_sparse(g, a, &p, out);
	if (g->failed)
		gltf_vectors_fini(out);
	return !g->failed;
}

void gltf_vectors_fini(struct gltf_vectors *v)
{
	mem_free(v->x);
	v->x = NULL;
}
