/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/id_table.h"

#include "common/base/spelling.h"
#include "worker/render/plugin/plugin.h"

#include <stdlib.h>
#include <string.h>

enum { COMPARISONS_MAX = 1 << 20 };

static int compare_ids(const void *a, const void *b)
{
	const struct id_entry *x = a, *y = b;
	return strcmp(x->id, y->id);
}

bool id_table_is_never_node(const struct xml_element *el)
{
	return strcmp(el->name, "subsurface") == 0 || strcmp(el->name, "field") == 0;
}

bool id_table_can_name(const struct xml_element *el)
{
	enum plugin_class cls;
	if (el->is_ignored || !xml_attribute_value(el, "id"))
		return false;
	return plugin_class_find(el->name, &cls) ||
	       (strcmp(el->name, "spectrum") == 0 && xml_attribute_value(el, "type")) || id_table_is_never_node(el);
}

struct xml_element *id_table_lookup(const struct id_table *t, const char *id)
{
	struct id_entry key = {id, NULL};
	const struct id_entry *found = bsearch(&key, t->entries, t->count, sizeof key, compare_ids);
	return found ? found->element : NULL;
}

int id_table_resolve(struct id_table *t, const struct xml_element *el, struct xml_element **out, struct error *e)
{
	const char *id = xml_attribute_value(el, "id");
	if (!id)
		return element_refuse_missing_attribute(el, "id", e);
	if ((*out = id_table_lookup(t, id)))
		return 0;
	if (t->is_incomplete || el->is_unset)
		return REPORT_ALREADY_REPORTED;
	char hint[128];
	struct spelling s = {.wanted_name = id};
	for (size_t i = 0; i < t->count && t->comparison_count < COMPARISONS_MAX; i++, t->comparison_count++)
		spelling_offer(&s, t->entries[i].id);
	return xml_error(el, e, ENOENT, "there is no object with id \"%.64s\"%s", id,
			 spelling_hint(&s, hint, sizeof hint));
}

static struct xml_element *next_element(struct xml_element *el)
{
	if (el->first_child)
		return el->first_child;
	while (el && !el->next_sibling)
		el = el->parent;
	return el ? el->next_sibling : NULL;
}

static int check_unique(const struct id_table *t, struct report *report, struct error *e)
{
	qsort(t->entries, t->count, sizeof *t->entries, compare_ids);
	int r = 0;
	for (size_t i = 1; i < t->count && !r; i++) {
		const struct xml_element *a = t->entries[i - 1].element, *b = t->entries[i].element;
		if (strcmp(t->entries[i - 1].id, t->entries[i].id) == 0) {
			bool b_comes_later = b->line > a->line;
			r = xml_error(b_comes_later ? b : a, e, EINVAL,
				      "the id \"%.64s\" is given twice (also in %s:%d)", t->entries[i].id, a->file,
				      b_comes_later ? a->line : b->line);
			r = report_problem(report, r, e);
		}
	}
	return r;
}

/* Adds an alias to the table. It may refer to an earlier alias. */
static int read_alias(struct id_table *t, const struct xml_element *el, struct error *e)
{
	const char *alias = xml_attribute_value(el, "as");
	struct xml_element *target;
	if (el->is_unset)
		return REPORT_ALREADY_REPORTED;
	if (!alias)
		return element_refuse_missing_attribute(el, "as", e);
	int r = element_check_contents(el, "id|as", false, e);
	if (!r)
		r = id_table_resolve(t, el, &target, e);
	if (r)
		return r;
	size_t slot = t->count;
	while (slot > 0 && strcmp(t->entries[slot - 1].id, alias) > 0)
		slot--;
	if (slot > 0 && strcmp(t->entries[slot - 1].id, alias) == 0)
		return xml_error(el, e, EINVAL, "the id \"%.64s\" is given twice (also in %s:%d)", alias,
				 t->entries[slot - 1].element->file, t->entries[slot - 1].element->line);
	memmove(t->entries + slot + 1, t->entries + slot, (t->count - slot) * sizeof *t->entries);
	t->entries[slot] = (struct id_entry){alias, target};
	t->count++;
	return 0;
}

int id_table_build(struct id_table *t, const struct xml_tree *tree, struct arena *arena, struct report *report,
		   struct error *e)
{
	enum { ALIASES_MAX = 256 };
	size_t n = 0, aliases = 0;
	for (struct xml_element *el = tree->root; el; el = next_element(el))
		n += xml_attribute_value(el, "id") != NULL;
	t->entries = arena_alloc(arena, n, sizeof *t->entries);
	if (!t->entries)
		return error_set(e, ENOMEM, "out of memory, or the scene files take too much of it");
	for (struct xml_element *el = tree->root; el; el = next_element(el))
		if (id_table_can_name(el))
			t->entries[t->count++] = (struct id_entry){xml_attribute_value(el, "id"), el};
	t->is_incomplete = tree->has_missing_files;
	int r = check_unique(t, report, e);
	for (struct xml_element *el = tree->root; el && !r; el = next_element(el)) {
		if (el->is_ignored || strcmp(el->name, "alias") != 0)
			continue;
		if (++aliases > ALIASES_MAX)
			return report_problem(report, xml_error(el, e, E2BIG, "more than %d aliases", ALIASES_MAX), e);
		r = read_alias(t, el, e);
		t->is_incomplete |= r != 0;
		r = report_problem(report, r, e);
	}
	return r;
}
