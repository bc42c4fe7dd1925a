/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Decompresses buffer views with libmeshoptimizer, except for what Debian's version lacks. Streams that the extension
 * forbids are refused first, because the library would assert, and no more memory is allocated than the compressed
 * bytes can stand for. Failures: unknown modes and filters, bytes that are not such a stream or are of a later version,
 * more than UNPACKED_BYTES_MAX bytes in one file.
 */
#include "worker/render/gltf/gltf_meshopt.h"

#include "common/base/bytes.h"
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/math/fptrap.h"
#include "worker/render/gltf/gltf_meshopt_v1.h"

#include <meshoptimizer.h>
#include <string.h>

enum { MODE_ATTRIBUTES, MODE_TRIANGLES, MODE_INDICES, MODES };
enum { FILTER_NONE, FILTER_OCTAHEDRAL, FILTER_QUATERNION, FILTER_EXPONENTIAL, FILTER_COLOR, FILTERS };
enum { STRIDE_MAX = 256 };
#define UNPACKED_BYTES_MAX (UINT64_C(512) << 20)

static const char *const mode_names[MODES] = {"ATTRIBUTES", "TRIANGLES", "INDICES"};
static const char *const filter_names[FILTERS] = {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"};

/* The largest number of bytes that one compressed byte can stand for. Two bits suffice to say that one byte of each
 * of 256 elements is unchanged; a triangle takes at least one byte, and so does an index. */
static const unsigned max_expansion[MODES] = {1024, 12, 4};

struct packed_stream {
	int mode, filter;
	uint64_t count, stride;
};

const json_t *gltf_meshopt_extension(struct gltf *g, const struct gltf_entry *view)
{
	const json_t *o = gltf_extension(g, view, view->json, "EXT_meshopt_compression");
	return o ? o : gltf_extension(g, view, view->json, "KHR_meshopt_compression");
}

/* Returns the index of the member's text in a list. */
static int find_choice(struct gltf *g, const struct gltf_entry *view, const json_t *o, const char *key,
		       const char *fallback, const char *const *names, int count)
{
	const char *text = gltf_string(g, view, o, key, fallback);
	for (int i = 0; i < count; i++)
		if (strcmp(names[i], text) == 0)
			return i;
	gltf_fail(g, view, ENOTSUP, "compressed by meshopt's %s \"%.32s\", which is not supported; compress without it",
		  key, text);
	return 0;
}

static bool is_valid(const struct packed_stream *p)
{
	if (p->mode != MODE_ATTRIBUTES)
		return p->filter == FILTER_NONE && (p->stride == 2 || p->stride == 4) &&
		       (p->mode != MODE_TRIANGLES || p->count % 3 == 0);
	if (p->stride == 0 || p->stride > STRIDE_MAX || p->stride % 4)
		return false;
	if (p->filter == FILTER_OCTAHEDRAL || p->filter == FILTER_COLOR)
		return p->stride <= 8;
	return p->filter != FILTER_QUATERNION || p->stride == 8;
}

static int decode(const struct packed_stream *p, const unsigned char *bytes, uint64_t size, unsigned char *out)
{
	switch (p->mode) {
	case MODE_TRIANGLES:
		return meshopt_decodeIndexBuffer(out, p->count, p->stride, bytes, size);
	case MODE_INDICES:
		return meshopt_decodeIndexSequence(out, p->count, p->stride, bytes, size);
	default:
		if (size > 0 && bytes[0] == GLTF_MESHOPT_V1)
			return !gltf_meshopt_v1_decode(bytes, size, p->count, p->stride, out);
		return meshopt_decodeVertexBuffer(out, p->count, p->stride, bytes, size);
	}
}

/* Decodes luma, two signed chrominances and alpha. The highest bit of alpha is a marker: it gives the number of bits
 * of all four, which are rescaled to the full range of a component. Appendix B of KHR_meshopt_compression; Debian's
 * library does not have it. */
static void decode_color_filter(const struct packed_stream *p, unsigned char *out)
{
	int width = (int)p->stride / 4, sign = 1 << (8 * width - 1), max_value = 2 * sign - 1;
	for (uint64_t i = 0; i < 4 * p->count; i += 4) {
		int x[4], stored_max = 1;
		for (unsigned k = 0; k < 4; k++)
			x[k] = (int)get_bytes(out + (i + k) * (unsigned)width, width);
		while (stored_max < x[3])
			stored_max = 2 * stored_max + 1;
		int co = (x[1] ^ sign) - sign, cg = (x[2] ^ sign) - sign, a = x[3] & stored_max / 2;
		const int rgba[4] = {x[0] + co - cg, x[0] + cg, x[0] - co - cg, 2 * a + (a & 1)};
		for (unsigned k = 0; k < 4; k++) {
			long scaled = lround((double)rgba[k] * max_value / stored_max);
			uint64_t bits = (uint64_t)(scaled < 0 ? 0 : scaled > max_value ? max_value : scaled);
			put_bytes(out + (i + k) * (unsigned)width, bits, width);
		}
	}
}

/* Applies a filter. In the library a zero vector becomes NaN, so floating-point traps are off meanwhile. */
static void decode_filter(const struct packed_stream *p, unsigned char *out)
{
	unsigned trap = fptrap_enter_library();
	if (p->filter == FILTER_OCTAHEDRAL)
		meshopt_decodeFilterOct(out, p->count, p->stride);
	else if (p->filter == FILTER_QUATERNION)
		meshopt_decodeFilterQuat(out, p->count, p->stride);
	else if (p->filter == FILTER_EXPONENTIAL)
		meshopt_decodeFilterExp(out, p->count, p->stride);
	fptrap_leave_library(trap);
	if (p->filter == FILTER_COLOR)
		decode_color_filter(p, out);
}

/* Reports undecodable bytes. The upper half of the first byte identifies the coding, the lower half its version. */
static void report_undecodable(struct gltf *g, const struct gltf_entry *view, const struct packed_stream *p,
			       const unsigned char *bytes, uint64_t size)
{
	static const unsigned codings[MODES] = {0xa, 0xe, 0xd};
	if (size > 0 && bytes[0] >> 4 == codings[p->mode] && (bytes[0] & 15u) > 1)
		gltf_fail(g, view, ENOTSUP,
			  "compressed by version %u of meshopt's %s, which is not supported; compress with "
			  "EXT_meshopt_compression",
			  bytes[0] & 15u, mode_names[p->mode]);
	else
		gltf_fail(g, view, EINVAL, "its compressed bytes are damaged");
}

unsigned char *gltf_meshopt_decode(struct gltf *g, const struct gltf_entry *view, const json_t *packed,
				   const unsigned char *bytes, uint64_t size, uint64_t *count)
{
	struct packed_stream p = {find_choice(g, view, packed, "mode", "", mode_names, MODES),
				  find_choice(g, view, packed, "filter", "NONE", filter_names, FILTERS),
				  gltf_integer(g, view, packed, "count", 0),
				  gltf_integer(g, view, packed, "byteStride", 0)};
	if (!is_valid(&p))
		gltf_fail(g, view, EINVAL, "a byteStride, filter or count that meshopt's %s cannot have",
			  mode_names[p.mode]);
	if (g->error_code)
		return NULL;
	*count = p.count * p.stride; /* at most 2^53 times STRIDE_MAX: no overflow */
	if (*count != gltf_integer(g, view, view->json, "byteLength", 0))
		gltf_fail(g, view, EINVAL, "its byteLength is not count times byteStride of what is compressed");
	else if (*count / max_expansion[p.mode] > size)
		gltf_fail(g, view, EINVAL, "%llu compressed bytes cannot stand for %llu", (unsigned long long)size,
			  (unsigned long long)*count);
	else if (*count > UNPACKED_BYTES_MAX - g->unpacked_bytes)
		gltf_fail(g, view, E2BIG, "the compressed views have more than %llu MB when decompressed",
			  (unsigned long long)UNPACKED_BYTES_MAX >> 20);
	unsigned char *out = g->error_code ? NULL : mem_alloc(*count + 1, 1);
	if (!out) {
		gltf_fail(g, view, ENOMEM, "out of memory");
		return NULL;
	}
	g->unpacked_bytes += *count;
	if (decode(&p, bytes, size, out)) {
		report_undecodable(g, view, &p, bytes, size);
		mem_free(out);
		return NULL;
	}
	decode_filter(&p, out);
	liveness_tick();
	return out;
}
