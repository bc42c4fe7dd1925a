/* SPDX-License-Identifier: Apache-2.0 */
/* SHA-256 hashes, and their hexadecimal form, which is a blob's name. Any thread. */
#ifndef COMMON_BLOB_BLOB_HASH_H
#define COMMON_BLOB_BLOB_HASH_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { BLOB_HASH_SIZE = 32, BLOB_HEX_SIZE = 65 };

struct blob_hash {
	uint8_t bytes[BLOB_HASH_SIZE];
};

int blob_hash_bytes(const void *bytes, size_t size, struct blob_hash *out, struct error *e); /* 0, or -EIO of OpenSSL */
void blob_hash_to_hex(const struct blob_hash *h, char hex[BLOB_HEX_SIZE]);
bool blob_hash_equal(const struct blob_hash *a, const struct blob_hash *b);
bool blob_hash_from_hex(const char *hex, struct blob_hash *h); /* false if it is not 64 digits 0-9 and a-f */

#endif
