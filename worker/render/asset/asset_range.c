/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Opens the file, checks the range against its size, and decodes base64 (RFC 4648, section 4; padding is optional).
 * Fails if the file cannot be opened, the range is not within it, or a character is not one of base64's 64.
 */
#include "worker/render/asset/asset_range.h"

#include "common/base/mem.h"

#include <string.h>

static const char base64_alphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

static int base64_digit(unsigned char c)
{
	const char *match = c ? strchr(base64_alphabet, c) : NULL;
	return match ? (int)(match - base64_alphabet) : -1;
}

void asset_range_encode_base64(const unsigned char *bytes, size_t n, char *text)
{
	for (size_t i = 0; i < n; i += 3) {
		uint32_t bits = (uint32_t)bytes[i] << 16 | (uint32_t)(i + 1 < n ? bytes[i + 1] : 0) << 8 |
				(i + 2 < n ? bytes[i + 2] : 0);
		for (int k = 0; k < 4; k++)
			*text++ = i + (size_t)k > n ? '=' : base64_alphabet[bits >> (18 - 6 * k) & 63];
	}
	*text = 0;
}

/* Returns the number of decoded bytes, or -1 if the text is not base64. `out` has room for three quarters of n. */
static int64_t decode_base64(const unsigned char *text, size_t n, unsigned char *out)
{
	size_t count = 0;
	while (n > 0 && text[n - 1] == '=')
		n--;
	if (n % 4 == 1)
		return -1;
	uint32_t bits = 0;
	for (size_t i = 0; i < n; i++) {
		int x = base64_digit(text[i]);
		if (x < 0)
			return -1;
		bits = bits << 6 | (uint32_t)x;
		if (i % 4 > 0)
			out[count++] = (unsigned char)(bits >> (6 - 2 * (i % 4)));
	}
	return (int64_t)count;
}

int asset_range_decode_base64(struct asset_range *r, const char *name, struct error *e)
{
	r->decoded = mem_alloc(r->size / 4 * 3 + 3, 1);
	if (!r->decoded)
		return error_set(e, ENOMEM, "%s: out of memory", name);
	int64_t size = decode_base64(r->bytes, r->size, r->decoded);
	if (size < 0) {
		mem_free(r->decoded);
		return error_set(e, EINVAL, "%s: the embedded data is not base64", name);
	}
	r->bytes = r->decoded;
	r->size = (size_t)size;
	return 0;
}

int asset_range_open(struct asset_range *r, const struct asset_source *assets, const char *name, uint64_t offset,
		     uint64_t count, bool base64, struct error *e)
{
	int rc = assets->open(assets->user, name, &r->file, e);
	if (rc)
		return rc;
	uint64_t size = r->file.size;
	r->is_file_open = true;
	r->decoded = NULL;
	if (count == UINT64_MAX)
		count = offset < size ? size - offset : 0;
	r->bytes = r->file.bytes + offset;
	r->size = (size_t)count;
	if (offset > size || count > size - offset)
		rc = error_set(e, EINVAL, "%s has %llu bytes, too few for %llu bytes from byte %llu on", name,
			       (unsigned long long)size, (unsigned long long)count, (unsigned long long)offset);
	else if (base64)
		rc = asset_range_decode_base64(r, name, e);
	if (rc)
		assets->close(assets->user, &r->file);
	return rc;
}

void asset_range_close(struct asset_range *r, const struct asset_source *assets)
{
	mem_free(r->decoded);
	if (r->is_file_open)
		assets->close(assets->user, &r->file);
}
