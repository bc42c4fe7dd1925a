/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/asset_part.h"
#include "worker/render/scene/lenient.h"

#include <string.h>

int asset_part_open(struct asset_range *p, const struct scene_node *n, const struct asset_source *assets,
		    struct error *e)
{
	struct error inner;
	const char *name = node_string(n, "filename", NULL), *text = node_string(n, "embedded", NULL);
	int rc;
	if (text) {
		*p = (struct asset_range){.bytes = (const unsigned char *)text, .size = strlen(text)};
		rc = asset_range_decode_base64(p, "embedded", &inner);
	} else if (name) {
		rc = asset_range_open(p, assets, name, (uint64_t)node_int(n, "first_byte", 0),
				      (uint64_t)node_int(n, "byte_count", -1), node_bool(n, "base64", false), &inner);
	} else {
		return node_error(n, e, EINVAL, "needs a filename");
	}
	if (rc)
		return node_error(n, e, -rc, "%s%s", inner.text,
				  rc == -ENOENT && n->cls == PLUGIN_TEXTURE ? lenient_texture_hint(inner.text) : "");
	size_t skip = (size_t)node_int(n, "skip_bytes", 0);
	skip = skip < p->size ? skip : p->size;
	p->bytes += skip;
	p->size -= skip;
	return 0;
}
