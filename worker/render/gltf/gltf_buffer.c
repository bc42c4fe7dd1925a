/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds the bytes of buffers: in files beside the scene, in the binary chunk of a .glb, or as base64 in the JSON, whose
 * position in the file is searched for so that shapes and images can read it from there. Failures: other URI schemes,
 * views that exceed their buffer.
 */
#include "worker/render/gltf/gltf_buffer.h"
#include "worker/render/asset/asset_name.h"
#include "worker/render/gltf/gltf_meshopt.h"

#include <string.h>

static int digit(char c)
{
	return c >= '0' && c <= '9' ? c - '0' : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1;
}

/* Returns the canonical name of the file in a URI, where %20 is a blank. Exporters on Windows write folders with
 * '\\', which cannot occur in a valid URI. */
static const char *file_name(struct gltf *g, const struct gltf_at *at, const char *uri)
{
	size_t n = strlen(uri), k = 0;
	char *name = arena_alloc(g->arena, n + 1, 1), *out = arena_alloc(g->arena, ASSET_NAME_ROOM(n), 1);
	if (!name || !out) {
		gltf_fail(g, at, ENOMEM, "out of memory");
		return NULL;
	}
	for (size_t i = 0; i < n; i++) {
		int high = uri[i] == '%' && i + 2 < n ? digit(uri[i + 1]) : -1,
		    low = high >= 0 ? digit(uri[i + 2]) : -1;
		char c = low >= 0 ? (char)(16 * high + low) : uri[i] == '\\' ? '/' : uri[i];
		i += low >= 0 ? 2 : 0;
		if (c == 0) {
			gltf_fail(g, at, EINVAL, "its uri is not the name of a file");
			return NULL;
		}
		name[k++] = c;
	}
	name[k] = 0;
	asset_name_canonical(name, out);
	return out;
}

static int embedded(struct gltf *g, const struct gltf_at *at, const char *uri, struct gltf_range *out)
{
	struct gltf_range *known = at->array == GLTF_BUFFERS ? g->buffers : g->images;
	if (known[at->index].file) {
		*out = known[at->index];
		return 0;
	}
	if (++g->embedded > GLTF_EMBEDDED_MAX)
		return gltf_fail(g, at, E2BIG, "more than %d buffers and images are embedded", GLTF_EMBEDDED_MAX);
	const char *comma = strchr(uri, ',');
	if (!comma || comma - uri < 7 || memcmp(comma - 7, ";base64", 7) != 0)
		return gltf_fail(g, at, ENOTSUP, "its embedded data is not base64");
	size_t n = strlen(comma + 1), padding = 0;
	const unsigned char *there = n ? memmem(g->bytes, g->size, comma + 1, n) : g->bytes;
	if (!there)
		return gltf_fail(g, at, ENOTSUP, "its embedded data is written with escapes; use .glb");
	while (padding < n && comma[n - padding] == '=')
		padding++;
	*out = (struct gltf_range){g->file, (uint64_t)(there - g->bytes), n, true, (n - padding) * 3 / 4, 0};
	known[at->index] = *out;
	return 0;
}

static int range_of_uri(struct gltf *g, const struct gltf_at *at, const char *uri, struct gltf_range *out)
{
	if (strncmp(uri, "data:", 5) == 0)
		return embedded(g, at, uri, out);
	static const char local[] = "file://";
	if (strncmp(uri, local, sizeof local - 1) == 0 && uri[sizeof local - 1] == '/')
		uri += sizeof local - 1;
	else if (strstr(uri, "://"))
		return gltf_fail(g, at, ENOTSUP, "\"%.64s\": files come from the scene's folder, not from a network",
				 uri);
	*out = (struct gltf_range){.file = file_name(g, at, uri), .count = UINT64_MAX, .size = UINT64_MAX};
	return g->failed;
}

static int buffer_range(struct gltf *g, const struct gltf_at *buffer, struct gltf_range *out)
{
	const char *uri = gltf_text(g, buffer, buffer->json, "uri", NULL);
	uint64_t length = gltf_whole(g, buffer, buffer->json, "byteLength", 0);
	if (!uri && buffer->index > 0)
		return gltf_fail(g, buffer, EINVAL, "it has no uri");
	if (!uri)
		*out = (struct gltf_range){g->file, g->binary_first, g->binary_count, false, g->binary_count, 0};
	else if (range_of_uri(g, buffer, uri, out))
		return g->failed;
	if (length > out->size)
		return gltf_fail(g, buffer, EINVAL, "it states %llu bytes but has %llu", (unsigned long long)length,
				 (unsigned long long)out->size);
	out->size = length;
	if (!out->base64)
		out->count = length;
	return g->failed;
}

int gltf_buffer_view(struct gltf *g, const struct gltf_at *view, struct gltf_range *buffer, uint64_t *first,
		     uint64_t *count)
{
	struct gltf_at at;
	if (gltf_meshopt(g, view))
		return gltf_fail(g, view, EINVAL, "it is compressed, which only views of accessors may be");
	int rc = gltf_follow(g, view, view->json, "buffer", GLTF_BUFFERS, &at);
	if (rc <= 0)
		return rc ? rc : gltf_fail(g, view, EINVAL, "it has no buffer");
	*first = gltf_whole(g, view, view->json, "byteOffset", 0);
	*count = gltf_whole(g, view, view->json, "byteLength", 0);
	if (buffer_range(g, &at, buffer))
		return g->failed;
	if (*first > buffer->size || *count > buffer->size - *first)
		return gltf_fail(g, view, EINVAL, "it exceeds buffers[%zu] of %llu bytes", at.index,
				 (unsigned long long)buffer->size);
	return g->failed;
}

int gltf_image_range(struct gltf *g, const struct gltf_at *image, struct gltf_range *out)
{
	struct gltf_at view;
	struct gltf_range buffer;
	uint64_t first, count;
	const char *uri = gltf_text(g, image, image->json, "uri", NULL);
	if (uri)
		return range_of_uri(g, image, uri, out);
	int rc = gltf_follow(g, image, image->json, "bufferView", GLTF_BUFFER_VIEWS, &view);
	if (rc <= 0)
		return rc ? rc : gltf_fail(g, image, EINVAL, "it has no uri and no bufferView");
	if (gltf_buffer_view(g, &view, &buffer, &first, &count))
		return g->failed;
	*out = gltf_range_part(&buffer, first, first + count);
	return 0;
}

struct gltf_range gltf_range_part(const struct gltf_range *r, uint64_t begin, uint64_t end)
{
	struct gltf_range part = *r;
	part.size = end - begin;
	if (!r->base64) {
		part.first += begin;
		part.count = end - begin;
		return part;
	}
	part.skip = (unsigned)(begin % 3);
	part.first += begin / 3 * 4;
	part.count = ((end - begin + part.skip) * 4 + 2) / 3;
	return part;
}

void gltf_put_range(struct gltf *g, struct xml_element *el, const struct gltf_at *at, const struct gltf_range *r)
{
	gltf_put_text(g, el, at, "filename", r->file ? r->file : "");
	if (r->count == UINT64_MAX)
		return;
	gltf_put_whole(g, el, at, "first_byte", r->first);
	gltf_put_whole(g, el, at, "byte_count", r->count);
	if (r->base64)
		gltf_put_bool(g, el, at, "base64", true);
	if (r->skip)
		gltf_put_whole(g, el, at, "skip_bytes", r->skip);
}
