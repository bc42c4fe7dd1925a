/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/base/guarded_source.h"

static int guarded_open(void *user, const char *name, struct asset *out, struct error *e)
{
	struct guarded_source *g = user;
	int rc = g->inner.open(g->inner.user, name, out, e);
	if (rc)
		return rc;
	rc = output_files_check_read(g->outputs, out->device, out->inode, name, e);
	if (rc)
		g->inner.close(g->inner.user, out);
	return rc;
}

static void guarded_close(void *user, struct asset *a)
{
	struct guarded_source *g = user;
	g->inner.close(g->inner.user, a);
}

struct asset_source guarded_source(struct guarded_source *g, struct asset_source inner,
				   const struct output_files *outputs)
{
	*g = (struct guarded_source){inner, outputs};
	return (struct asset_source){.user = g,
				     .open = guarded_open,
				     .close = guarded_close,
				     .picture_cache = inner.picture_cache,
				     .obj_cache = inner.obj_cache};
}
