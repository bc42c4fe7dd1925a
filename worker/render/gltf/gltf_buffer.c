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

static int hex_digit(char c)
{
	return c >= '0' && c <= '9' ? c - '0' : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1;
}

/* Returns the canonical name of the file in a URI, where %20 is a blank. Exporters on Windows write folders with
 * '\\', which cannot occur in a valid URI. */
static const char *uri_file_name(struct gltf *g, const struct gltf_entry *entry, const char *uri)
{
	size_t n = strlen(uri), k = 0;
	char *name = arena_alloc(g->arena, n + 1, 1), *out = arena_alloc(g->arena, ASSET_NAME_SIZE_MAX(n), 1);
	if (!name || !out) {
		gltf_fail(g, entry, ENOMEM, "out of memory");
		return NULL;
	}
	for (size_t i = 0; i < n; i++) {
		int high = uri[i] == '%' && i + 2 < n ? hex_digit(uri[i + 1]) : -1,
		    low = high >= 0 ? hex_digit(uri[i + 2]) : -1;
		char c = low >= 0 ? (char)(16 * high + low) : uri[i] == '\\' ? '/' : uri[i];
		i += low >= 0 ? 2 : 0;
		if (c == 0) {
			gltf_fail(g, entry, EINVAL, "its uri is not the name of a file");
			return NULL;
		}
		name[k++] = c;
	}
	name[k] = 0;
	asset_name_canonicalize(name, out);
	return out;
}

static int locate_embedded(struct gltf *g, const struct gltf_entry *entry, const char *uri, struct gltf_range *out)
{
	struct gltf_range *located = entry->array == GLTF_BUFFERS ? g->buffers : g->images;
	if (located[entry->index].file) {
		*out = located[entry->index];
		return 0;
	}
	if (++g->embedded_count > GLTF_EMBEDDED_MAX)
		return gltf_fail(g, entry, E2BIG, "more than %d buffers and images are embedded", GLTF_EMBEDDED_MAX);
	const char *comma = strchr(uri, ',');
	if (!comma || comma - uri < 7 || memcmp(comma - 7, ";base64", 7) != 0)
		return gltf_fail(g, entry, ENOTSUP, "its embedded data is not base64");
	size_t n = strlen(comma + 1), padding = 0;
	const unsigned char *found = n ? memmem(g->bytes, g->size, comma + 1, n) : g->bytes;
	if (!found)
		return gltf_fail(g, entry, ENOTSUP, "its embedded data is written with escapes; use .glb");
	while (padding < n && comma[n - padding] == '=')
		padding++;
	*out = (struct gltf_range){g->file, (uint64_t)(found - g->bytes), n, true, (n - padding) * 3 / 4, 0};
	located[entry->index] = *out;
	return 0;
}

static int locate_uri(struct gltf *g, const struct gltf_entry *entry, const char *uri, struct gltf_range *out)
{
	if (strncmp(uri, "data:", 5) == 0)
		return locate_embedded(g, entry, uri, out);
	static const char file_scheme[] = "file://";
	if (strncmp(uri, file_scheme, sizeof file_scheme - 1) == 0 && uri[sizeof file_scheme - 1] == '/')
		uri += sizeof file_scheme - 1;
	else if (strstr(uri, "://"))
		return gltf_fail(g, entry, ENOTSUP, "\"%.64s\": files come from the scene's folder, not from a network",
				 uri);
	*out = (struct gltf_range){.file = uri_file_name(g, entry, uri), .byte_count = UINT64_MAX, .size = UINT64_MAX};
	return g->error_code;
}

static int locate_buffer(struct gltf *g, const struct gltf_entry *buffer, struct gltf_range *out)
{
	const char *uri = gltf_string(g, buffer, buffer->json, "uri", NULL);
	uint64_t length = gltf_integer(g, buffer, buffer->json, "byteLength", 0);
	if (!uri && buffer->index > 0)
		return gltf_fail(g, buffer, EINVAL, "it has no uri");
	if (!uri)
		*out = (struct gltf_range){g->file, g->binary_offset, g->binary_size, false, g->binary_size, 0};
	else if (locate_uri(g, buffer, uri, out))
		return g->error_code;
	if (length > out->size)
		return gltf_fail(g, buffer, EINVAL, "it states %llu bytes but has %llu", (unsigned long long)length,
				 (unsigned long long)out->size);
	out->size = length;
	if (!out->is_base64)
		out->byte_count = length;
	return g->error_code;
}

int gltf_locate_buffer_view(struct gltf *g, const struct gltf_entry *view, struct gltf_range *buffer, uint64_t *first,
			    uint64_t *count)
{
	struct gltf_entry buffer_entry;
	if (gltf_meshopt_extension(g, view))
		return gltf_fail(g, view, EINVAL, "it is compressed, which only views of accessors may be");
	int rc = gltf_resolve(g, view, view->json, "buffer", GLTF_BUFFERS, &buffer_entry);
	if (rc <= 0)
		return rc ? rc : gltf_fail(g, view, EINVAL, "it has no buffer");
	*first = gltf_integer(g, view, view->json, "byteOffset", 0);
	*count = gltf_integer(g, view, view->json, "byteLength", 0);
	if (locate_buffer(g, &buffer_entry, buffer))
		return g->error_code;
	if (*first > buffer->size || *count > buffer->size - *first)
		return gltf_fail(g, view, EINVAL, "it exceeds buffers[%zu] of %llu bytes", buffer_entry.index,
				 (unsigned long long)buffer->size);
	return g->error_code;
}

int gltf_locate_image(struct gltf *g, const struct gltf_entry *image, struct gltf_range *out)
{
	struct gltf_entry view;
	struct gltf_range buffer;
	uint64_t first, count;
	const char *uri = gltf_string(g, image, image->json, "uri", NULL);
	if (uri)
		return locate_uri(g, image, uri, out);
	int rc = gltf_resolve(g, image, image->json, "bufferView", GLTF_BUFFER_VIEWS, &view);
	if (rc <= 0)
		return rc ? rc : gltf_fail(g, image, EINVAL, "it has no uri and no bufferView");
	if (gltf_locate_buffer_view(g, &view, &buffer, &first, &count))
		return g->error_code;
	*out = gltf_range_slice(&buffer, first, first + count);
	return 0;
}

struct gltf_range gltf_range_slice(const struct gltf_range *buffer, uint64_t begin, uint64_t end)
{
	struct gltf_range part = *buffer;
	part.size = end - begin;
	if (!buffer->is_base64) {
		part.first_byte += begin;
		part.byte_count = end - begin;
		return part;
	}
	part.skip_bytes = (unsigned)(begin % 3);
	part.first_byte += begin / 3 * 4;
	part.byte_count = ((end - begin + part.skip_bytes) * 4 + 2) / 3;
	return part;
}

void gltf_put_range(struct gltf *g, struct xml_element *el, const struct gltf_entry *entry, const struct gltf_range *r)
{
	gltf_put_string(g, el, entry, "filename", r->file ? r->file : "");
	if (r->byte_count == UINT64_MAX)
		return;
	gltf_put_integer(g, el, entry, "first_byte", r->first_byte);
	gltf_put_integer(g, el, entry, "byte_count", r->byte_count);
	if (r->is_base64)
		gltf_put_bool(g, el, entry, "base64", true);
	if (r->skip_bytes)
		gltf_put_integer(g, el, entry, "skip_bytes", r->skip_bytes);
}
