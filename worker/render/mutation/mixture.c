/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/mutation/mixture.h"

#include "common/base/spelling.h"
#include "common/base/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Weight, relative to the others, of the independent proposals added to a list without any: chains would otherwise
 * never change the length of their paths. */
#define INDEPENDENT_SHARE 0.05

/* Parses "b3c1", "b3" or "c1". */
static bool parse_forced(const char *text, size_t length, struct mutation_forced_choice *out)
{
	char copy[32];
	if (length == 0 || length >= sizeof copy)
		return false;
	memcpy(copy, text, length);
	copy[length] = 0;
	for (char *at = copy; *at;) {
		int *choice = *at == 'b' ? &out->b : *at == 'c' ? &out->c : NULL;
		if (!choice || *choice >= 0 || at[1] < '0' || at[1] > '9')
			return false;
		long v = strtol(at + 1, &at, 10);
		if (v > FULL_PATH_EDGES_MAX)
			return false;
		*choice = (int)v;
	}
	return true;
}

static int unknown_name_error(const char *text, size_t length, struct error *e)
{
	char name[64], hint[128], names[256] = "";
	struct spelling s = {.wanted_name = name};
	snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1), text);
	for (size_t i = 0; mutation_registry[i]; i++) {
		spelling_offer(&s, mutation_registry[i]->name);
		spelling_append_to_list(names, sizeof names, mutation_registry[i]->name);
	}
	return error_set(e, EINVAL, "no mutation is called '%s'%s; there are %s", name,
			 spelling_hint(&s, hint, sizeof hint), names);
}

static int parse_entry(const char *text, size_t length, struct mixture_entry *out, struct error *e)
{
	const char *equals = memchr(text, '=', length);
	size_t spec_length = equals ? (size_t)(equals - text) : length;
	const char *at = memchr(text, '@', spec_length);
	size_t name_length = at ? (size_t)(at - text) : spec_length;
	*out = (struct mixture_entry){mutation_find(text, name_length), {-1, -1}, 1};
	if (!out->ops)
		return unknown_name_error(text, name_length, e);
	if (at && !parse_forced(at + 1, spec_length - name_length - 1, &out->forced))
		return error_set(e, EINVAL, "'%.*s': a forced choice is written like %s@b3c1", (int)spec_length, text,
				 out->ops->name);
	if (equals) {
		char number[32], *end;
		size_t number_length = length - spec_length - 1;
		snprintf(number, sizeof number, "%.*s", (int)number_length, equals + 1);
		out->weight = strtod(number, &end);
		if (number_length >= sizeof number || end == number || *end || !(out->weight > 0) ||
		    !(out->weight <= 1e9))
			return error_set(e, EINVAL, "'%.*s': a weight is a number above 0", (int)length, text);
	}
	return 0;
}

static void update_totals(struct mixture *m)
{
	m->total_weight = 0;
	m->independent_index = m->count;
	for (unsigned i = m->count; i-- > 0;) {
		m->total_weight += m->entries[i].weight;
		if (m->entries[i].ops->is_independent)
			m->independent_index = i;
	}
}

int mixture_parse(const char *text, struct mixture *out, struct error *e)
{
	*out = (struct mixture){.count = 0};
	for (const char *at = text;; at++) {
		size_t n = strcspn(at, ",");
		if (out->count == BATCH_STRATEGIES)
			return error_set(e, EINVAL, "'%s': more than %d mutations", text, BATCH_STRATEGIES);
		int rc = parse_entry(at, n, &out->entries[out->count], e);
		if (rc)
			return rc;
		out->count++;
		at += n;
		if (!*at)
			break;
	}
	update_totals(out);
	if (out->independent_index < out->count)
		return 0;
	if (out->count == BATCH_STRATEGIES)
		return error_set(
			e, EINVAL,
			"'%s': independent proposals are missing and there are %d mutations already: leave one out",
			text, BATCH_STRATEGIES);
	out->entries[out->count++] = (struct mixture_entry){
		mutation_find("bidirectional", 13), {-1, -1}, INDEPENDENT_SHARE * out->total_weight};
	update_totals(out);
	return 0;
}

void mixture_print(const struct mixture *m, char text[PLAN_MUTATIONS_MAX])
{
	struct text t = {text, PLAN_MUTATIONS_MAX};
	memset(text, 0, PLAN_MUTATIONS_MAX);
	for (unsigned i = 0; i < m->count; i++) {
		const struct mixture_entry *entry = &m->entries[i];
		text_appendf(&t, "%s%s%s", i ? "," : "", entry->ops->name,
			     entry->forced.b >= 0 || entry->forced.c >= 0 ? "@" : "");
		if (entry->forced.b >= 0)
			text_appendf(&t, "b%d", entry->forced.b);
		if (entry->forced.c >= 0)
			text_appendf(&t, "c%d", entry->forced.c);
		text_appendf(&t, "=%.6g", entry->weight);
	}
}

void mixture_init_default(const struct render_summary *scene, struct mixture *out)
{
	*out = (struct mixture){.count = 0};
	for (size_t i = 0; mutation_registry[i]; i++) {
		const struct mutation_ops *ops = mutation_registry[i];
		double weight = ops->default_weight ? ops->default_weight(scene) : 0;
		if (weight > 0 && out->count < BATCH_STRATEGIES)
			out->entries[out->count++] = (struct mixture_entry){ops, {-1, -1}, weight};
	}
	update_totals(out);
}

unsigned mixture_choose(const struct mixture *m, double u)
{
	double remaining = u * m->total_weight;
	for (unsigned i = 0; i + 1 < m->count; i++) {
		if (remaining < m->entries[i].weight)
			return i;
		remaining -= m->entries[i].weight;
	}
	return m->count - 1;
}
