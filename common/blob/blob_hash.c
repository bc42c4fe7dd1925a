/* SPDX-License-Identifier: Apache-2.0 */
#include "common/blob/blob_hash.h"

#include <openssl/evp.h>
#include <stdio.h>
#include <string.h>

int blob_hash_bytes(const void *bytes, size_t size, struct blob_hash *out, struct error *e)
{
	unsigned n = 0;
	if (EVP_Digest(bytes, size, out->bytes, &n, EVP_sha256(), NULL) != 1 || n != BLOB_HASH_SIZE)
		return error_set(e, EIO, "SHA-256 failed");
	return 0;
}

void blob_hash_to_hex(const struct blob_hash *h, char hex[BLOB_HEX_SIZE])
{
	for (int i = 0; i < BLOB_HASH_SIZE; i++)
		snprintf(hex + 2 * i, 3, "%02x", h->bytes[i]);
}

static int hex_digit_value(char c)
{
	return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

bool blob_hash_from_hex(const char *hex, struct blob_hash *h)
{
	if (strlen(hex) != 2 * BLOB_HASH_SIZE)
		return false;
	for (int i = 0; i < BLOB_HASH_SIZE; i++) {
		int high = hex_digit_value(hex[2 * i]), low = hex_digit_value(hex[2 * i + 1]);
		if (high < 0 || low < 0)
			return false;
		h->bytes[i] = (uint8_t)(high << 4 | low);
	}
	return true;
}

bool blob_hash_equal(const struct blob_hash *a, const struct blob_hash *b)
{
	return memcmp(a->bytes, b->bytes, BLOB_HASH_SIZE) == 0;
}
