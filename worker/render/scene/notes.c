/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/notes.h"

#include "common/base/spelling.h"
#include "common/base/text.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/text/snake_case.h"
#include "worker/render/scene/value.h"

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Adds one note for each kind of thing, at its first occurrence. */
int note_add(const struct notes *t, const struct xml_element *el, const char *type, const char *property,
	     const char *format, ...)
{
	char key[REPORT_TEXT_MAX];
	snprintf(key, sizeof key, "%.64s/%.64s/%.64s", el->name, type, property);
	va_list ap;
	va_start(ap, format);
	int r = report_note(t->report, el->file, key, t->error, format, ap);
	va_end(ap);
	return r;
}

int note_parameter(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		   const char *name, const char *what)
{
	const char *type = xml_attribute_value(owner, "type");
	return note_add(t, owner, type, name, "%s:%d: <%.64s type=\"%.64s\">: `%.64s` %s", el->file, el->line,
			owner->name, type, name, what);
}

int note_no_effect(struct notes *t, const struct xml_element *owner, const struct xml_element *el, const char *name)
{
	const char *type = xml_attribute_value(owner, "type");
	char key[REPORT_TEXT_MAX], quoted[72], text[REPORT_TEXT_MAX];
	snprintf(key, sizeof key, "%.64s/%.64s/%.64s", owner->name, type, name);
	if (report_has_note(t->report, key))
		return 0;
	snprintf(quoted, sizeof quoted, "`%.64s`", name);
	if (t->last_owner == owner) {
		spelling_append_to_list(t->parameter_names, sizeof t->parameter_names, quoted);
		text_print(text, sizeof text,
			   "%.160s:%d: <%.32s type=\"%.64s\">: %s have no effect on light and are ignored", el->file,
			   t->note_line, owner->name, type, t->parameter_names);
		return report_extend_note(t->report, t->note_index, key, text, t->error);
	}
	uint32_t index = t->report->note_count;
	int r = note_parameter(t, owner, el, name, "has no effect on light and is ignored");
	if (t->report->note_count > index && t->report->note_count < REPORT_NOTES_MAX) {
		t->last_owner = owner;
		t->note_index = index;
		t->note_line = el->line;
		snprintf(t->parameter_names, sizeof t->parameter_names, "%s", quoted);
	}
	return r;
}

int note_difference(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		    const char *name)
{
	const char *value = xml_attribute_value(el, "value");
	char *end;
	if (value && strtod(value, &end) == 0 && end != value && !*end)
		return 0;
	return note_parameter(t, owner, el, name, "is not supported: the image differs a little from Mitsuba's");
}

int note_guide(const struct notes *t, const struct xml_element *el)
{
	const char *type = xml_attribute_value(el, "type");
	return note_add(t, el, type, "", "%s:%d: <%.64s type=\"%.64s\"> only guides Mitsuba's sampling and is ignored",
			el->file, el->line, el->name, type);
}

/* Returns whether the name is "maxdepth", ignoring capitals and underscores: other renderers spell their settings in
 * various ways. */
static bool is_depth_name(const char *name)
{
	const char *want = "maxdepth";
	for (; *name; name++)
		if (*name != '_' && (!*want || tolower((unsigned char)*name) != *want++))
			return false;
	return !*want;
}

/* Returns the element with the depth that another renderer would take from these settings; NULL if there is none. */
static const struct xml_element *stated_depth(const struct xml_element *el)
{
	for (el = el->first_child; el; el = el->next_sibling) {
		const char *name = xml_attribute_value(el, "name"), *value = xml_attribute_value(el, "value");
		if (name && value && is_depth_name(name) && *value >= '1' && *value <= '9' &&
		    !value[strspn(value, "0123456789")])
			return el;
	}
	return NULL;
}

int note_ignored_element(const struct notes *t, const struct xml_element *el)
{
	const struct xml_element *depth = stated_depth(el);
	if (depth)
		return note_add(
			t, el, "", "",
			"%s:%d: <%.64s> is ignored with its contents, including `%.64s`: --max-depth %.16s limits paths",
			el->file, el->line, el->name, xml_attribute_value(depth, "name"),
			xml_attribute_value(depth, "value"));
	const char *name = el->first_child ? NULL : xml_attribute_value(el, "name");
	if (name)
		return note_add(t, el, "", name, "%s:%d: <%.64s>: `%.64s` is ignored", el->file, el->line, el->name,
				name);
	return note_add(t, el, "", "", "%s:%d: <%.64s> is ignored with its contents", el->file, el->line, el->name);
}

int note_unused_medium(const struct notes *t, const struct xml_element *el)
{
	return note_add(
		t, el, "medium", "",
		"%s:%d: a medium in a shape is ignored, as by Mitsuba 3, unless its name is `interior` or `exterior`",
		el->file, el->line);
}

/* Leaves out an element that is not supported, with a note. */
int note_left_out(const struct notes *t, const struct xml_element *el, const char *type, const char *property,
		  const char *what)
{
	return note_add(t, el, type, property, "%s:%d: <%.64s>: %s `%.64s` is not supported and left out (lenient)",
			el->file, el->line, el->name, what, *property ? property : type);
}

int note_old_name(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		  const char *name)
{
	const char *type = xml_attribute_value(owner, "type"), *written = xml_attribute_value(el, "name");
	return note_add(t, owner, type, written, "%s:%d: <%.64s type=\"%.64s\">: `%.64s` is read as `%.64s` (lenient)",
			el->file, el->line, owner->name, type, written, name);
}

/* Returns whether the sampler is `independent` with nothing but a sample count: samples are independent here too, so
 * that nothing of it is ignored. */
static bool is_plain_independent_sampler(const struct xml_element *el, const char *type)
{
	if (strcmp(el->name, "sampler") != 0 || strcasecmp(type, "independent") != 0)
		return false;
	for (const struct xml_element *c = el->first_child; c; c = c->next_sibling) {
		const char *name = xml_attribute_value(c, "name");
		if (!name || (strcmp(name, "sample_count") != 0 && strcmp(name, "sampleCount") != 0))
			return false;
	}
	return true;
}

/* Lists the parameters of an object that its table does not understand. */
static void list_ignored(const struct xml_element *el, const struct plugin_decl *decl, char *list, size_t size)
{
	*list = '\0';
	for (const struct xml_element *c = el->first_child; c; c = c->next_sibling) {
		const char *name = value_is_element(c->name) ? xml_attribute_value(c, "name") : NULL;
		char snake[2 * REPORT_TEXT_MAX + 1], quoted[72];
		if (!name || strlen(name) >= REPORT_TEXT_MAX)
			continue;
		if (c->is_camel_case)
			snake_case_from_camel(name, snake);
		const struct param *p =
			plugin_find_param(decl, c->is_camel_case ? plugin_current_param_name(decl, snake) : name);
		if (p && p->status == PARAM_UNDERSTOOD)
			continue;
		snprintf(quoted, sizeof quoted, "`%.64s`", name);
		spelling_append_to_list(list, size, quoted);
	}
}

int note_ignored_plugin(const struct notes *t, const struct xml_element *el, const struct plugin_decl *decl)
{
	char list[256], ignored[256];
	const char *type = xml_attribute_value(el, "type");
	if (is_plain_independent_sampler(el, type))
		return 0;
	plugin_list_params(decl, list, sizeof list);
	list_ignored(el, decl, ignored, sizeof ignored);
	return note_add(t, el, type, "", "%s:%d: <%.64s type=\"%.64s\"> is ignored except for: %s%s%s", el->file,
			el->line, el->name, type, list, *ignored ? "; ignored here: " : "", ignored);
}
