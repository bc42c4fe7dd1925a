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
int note(const struct notes *t, const struct xml_element *el, const char *type, const char *property,
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
	const char *type = xml_attribute(owner, "type");
	return note(t, owner, type, name, "%s:%d: <%.64s type=\"%.64s\">: `%.64s` %s", el->file, el->line, owner->name,
		    type, name, what);
}

int note_no_effect(struct notes *t, const struct xml_element *owner, const struct xml_element *el, const char *name)
{
	const char *type = xml_attribute(owner, "type");
	char key[REPORT_TEXT_MAX], shown[72], text[REPORT_TEXT_MAX];
	snprintf(key, sizeof key, "%.64s/%.64s/%.64s", owner->name, type, name);
	if (report_has(t->report, key))
		return 0;
	snprintf(shown, sizeof shown, "`%.64s`", name);
	if (t->owner == owner) {
		spelling_list(t->names, sizeof t->names, shown);
		text_print(text, sizeof text,
			   "%.160s:%d: <%.32s type=\"%.64s\">: %s have no effect on light and are ignored", el->file,
			   t->line, owner->name, type, t->names);
		return report_extend(t->report, t->at, key, text, t->error);
	}
	uint32_t before = t->report->note_count;
	int r = note_parameter(t, owner, el, name, "has no effect on light and is ignored");
	if (t->report->note_count > before && t->report->note_count < REPORT_NOTES_MAX) {
		t->owner = owner;
		t->at = before;
		t->line = el->line;
		snprintf(t->names, sizeof t->names, "%s", shown);
	}
	return r;
}

int note_difference(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		    const char *name)
{
	const char *value = xml_attribute(el, "value");
	char *end;
	if (value && strtod(value, &end) == 0 && end != value && !*end)
		return 0;
	return note_parameter(t, owner, el, name, "is not supported: the image differs a little from Mitsuba's");
}

int note_guide(const struct notes *t, const struct xml_element *el)
{
	const char *type = xml_attribute(el, "type");
	return note(t, el, type, "", "%s:%d: <%.64s type=\"%.64s\"> only guides Mitsuba's sampling and is ignored",
		    el->file, el->line, el->name, type);
}

/* Returns whether the name is "maxdepth", ignoring capitals and underscores: other renderers spell their settings in
 * various ways. */
static bool is_depth(const char *name)
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
	for (el = el->first; el; el = el->next) {
		const char *name = xml_attribute(el, "name"), *value = xml_attribute(el, "value");
		if (name && value && is_depth(name) && *value >= '1' && *value <= '9' &&
		    !value[strspn(value, "0123456789")])
			return el;
	}
	return NULL;
}

int note_foreign(const struct notes *t, const struct xml_element *el)
{
	const struct xml_element *depth = stated_depth(el);
	if (depth)
		return note(
			t, el, "", "",
			"%s:%d: <%.64s> is ignored with its contents, including `%.64s`: --max-depth %.16s limits paths",
			el->file, el->line, el->name, xml_attribute(depth, "name"), xml_attribute(depth, "value"));
	const char *name = el->first ? NULL : xml_attribute(el, "name");
	if (name)
		return note(t, el, "", name, "%s:%d: <%.64s>: `%.64s` is ignored", el->file, el->line, el->name, name);
	return note(t, el, "", "", "%s:%d: <%.64s> is ignored with its contents", el->file, el->line, el->name);
}

/* Leaves out an element that is not supported, with a note. */
int leave_out(const struct notes *t, const struct xml_element *el, const char *type, const char *property,
	      const char *what)
{
	return note(t, el, type, property, "%s:%d: <%.64s>: %s `%.64s` is not supported and left out (lenient)",
		    el->file, el->line, el->name, what, *property ? property : type);
}

int note_old_name(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		  const char *name)
{
	const char *type = xml_attribute(owner, "type"), *written = xml_attribute(el, "name");
	return note(t, owner, type, written, "%s:%d: <%.64s type=\"%.64s\">: `%.64s` is read as `%.64s` (lenient)",
		    el->file, el->line, owner->name, type, written, name);
}

/* Returns whether the sampler is `independent` with nothing but a sample count: samples are independent here too, so
 * that nothing of it is ignored. */
static bool says_what_is_done(const struct xml_element *el, const char *type)
{
	if (strcmp(el->name, "sampler") != 0 || strcasecmp(type, "independent") != 0)
		return false;
	for (const struct xml_element *c = el->first; c; c = c->next) {
		const char *name = xml_attribute(c, "name");
		if (!name || (strcmp(name, "sample_count") != 0 && strcmp(name, "sampleCount") != 0))
			return false;
	}
	return true;
}

/* Lists the parameters of an object that its table does not understand. */
static void list_ignored(const struct xml_element *el, const struct plugin_decl *decl, char *list, size_t size)
{
	*list = '\0';
	for (const struct xml_element *c = el->first; c; c = c->next) {
		const char *name = value_is_element(c->name) ? xml_attribute(c, "name") : NULL;
		char snake[2 * REPORT_TEXT_MAX + 1], shown[72];
		if (!name || strlen(name) >= REPORT_TEXT_MAX)
			continue;
		if (c->snake)
			snake_case(name, snake);
		const struct param *p = plugin_param(decl, c->snake ? plugin_new_name(decl, snake) : name);
		if (p && p->status == PARAM_UNDERSTOOD)
			continue;
		snprintf(shown, sizeof shown, "`%.64s`", name);
		spelling_list(list, size, shown);
	}
}

int note_ignored_plugin(const struct notes *t, const struct xml_element *el, const struct plugin_decl *decl)
{
	char list[256], ignored[256];
	const char *type = xml_attribute(el, "type");
	if (says_what_is_done(el, type))
		return 0;
	plugin_list_params(decl, list, sizeof list);
	list_ignored(el, decl, ignored, sizeof ignored);
	return note(t, el, type, "", "%s:%d: <%.64s type=\"%.64s\"> is ignored except for: %s%s%s", el->file, el->line,
		    el->name, type, list, *ignored ? "; ignored here: " : "", ignored);
}
