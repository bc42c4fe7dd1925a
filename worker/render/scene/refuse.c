/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/refuse.h"

#include "common/base/spelling.h"
#include "worker/render/gltf/gltf.h"
#include "worker/render/scene/lenient.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/scene/value.h"

#include <stdio.h>
#include <string.h>

/* Writes what --lenient does instead, as "; --lenient ...", or "". */
static const char *lenient_hint(const struct xml_element *el, enum plugin_class cls, const char *type, char *text,
				size_t size)
{
	const char *stand_in;
	switch (lenient_element_action(el, cls, type, &stand_in)) {
	case LENIENT_LEAVE_OUT:
		snprintf(text, size, "; --lenient leaves it out");
		break;
	case LENIENT_REPLACE:
		snprintf(text, size, "; --lenient uses `%s` instead", stand_in);
		break;
	case LENIENT_INNER:
		snprintf(text, size, "; --lenient uses the %s inside it%s%s%s instead", plugin_class_name(cls),
			 stand_in ? ", or `" : "", stand_in ? stand_in : "", stand_in ? "`," : "");
		break;
	default:
		*text = 0;
	}
	return text;
}

/* Returns the name in this scene language of an element that other programs, or people, call differently; NULL if none
 * is known. */
static const char *element_synonym(const char *name)
{
	static const struct {
		const char *synonym, *element;
	} names[] = {
		{"bool", "boolean"},	  {"int", "integer"},	 {"double", "float"},  {"number", "float"},
		{"str", "string"},	  {"text", "string"},	 {"color", "rgb"},     {"colour", "rgb"},
		{"material", "bsdf"},	  {"brdf", "bsdf"},	 {"light", "emitter"}, {"lamp", "emitter"},
		{"luminaire", "emitter"}, {"camera", "sensor"},	 {"mesh", "shape"},    {"object", "shape"},
		{"image", "texture"},	  {"define", "default"},
	};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (strcmp(names[i].synonym, name) == 0)
			return names[i].element;
	return NULL;
}

int refuse_element(const struct xml_element *el, struct error *e)
{
	char hint[128];
	if (strcmp(el->name, "subsurface") == 0)
		return xml_error(el, e, EINVAL,
				 "subsurface scattering is not supported; --lenient leaves it out, or "
				 "gives a diffuse base to the plastic above a dipole");
	if (strcmp(el->name, "field") == 0)
		return xml_error(el, e, EINVAL, "fields are not supported; --lenient leaves them out");
	struct spelling s = {.wanted_name = el->name};
	plugin_offer_classes(&s);
	value_offer_elements(&s);
	spelling_offer(&s, "ref");
	spelling_offer(&s, "include");
	spelling_offer(&s, "default");
	spelling_offer(&s, "alias");
	spelling_offer(&s, "path");
	const char *synonym = element_synonym(el->name), *parent_name = el->parent ? el->parent->name : "";
	if (synonym)
		s.best_match = synonym;
	else if (s.best_match && strcmp(s.best_match, el->name) == 0) /* right name, wrong place */
		return xml_error(el, e, EINVAL, "has no place in <%.64s>", parent_name);
	return xml_error(el, e, EINVAL, "there is no element of this name%s",
			 s.best_match ? spelling_hint(&s, hint, sizeof hint) : "; --lenient leaves it out");
}

/* Offers the types of a class, unless a type is known to be right, or is no name but an image format. */
static void offer_types(const struct plugin_decl *decls, const struct xml_element *el, enum plugin_class cls,
			struct spelling *s)
{
	if (!(cls == PLUGIN_TEXTURE && gltf_is_file_name(el->file)) && !plugin_is_known_to_mitsuba(cls, s->wanted_name))
		plugin_offer_types(decls, cls, s);
}

const struct plugin_decl *refuse_guess_type(const struct plugin_decl *decls, const struct xml_element *el,
					    enum plugin_class cls, const char *type)
{
	struct spelling s = {.wanted_name = type};
	offer_types(decls, el, cls, &s);
	return s.best_match ? plugin_find(decls, cls, s.best_match) : NULL;
}

int refuse_type(const struct plugin_decl *decls, const struct xml_element *el, enum plugin_class cls, const char *type,
		struct error *e)
{
	char hint[128], similar[128] = "", checked[96] = "", list[512];
	struct spelling s = {.wanted_name = type};
	if (cls == PLUGIN_TEXTURE && gltf_is_file_name(el->file)) /* an extension, whose name is the image's format */
		return xml_error(el, e, ENOTSUP, "images of %.64s are not supported; export PNG, JPEG or WebP%s", type,
				 LENIENT_TEXTURE_HINT);
	offer_types(decls, el, cls, &s);
	plugin_list_types(decls, cls, list, sizeof list);
	if (plugin_is_known_to_mitsuba(cls, type))
		return xml_error(el, e, EINVAL, "this %s of Mitsuba's is not supported%s (supported: %s)",
				 plugin_class_name(cls), lenient_hint(el, cls, type, hint, sizeof hint), list);
	spelling_hint(&s, similar, sizeof similar);
	if (s.best_match && el->first_child)
		snprintf(checked, sizeof checked, "its content is checked as that of `%.48s`; ", s.best_match);
	const char *lenient = lenient_hint(el, cls, type, hint, sizeof hint);
	return xml_error(el, e, EINVAL, "there is no %s of this type%s%s (%ssupported: %s)", plugin_class_name(cls),
			 similar, *similar && *lenient ? lenient + 1 : lenient, checked,
			 list); /* after a "?", no ";" */
}

/* Returns whether the shorter of two names is the first or the last words of the longer one, as `ior` is of
 * `int_ior`. */
static bool is_name_part(const char *a, const char *b)
{
	size_t n = strlen(a), m = strlen(b);
	if (n > m)
		return is_name_part(b, a);
	if (n == 0 || n == m)
		return false;
	return (b[n] == '_' && strncmp(a, b, n) == 0) || (b[m - n - 1] == '_' && strcmp(a, b + m - n) == 0);
}

const struct param *refuse_guess_parameter(const struct plugin_decl *owner, const char *name)
{
	struct spelling s = {.wanted_name = name};
	plugin_offer_params(owner, &s);
	const char *usual = lenient_param_name(owner->type, name), *best = s.best_match;
	if (!best && strcmp(usual, name) != 0)
		best = usual;
	const struct param *meant = best ? plugin_find_param(owner, best) : NULL;
	for (const struct param *p = owner->params; p && p->name && !meant; p++)
		if (p->status != PARAM_IGNORED && is_name_part(name, p->name))
			meant = p;
	return meant;
}

int refuse_property(const struct plugin_decl *owner, const char *type, const struct xml_element *el, const char *name,
		    const struct param *p, struct error *e)
{
	char list[512], hint[128] = "";
	const char *written = element_written_name(el, name);
	plugin_list_params(owner, list, sizeof list);
	if (p)
		return xml_error(el, e, EINVAL,
				 "`%.64s` of <%s type=\"%.64s\"> would change the image and is not supported; "
				 "supported: %s",
				 written, plugin_class_name(owner->cls), type, list);
	const char *value = xml_attribute_value(el, "value");
	if (gltf_is_file_name(el->file) && value && strcmp(value, ELEMENT_UNSUPPORTED) == 0)
		return xml_error(el->parent, e, ENOTSUP, "`%.64s` is not supported; --lenient leaves it out", name);
	const struct param *meant = refuse_guess_parameter(owner, name);
	struct spelling s = {.wanted_name = name, .best_match = meant ? meant->name : NULL};
	return xml_error(el, e, EINVAL, "<%s type=\"%.64s\"> has no `%.64s`%s (supported: %s)",
			 plugin_class_name(owner->cls), type, written, spelling_hint(&s, hint, sizeof hint), list);
}
