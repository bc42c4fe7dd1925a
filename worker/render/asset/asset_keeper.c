/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The file opened last stays open after its last user has closed it, until another file is opened. While it is in use,
 * other files are opened beside it and are not kept. Failures are those of the inner source, and -E2BIG after too many
 * bytes; if there is no memory for its name, a file is not kept.
 */
#include "worker/render/asset/asset_keeper.h"

#include "common/base/mem.h"

#include <string.h>

static void drop_asset(struct asset_keeper *k)
{
	if (k->kept_name)
		k->inner_source->close(k->inner_source->user, &k->kept_asset);
	mem_free(k->kept_name);
	k->kept_name = NULL;
}

static int keeper_open(void *user, const char *name, struct asset *out, struct error *e)
{
	struct asset_keeper *k = user;
	if (k->kept_name && strcmp(k->kept_name, name) == 0) {
		k->user_count++;
		*out = k->kept_asset;
		return 0;
	}
	if (k->user_count == 0)
		drop_asset(k); /* before the next file takes memory */
	if (k->bytes_read > ASSET_KEEPER_BYTES_MAX)
		return error_set(e, E2BIG, "%s: the scene asks for its files again and again; %llu GB were read so far",
				 name, (unsigned long long)k->bytes_read >> 30);
	int rc = k->inner_source->open(k->inner_source->user, name, out, e);
	if (!rc)
		k->bytes_read += out->size;
	if (rc || k->user_count > 0)
		return rc;
	size_t size = strlen(name) + 1;
	k->kept_name = mem_alloc(size, 1);
	if (k->kept_name) {
		memcpy(k->kept_name, name, size);
		k->kept_asset = *out;
		k->user_count = 1;
	}
	return 0;
}

static void keeper_close(void *user, struct asset *a)
{
	struct asset_keeper *k = user;
	if (k->kept_name && k->user_count > 0 && a->bytes == k->kept_asset.bytes && a->handle == k->kept_asset.handle) {
		k->user_count--;
		*a = (struct asset){0};
	} else {
		k->inner_source->close(k->inner_source->user, a);
	}
}

struct asset_source asset_keeper_source(struct asset_keeper *k)
{
	return (struct asset_source){.user = k, .open = keeper_open, .close = keeper_close};
}

void asset_keeper_fini(struct asset_keeper *k)
{
	drop_asset(k);
}
