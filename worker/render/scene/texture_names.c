/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/texture_names.h"

#include "worker/render/xml/element_make.h"
#include "worker/render/scene/spectral.h"

#include <string.h>
#include <strings.h>

void texture_names_normalize(const struct plugin_decl *decls, struct xml_element *root)
{
	const char *type = root->is_camel_case ? NULL : xml_attribute_value(root, "type");
	if (type && strcmp(root->name, "spectrum") == 0 && plugin_find(decls, PLUGIN_TEXTURE, type))
		root->name = "texture";
	else if (type && strcmp(root->name, "texture") == 0 && spectral_is_type(type))
		root->name = "spectrum";
	for (struct xml_element *c = root->first_child; c; c = c->next_sibling)
		texture_names_normalize(decls, c);
}

/* Turns a <ref> into a copy of the spectrum, under the name, if any, that the <ref> has. */
static int replace_by_spectrum(struct xml_element *ref, const struct xml_element *spectrum, struct arena *arena,
			       struct error *e)
{
	const char *name = xml_attribute_value(ref, "name");
	struct xml_attribute *a = arena_alloc(arena, spectrum->attribute_count + 1, sizeof *a);
	if (!a)
		return xml_error(ref, e, ENOMEM, "out of memory");
	uint32_t n = 0;
	for (uint32_t i = 0; i < spectrum->attribute_count; i++)
		if (strcmp(spectrum->attributes[i].name, "name") != 0)
			a[n++] = spectrum->attributes[i];
	if (name)
		a[n++] = (struct xml_attribute){"name", name};
	ref->name = spectrum->name;
	ref->attributes = a;
	ref->attribute_count = n;
	ref->first_child = spectrum->first_child;
	ref->last_child = spectrum->last_child;
	return 0;
}

/* Returns the number of bytes that are read again for each <ref>. */
static uint64_t spectrum_bytes(const struct xml_element *spectrum)
{
	uint64_t n = 0;
	for (const struct xml_element *c = spectrum->first_child; c; c = c->next_sibling, n += sizeof *c)
		for (uint32_t i = 0; i < c->attribute_count; i++)
			n += strlen(c->attributes[i].value);
	return n;
}

static int resolve_references(struct xml_element *el, struct id_table *ids, struct arena *arena, uint64_t *bytes,
			      struct error *e)
{
	if (strcmp(el->name, "spectrum") == 0) /* contains values only; one with a <ref> is refused later */
		return 0;
	const char *id = strcmp(el->name, "ref") == 0 && !el->is_ignored ? xml_attribute_value(el, "id") : NULL;
	const struct xml_element *target = id ? id_table_lookup(ids, id) : NULL;
	if (target && strcmp(target->name, "spectrum") == 0) {
		*bytes += spectrum_bytes(target);
		if (*bytes > XML_TOTAL_BYTES_MAX)
			return xml_error(el, e, E2BIG, "spectra have more than %d MB when all references are followed",
					 XML_TOTAL_BYTES_MAX >> 20);
		return replace_by_spectrum(el, target, arena, e);
	}
	int r = 0;
	for (struct xml_element *c = el->first_child; c && !r; c = c->next_sibling)
		r = resolve_references(c, ids, arena, bytes, e);
	return r;
}

int texture_names_resolve_references(struct xml_element *root, struct id_table *ids, struct arena *arena,
				     struct error *e)
{
	uint64_t bytes = 0;
	return resolve_references(root, ids, arena, &bytes, e);
}

/* ---- pictures that bump and normal maps name themselves */

static bool is_relief(const struct xml_element *el)
{
	const char *type = strcmp(el->name, "bsdf") == 0 ? xml_attribute_value(el, "type") : NULL;
	return type && (strcasecmp(type, "bumpmap") == 0 || strcasecmp(type, "normalmap") == 0);
}

static bool is_filename(const struct xml_element *el)
{
	const char *name = strcmp(el->name, "string") == 0 && !el->is_ignored ? xml_attribute_value(el, "name") : NULL;
	return name && strcmp(name, "filename") == 0;
}

/* Turns the file name into a raw texture: normals and heights are numbers, not colours. */
static int replace_by_texture(struct xml_element *el, struct arena *arena, struct error *e)
{
	const char *file = xml_attribute_value(el, "value");
	struct xml_attribute *type = arena_alloc(arena, 1, sizeof *type);
	if (!file)
		return 0; /* refused by its reader */
	if (!type)
		return xml_error(el, e, ENOMEM, "out of memory");
	*type = (struct xml_attribute){"type", "bitmap"};
	el->name = "texture";
	el->attributes = type;
	el->attribute_count = 1;
	bool made = element_add_parameter(el, "string", "filename", file, arena) &&
		    element_add_parameter(el, "boolean", "raw", "true", arena);
	if (made)
		el->first_child->is_unset = el->is_unset;
	return made ? 0 : xml_error(el, e, ENOMEM, "out of memory");
}

int relief_files_to_textures(struct xml_element *root, struct arena *arena, struct error *e)
{
	bool in_relief = is_relief(root);
	int r = 0;
	for (struct xml_element *c = root->first_child; c && !r; c = c->next_sibling)
		r = in_relief && is_filename(c) ? replace_by_texture(c, arena, e)
						: relief_files_to_textures(c, arena, e);
	return r;
}
