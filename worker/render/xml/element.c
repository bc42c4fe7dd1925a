/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/xml/element.h"

#include "common/base/spelling.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *xml_attribute_value(const struct xml_element *el, const char *name)
{
	for (uint32_t i = 0; i < el->attribute_count; i++)
		if (strcmp(el->attributes[i].name, name) == 0)
			return el->attributes[i].value;
	return NULL;
}

const char *element_written_name(const struct xml_element *el, const char *name)
{
	const char *written = el->is_camel_case ? xml_attribute_value(el, "name") : NULL;
	return written ? written : name;
}

bool element_is_unset(const struct xml_element *el)
{
	bool unset = el->is_unset;
	for (const struct xml_element *c = el->first_child; c && !unset; c = c->next_sibling)
		unset = element_is_unset(c);
	return unset;
}

int xml_error(const struct xml_element *el, struct error *e, int errno_value, const char *format, ...)
{
	char text[768];
	va_list ap;
	va_start(ap, format);
	vsnprintf(text, sizeof text, format, ap);
	va_end(ap);
	const char *type = xml_attribute_value(el, "type");
	if (type)
		return error_set(e, errno_value, "%s:%d: <%.64s type=\"%.64s\">: %s", el->file, el->line, el->name,
				 type, text);
	return error_set(e, errno_value, "%s:%d: <%.64s>: %s", el->file, el->line, el->name, text);
}

const char *element_next_name(const char *list, char *name, size_t size)
{
	if (!*list)
		return NULL;
	size_t n = strcspn(list, "|"), k = n < size - 1 ? n : size - 1;
	memcpy(name, list, k);
	name[k] = 0;
	return list[n] ? list + n + 1 : list + n;
}

static bool is_listed(const char *list, const char *wanted, struct spelling *s)
{
	char name[64];
	while ((list = element_next_name(list, name, sizeof name))) {
		if (strcmp(name, wanted) == 0)
			return true;
		if (s)
			spelling_offer(s, name);
	}
	return false;
}

static int refuse_attribute(const struct xml_element *el, const char *allowed_attributes, const char *wanted,
			    struct error *e)
{
	char hint[128];
	struct spelling s = {.wanted_name = wanted};
	is_listed(allowed_attributes, wanted, &s);
	return xml_error(el, e, EINVAL, "has no attribute `%.64s`%s (it may have: %s)", wanted,
			 spelling_hint(&s, hint, sizeof hint), allowed_attributes);
}

int element_refuse_missing_attribute(const struct xml_element *el, const char *attribute, struct error *e)
{
	struct spelling s = {.wanted_name = attribute};
	for (uint32_t i = 0; i < el->attribute_count; i++)
		spelling_offer(&s, el->attributes[i].name);
	return xml_error(el, e, EINVAL, "needs an attribute `%s`%s%s%s", attribute, s.best_match ? ", but has `" : "",
			 s.best_match ? s.best_match : "", s.best_match ? "`" : "");
}

int element_check_contents(const struct xml_element *el, const char *allowed_attributes, bool allow_children,
			   struct error *e)
{
	for (uint32_t i = 0; i < el->attribute_count; i++)
		if (!is_listed(allowed_attributes, el->attributes[i].name, NULL))
			return refuse_attribute(el, allowed_attributes, el->attributes[i].name, e);
	if (el->has_text && !el->first_child && !xml_attribute_value(el, "value"))
		return xml_error(el, e, EINVAL, "text is not allowed here; values are given by attributes");
	if (el->first_child && !allow_children)
		return xml_error(el->first_child, e, EINVAL, "has no place in <%.64s>", el->name);
	return 0;
}
