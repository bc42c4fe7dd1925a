/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Opens the file, checks the range against its size, and decodes base64 (RFC 4648, section 4; the padding may lack).
 * Fails where the file is not there, the range leads out of it, or a letter is none of the 64.
 */
#include "worker/render/scene/asset_part.h"

#include "common/base/mem.h"

#include <string.h>

static int letter(unsigned char c)
{
	static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	const char *at = c ? strchr(letters, c) : NULL;
	return at ? (int)(at - letters) : -1;
}

/* The number of bytes; -1: it is no base64. `out` has room for three quarters of n. */
static int64_t decode(const unsigned char *text, size_t n, unsigned char *out)
{
	size_t count = 0;
	while (n > 0 && text[n - 1] == '=')
		n--;
	if (n % 4 == 1)
		return -1;
	uint32_t bits = 0;
	for (size_t i = 0; i < n; i++) {
		int x = letter(text[i]);
		if (x < 0)
			return -1;
		bits = bits << 6 | (uint32_t)x;
		if (i % 4 > 0)
			out[count++] = (unsigned char)(bits >> (6 - 2 * (i % 4)));
	}
	return (int64_t)count;
}

static int decode_part(struct asset_part *p, const struct scene_node *n, const char *name, struct error *e)
{
	p->decoded = mem_alloc(p->size / 4 * 3 + 3, 1);
	if (!p->decoded)
		return node_error(n, e, ENOMEM, "%s: out of memory", name);
	int64_t size = decode(p->bytes, p->size, p->decoded);
	if (size < 0) {
		mem_free(p->decoded);
		return node_error(n, e, EINVAL, "%s: what is embedded there is not base64", name);
	}
	p->bytes = p->decoded;
	p->size = (size_t)size;
	return 0;
}

int asset_part_open(struct asset_part *p, const struct scene_node *n, const struct asset_source *assets,
		    struct error *e)
{
	struct error inner;
	const char *name = node_string(n, "filename", NULL);
	if (!name)
		return node_error(n, e, EINVAL, "needs a filename");
	int rc = assets->open(assets->user, name, &p->file, &inner);
	if (rc)
		return node_error(n, e, -rc, "%s", inner.text);
	uint64_t first = (uint64_t)node_int(n, "first_byte", 0), size = p->file.size;
	uint64_t count = (uint64_t)node_int(n, "byte_count", first < size ? (int64_t)(size - first) : 0);
	p->bytes = p->file.bytes + first;
	p->size = (size_t)count;
	p->decoded = NULL;
	if (first > size || count > size - first)
		rc = node_error(n, e, EINVAL, "%s has %llu bytes, and not %llu from byte %llu on", name,
				(unsigned long long)size, (unsigned long long)count, (unsigned long long)first);
	else if (node_bool(n, "base64", false))
		rc = decode_part(p, n, name, e);
	if (rc)
		assets->close(assets->user, &p->file);
	return rc;
}

void asset_part_close(struct asset_part *p, const struct asset_source *assets)
{
	mem_free(p->decoded);
	assets->close(assets->user, &p->file);
}
