/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/given_twice.h"

#include "worker/render/scene/plugin.h"
#include "worker/render/scene/snake_case.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

int given_twice(const struct xml_element *el, const struct property *before, struct error *e)
{
	return xml_error(el, e, EINVAL, "`%s` is given twice (first in line %d)", before->name, before->line);
}

/* The name under which an earlier element of the object gives the property. */
static const char *earlier_name(const struct plugin_decl *decl, const struct xml_element *el, const char *property)
{
	char name[256];
	for (const struct xml_element *c = el->parent->first; c && c != el; c = c->next) {
		const char *written = xml_attribute(c, "name");
		if (!written || 2 * strlen(written) + 1 > sizeof name)
			continue;
		snake_case(written, name);
		if (strcmp(plugin_new_name(decl, name), property) == 0)
			return written;
	}
	return property;
}

/* The last one counts, but a texture has the place of a value in whichever order, and names of 3.x mean nothing. */
int given_again(const struct notes *t, const struct plugin_decl *decl, const struct xml_element *el,
		struct property *before, struct value v)
{
	bool was = before->value.type == VALUE_NODE, is = v.type == VALUE_NODE;
	if (was != is) {
		before->value = is ? v : before->value;
		return 0;
	}
	const char *first = earlier_name(decl, el, before->name), *second = element_spelling(el, before->name);
	bool first_new = strchr(first, '_'), second_new = strchr(second, '_');
	if (first_new == second_new && strcmp(first, second) != 0)
		return given_twice(el, before, t->error);
	bool last = !second_new || first_new;
	char key[64];
	snprintf(key, sizeof key, "twice %.48s", second);
	int r = note(t, el, decl->type, key,
		     "%s:%d: <%.64s>: `%.64s` is given twice (first in line %d); the %s counts, as in Mitsuba 0.6",
		     el->file, el->line, el->name, second, before->line, last ? "last" : "first");
	if (last)
		*before = (struct property){before->name, el->line, v};
	return r;
}
