/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/xml/define.h"

#include "common/base/spelling.h"
#include "common/base/text.h"

#include <string.h>

static bool is_name_character(char c)
{
	return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

static struct define_entry *find_entry(const struct define_table *t, const char *name, size_t length)
{
	for (size_t i = 0; i < t->count; i++)
		if (strlen(t->entries[i].name) == length && memcmp(t->entries[i].name, name, length) == 0)
			return &t->entries[i];
	return NULL;
}

static int check_name(const char *name, struct error *e)
{
	for (const char *p = name; *p; p++)
		if (!is_name_character(*p))
			return error_set(e, EINVAL, "`%.64s` is not a name for a parameter: letters, digits and _ only",
					 name);
	if (!*name)
		return error_set(e, EINVAL, "a parameter without a name");
	return 0;
}

static int add_define(struct define_table *t, const char *name, const char *value, bool from_command_line,
		      struct error *e)
{
	int r = check_name(name, e);
	if (r)
		return r;
	if (t->count == DEFINE_MAX)
		return error_set(e, E2BIG, "more than %d parameters", DEFINE_MAX);
	struct define_entry entry = {arena_strdup(t->arena, name), arena_strdup(t->arena, value), from_command_line,
				     false};
	if (!entry.name || !entry.value)
		return error_set(e, ENOMEM, "out of memory");
	t->entries[t->count++] = entry;
	return 0;
}

int define_init(struct define_table *t, const struct scene_define *defines, size_t count, struct arena *arena,
		struct error *e)
{
	*t = (struct define_table){.arena = arena, .entries = arena_alloc(arena, DEFINE_MAX, sizeof *t->entries)};
	if (!t->entries)
		return error_set(e, ENOMEM, "out of memory");
	for (size_t i = 0; i < count; i++) {
		struct define_entry *duplicate = find_entry(t, defines[i].name, strlen(defines[i].name));
		if (duplicate)
			return error_set(e, EINVAL, "-D %s is given twice", duplicate->name);
		int r = add_define(t, defines[i].name, defines[i].value, true, e);
		if (r)
			return error_prefix(e, r, "-D");
	}
	return 0;
}

int define_add_default(struct define_table *t, const char *name, const char *value, struct error *e)
{
	struct define_entry *entry = find_entry(t, name, strlen(name));
	if (!entry)
		return add_define(t, name, value, false, e);
	entry->is_used = true;
	return 0;
}

static int add_missing(struct define_table *t, const char *name, struct error *e)
{
	const char *copy = arena_strdup(t->arena, name);
	if (!copy)
		return error_set(e, ENOMEM, "out of memory");
	t->missing_names[t->missing_count++] = copy;
	return 0;
}

int define_add_valueless(struct define_table *t, const char *name, struct error *e)
{
	if (t->missing_count == DEFINE_MISSING_MAX || text_is_among(name, t->missing_names, t->missing_count))
		return 0;
	return add_missing(t, name, e);
}

/* Refuses a name that is not defined. length 0: there is none at all, and `name` is what follows the $. */
static int report_undefined(struct define_table *t, const char *name, size_t length, struct error *e)
{
	char wanted[65], hint[128];
	size_t full_length = length ? length : strlen(name),
	       n = full_length < sizeof wanted - 1 ? full_length : sizeof wanted - 1;
	memcpy(wanted, name, n);
	wanted[n] = 0;
	if (t->is_incomplete || t->missing_count == DEFINE_MISSING_MAX ||
	    text_is_among(wanted, t->missing_names, t->missing_count))
		return -EEXIST;
	int r = add_missing(t, wanted, e);
	if (r)
		return r;
	if (length == 0)
		return error_set(
			e, ENOENT,
			"in `$%s` no name follows the $: write $name to insert a parameter, \\$ for the character",
			wanted);
	struct spelling s = {.wanted_name = wanted};
	for (size_t i = 0; i < t->count; i++)
		spelling_offer(&s, t->entries[i].name);
	return error_set(e, ENOENT,
			 "$%s is not defined by a <default> before this line; -D %s=VALUE gives it a value%s", wanted,
			 wanted, spelling_hint(&s, hint, sizeof hint));
}

/* Makes one pass over the text; if out is NULL, only the length is computed. */
static int expand(struct define_table *t, const char *text, bool keep_undefined, size_t size_max, char *out,
		  size_t *length, struct error *e)
{
	size_t n = 0;
	while (*text) {
		const char *piece = text;
		size_t piece_length = 1;
		if (text[0] == '\\' && text[1] == '$') { /* a literal $, written as \$ */
			piece = text + 1;
			text += 2;
		} else if (*text == '$') {
			size_t name_length = 0;
			while (is_name_character(text[1 + name_length]))
				name_length++;
			struct define_entry *entry = find_entry(t, text + 1, name_length);
			if (!entry && !keep_undefined)
				return report_undefined(t, text + 1, name_length, e);
			piece_length = 1 + name_length;
			text += piece_length;
			if (entry) {
				entry->is_used = true;
				piece = entry->value;
				piece_length = strlen(piece);
			}
		} else {
			text++;
		}
		if (piece_length > size_max - n)
			return error_set(e, E2BIG, "a value of more than %zu bytes", size_max);
		if (out)
			memcpy(out + n, piece, piece_length);
		n += piece_length;
	}
	*length = n;
	return 0;
}

int define_substitute(struct define_table *t, const char *text, bool keep_undefined, size_t size_max, const char **out,
		      struct error *e)
{
	size_t length;
	int r = expand(t, text, keep_undefined, size_max, NULL, &length, e);
	if (r)
		return r;
	char *copy = arena_alloc(t->arena, length + 1, 1);
	if (!copy)
		return error_set(e, ENOMEM, "out of memory, or the scene files take too much of it");
	*out = copy;
	return expand(t, text, keep_undefined, size_max, copy, &length, e);
}

int define_check_used(const struct define_table *t, struct error *e)
{
	for (size_t i = 0; i < t->count; i++) {
		if (!t->entries[i].is_from_command_line || t->entries[i].is_used)
			continue;
		char hint[128];
		struct spelling s = {.wanted_name = t->entries[i].name};
		for (size_t k = 0; k < t->count; k++)
			if (!t->entries[k].is_from_command_line)
				spelling_offer(&s, t->entries[k].name);
		return error_set(e, EINVAL, "-D %s: the scene has no such parameter%s", t->entries[i].name,
				 spelling_hint(&s, hint, sizeof hint));
	}
	return 0;
}
