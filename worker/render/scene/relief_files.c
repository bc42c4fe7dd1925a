/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/relief_files.h"

#include "worker/render/scene/element_make.h"

#include <errno.h>
#include <string.h>
#include <strings.h>

static bool is_relief(const struct xml_element *el)
{
	const char *type = strcmp(el->name, "bsdf") == 0 ? xml_attribute(el, "type") : NULL;
	return type && (strcasecmp(type, "bumpmap") == 0 || strcasecmp(type, "normalmap") == 0);
}

static bool is_filename(const struct xml_element *el)
{
	const char *name = strcmp(el->name, "string") == 0 && !el->ignored ? xml_attribute(el, "name") : NULL;
	return name && strcmp(name, "filename") == 0;
}

/* Normals and heights are numbers, not colours: raw. */
static int become_texture(struct xml_element *el, struct arena *arena, struct error *e)
{
	const char *file = xml_attribute(el, "value");
	struct xml_attribute *type = arena_alloc(arena, 1, sizeof *type);
	if (!file)
		return 0; /* refused by whoever reads it */
	if (!type)
		return xml_error(el, e, ENOMEM, "out of memory");
	*type = (struct xml_attribute){"type", "bitmap"};
	el->name = "texture";
	el->attributes = type;
	el->attribute_count = 1;
	bool made = element_value(el, "string", "filename", file, arena) &&
		    element_value(el, "boolean", "raw", "true", arena);
	if (made)
		el->first->unset = el->unset;
	return made ? 0 : xml_error(el, e, ENOMEM, "out of memory");
}

int relief_files_settle(struct xml_element *root, struct arena *arena, struct error *e)
{
	bool relief = is_relief(root);
	int r = 0;
	for (struct xml_element *c = root->first; c && !r; c = c->next)
		r = relief && is_filename(c) ? become_texture(c, arena, e) : relief_files_settle(c, arena, e);
	return r;
}
