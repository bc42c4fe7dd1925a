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
	if (k->name)
		k->inner->close(k->inner->user, &k->kept);
	mem_free(k->name);
	k->name = NULL;
}

static int keeper_open(void *user, const char *name, struct asset *out, struct error *e)
{
	struct asset_keeper *k = user;
	if (k->name && strcmp(k->name, name) == 0) {
		k->users++;
		*out = k->kept;
		return 0;
	}
	if (k->users == 0)
		drop_asset(k); /* before the next file takes memory */
	if (k->read > ASSET_KEEPER_BYTES_MAX)
		return error_set(e, E2BIG, "%s: the scene asks for its files again and again; %llu GB were read so far",
				 name, (unsigned long long)k->read >> 30);
	int rc = k->inner->open(k->inner->user, name, out, e);
	if (!rc)
		k->read += out->size;
	if (rc || k->users > 0)
		return rc;
	size_t size = strlen(name) + 1;
	k->name = mem_alloc(size, 1);
	if (k->name) {
		memcpy(k->name, name, size);
		k->kept = *out;
		k->users = 1;
	}
	return 0;
}

static void keeper_close(void *user, struct asset *a)
{
	struct asset_keeper *k = user;
	if (k->name && k->users > 0 && a->bytes == k->kept.bytes && a->handle == k->kept.handle) {
		k->users--;
		*a = (struct asset){0};
	} else {
		k->inner->close(k->inner->user, a);
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
