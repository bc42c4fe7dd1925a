/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/notes.h"

#include "worker/render/scene/plugin.h"

#include <stdio.h>
#include <stdlib.h>

/* One note for each kind of thing, where it is met first. */
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

int note_foreign(const struct notes *t, const struct xml_element *el)
{
	return note(t, el, "", "", "%s:%d: <%.64s> is ignored with its contents", el->file, el->line, el->name);
}

/* What is not supported goes, and that is said. */
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

int note_ignored_plugin(const struct notes *t, const struct xml_element *el, const struct plugin_decl *decl)
{
	char list[256];
	const char *type = xml_attribute(el, "type");
	plugin_list_params(decl, list, sizeof list);
	return note(t, el, type, "", "%s:%d: <%.64s type=\"%.64s\"> is ignored except for: %s", el->file, el->line,
		    el->name, type, list);
}
