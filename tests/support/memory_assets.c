/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/memory_assets.h"

#include <stdint.h>
#include <string.h>

static int open_file(void *user, const char *name, struct asset *out, struct error *e)
{
	for (const struct memory_file *f = user; f->name; f++)
		if (strcmp(f->name, name) == 0) {
			*out = (struct asset){.bytes = f->bytes, .size = f->size};
			return 0;
		}
	return error_set(e, ENOENT, "%s: no such file", name);
}

static void close_file(void *user, struct asset *a)
{
	(void)user;
	*a = (struct asset){0};
}

struct asset_source memory_assets(const struct memory_file *files)
{
	return (struct asset_source){.user = (void *)(uintptr_t)files, .open = open_file, .close = close_file};
}
