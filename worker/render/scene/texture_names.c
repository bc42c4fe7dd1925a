/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/texture_names.h"

#include "worker/render/scene/spectral.h"

#include <string.h>

void texture_names_settle(const struct plugin_decl *decls, struct xml_element *root)
{
	const char *type = root->snake ? NULL : xml_attribute(root, "type");
	if (type && strcmp(root->name, "spectrum") == 0 && plugin_find(decls, PLUGIN_TEXTURE, type))
		root->name = "texture";
	else if (type && strcmp(root->name, "texture") == 0 && spectral_is_type(type))
		root->name = "spectrum";
	for (struct xml_element *c = root->first; c; c = c->next)
		texture_names_settle(decls, c);
}
