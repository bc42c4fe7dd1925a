/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/xml/define.h"

#include "common/base/spelling.h"
#include "common/base/text.h"

#include <string.h>

static bool is_name_character(char c)
{
	return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

static struct define_entry *find(const struct define_table *t, const char *name, size_t length)
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

static int add_define(struct define_table *t, const char *name, const char *value, bool given, struct error *e)
{
	int r = check_name(name, e);
	if (r)
		return r;
	if (t->count == DEFINE_MAX)
		return error_set(e, E2BIG, "more than %d parameters", DEFINE_MAX);
	struct define_entry entry = {arena_strdup(t->arena, name), arena_strdup(t->arena, value), given, false};
	if (!entry.name || !entry.value)
		return error_set(e, ENOMEM, "out of memory");
	t->entries[t->count++] = entry;
	return 0;
}

int define_init(struct define_table *t, const struct scene_define *given, size_t count, struct arena *arena,
		struct error *e)
{
	*t = (struct define_table){.arena = arena, .entries = arena_alloc(arena, DEFINE_MAX, sizeof *t->entries)};
	if (!t->entries)
		return error_set(e, ENOMEM, "out of memory");
	for (size_t i = 0; i < count; i++) {
		struct define_entry *before = find(t, given[i].name, strlen(given[i].name));
		if (before)
			return error_set(e, EINVAL, "-D %s is given twice", before->name);
		int r = add_define(t, given[i].name, given[i].value, true, e);
		if (r)
			return error_prefix(e, r, "-D");
	}
	return 0;
}

int define_default(struct define_table *t, const char *name, const char *value, struct error *e)
{
	struct define_entry *entry = find(t, name, strlen(name));
	if (!entry)
		return add_define(t, name, value, false, e);
	entry->used = true;
	return 0;
}

static int add_missing(struct define_table *t, const char *name, struct error *e)
{
	const char *kept = arena_strdup(t->arena, name);
	if (!kept)
		return error_set(e, ENOMEM, "out of memory");
	t->missing[t->missing_count++] = kept;
	return 0;
}

int define_without_value(struct define_table *t, const char *name, struct error *e)
{
	if (t->missing_count == DEFINE_MISSING_MAX || text_is_among(name, t->missing, t->missing_count))
		return 0;
	return add_missing(t, name, e);
}

/* Refuses a name that is not defined. length 0: there is none at all, and `name` is what follows the $. */
static int refuse_unknown(struct define_table *t, const char *name, size_t length, struct error *e)
{
	char wanted[65], hint[128];
	size_t all = length ? length : strlen(name), n = all < sizeof wanted - 1 ? all : sizeof wanted - 1;
	memcpy(wanted, name, n);
	wanted[n] = 0;
	if (t->incomplete || t->missing_count == DEFINE_MISSING_MAX ||
	    text_is_among(wanted, t->missing, t->missing_count))
		return -EEXIST;
	int r = add_missing(t, wanted, e);
	if (r)
		return r;
	if (length == 0)
		return error_set(
			e, ENOENT,
			"in `$%s` no name follows the $: write $name to insert a parameter, \\$ for the character",
			wanted);
	struct spelling s = {.wanted = wanted};
	for (size_t i = 0; i < t->count; i++)
		spelling_offer(&s, t->entries[i].name);
	return error_set(e, ENOENT,
			 "$%s is not defined by a <default> before this line; -D %s=VALUE gives it a value%s", wanted,
			 wanted, spelling_hint(&s, hint, sizeof hint));
}

/* Makes one pass over the text; if out is NULL, only the length is computed. */
static int expand(struct define_table *t, const char *text, bool keep_unknown, size_t size_max, char *out,
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
			struct define_entry *entry = find(t, text + 1, name_length);
			if (!entry && !keep_unknown)
				return refuse_unknown(t, text + 1, name_length, e);
			piece_length = 1 + name_length;
			text += piece_length;
			if (entry) {
				entry->used = true;
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

int define_substitute(struct define_table *t, const char *text, bool keep_unknown, size_t size_max, const char **out,
		      struct error *e)
{
	size_t length;
	int r = expand(t, text, keep_unknown, size_max, NULL, &length, e);
	if (r)
		return r;
	char *copy = arena_alloc(t->arena, length + 1, 1);
	if (!copy)
		return error_set(e, ENOMEM, "out of memory, or the scene files take too much of it");
	*out = copy;
	return expand(t, text, keep_unknown, size_max, copy, &length, e);
}

int define_check_used(const struct define_table *t, struct error *e)
{
	for (size_t i = 0; i < t->count; i++) {
		if (!t->entries[i].given || t->entries[i].used)
			continue;
		char hint[128];
		struct spelling s = {.wanted = t->entries[i].name};
		for (size_t k = 0; k < t->count; k++)
			if (!t->entries[k].given)
				spelling_offer(&s, t->entries[k].name);
		return error_set(e, EINVAL, "-D %s: the scene has no such parameter%s", t->entries[i].name,
				 spelling_hint(&s, hint, sizeof hint));
	}
	return 0;
}
