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
static bool parse_forced(const char *text, size_t length, struct mutation_setting *how)
{
	char copy[32];
	if (length == 0 || length >= sizeof copy)
		return false;
	memcpy(copy, text, length);
	copy[length] = 0;
	for (char *at = copy; *at;) {
		int *choice = *at == 'b' ? &how->b : *at == 'c' ? &how->c : NULL;
		if (!choice || *choice >= 0 || at[1] < '0' || at[1] > '9')
			return false;
		long v = strtol(at + 1, &at, 10);
		if (v > FULL_PATH_MAX_EDGES)
			return false;
		*choice = (int)v;
	}
	return true;
}

static int name_error(const char *text, size_t length, struct error *e)
{
	char name[64], hint[128], known[256] = "";
	struct spelling s = {.wanted = name};
	snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1), text);
	for (size_t i = 0; mutation_registry[i]; i++) {
		spelling_offer(&s, mutation_registry[i]->name);
		spelling_list(known, sizeof known, mutation_registry[i]->name);
	}
	return error_set(e, EINVAL, "no mutation is called '%s'%s; there are %s", name,
			 spelling_hint(&s, hint, sizeof hint), known);
}

static int parse_entry(const char *text, size_t length, struct mixture_entry *out, struct error *e)
{
	const char *equals = memchr(text, '=', length);
	size_t left = equals ? (size_t)(equals - text) : length;
	const char *at = memchr(text, '@', left);
	size_t name = at ? (size_t)(at - text) : left;
	*out = (struct mixture_entry){mutation_find(text, name), {-1, -1}, 1};
	if (!out->ops)
		return name_error(text, name, e);
	if (at && !parse_forced(at + 1, left - name - 1, &out->how))
		return error_set(e, EINVAL, "'%.*s': a forced choice is written like %s@b3c1", (int)left, text,
				 out->ops->name);
	if (equals) {
		char number[32], *end;
		size_t digits = length - left - 1;
		snprintf(number, sizeof number, "%.*s", (int)digits, equals + 1);
		out->weight = strtod(number, &end);
		if (digits >= sizeof number || end == number || *end || !(out->weight > 0) || !(out->weight <= 1e9))
			return error_set(e, EINVAL, "'%.*s': a weight is a number above 0", (int)length, text);
	}
	return 0;
}

static void finish(struct mixture *m)
{
	m->total = 0;
	m->independent = m->count;
	for (unsigned i = m->count; i-- > 0;) {
		m->total += m->entry[i].weight;
		if (m->entry[i].ops->independent)
			m->independent = i;
	}
}

int mixture_parse(const char *text, struct mixture *out, struct error *e)
{
	*out = (struct mixture){.count = 0};
	for (const char *at = text;; at++) {
		size_t n = strcspn(at, ",");
		if (out->count == BATCH_STRATEGIES)
			return error_set(e, EINVAL, "'%s': more than %d mutations", text, BATCH_STRATEGIES);
		int rc = parse_entry(at, n, &out->entry[out->count], e);
		if (rc)
			return rc;
		out->count++;
		at += n;
		if (!*at)
			break;
	}
	finish(out);
	if (out->independent < out->count)
		return 0;
	if (out->count == BATCH_STRATEGIES)
		return error_set(
			e, EINVAL,
			"'%s': independent proposals are missing and there are %d mutations already: leave one out",
			text, BATCH_STRATEGIES);
	out->entry[out->count++] =
		(struct mixture_entry){mutation_find("bidirectional", 13), {-1, -1}, INDEPENDENT_SHARE * out->total};
	finish(out);
	return 0;
}

void mixture_print(const struct mixture *m, char text[PLAN_MUTATIONS_MAX])
{
	struct text t = {text, PLAN_MUTATIONS_MAX};
	memset(text, 0, PLAN_MUTATIONS_MAX);
	for (unsigned i = 0; i < m->count; i++) {
		const struct mixture_entry *entry = &m->entry[i];
		text_put(&t, "%s%s%s", i ? "," : "", entry->ops->name,
			 entry->how.b >= 0 || entry->how.c >= 0 ? "@" : "");
		if (entry->how.b >= 0)
			text_put(&t, "b%d", entry->how.b);
		if (entry->how.c >= 0)
			text_put(&t, "c%d", entry->how.c);
		text_put(&t, "=%.6g", entry->weight);
	}
}

void mixture_default(const struct render_summary *scene, struct mixture *out)
{
	*out = (struct mixture){.count = 0};
	for (size_t i = 0; mutation_registry[i]; i++) {
		const struct mutation_ops *ops = mutation_registry[i];
		double weight = ops->useful ? ops->useful(scene) : 0;
		if (weight > 0 && out->count < BATCH_STRATEGIES)
			out->entry[out->count++] = (struct mixture_entry){ops, {-1, -1}, weight};
	}
	finish(out);
}

unsigned mixture_choose(const struct mixture *m, double u)
{
	double rest = u * m->total;
	for (unsigned i = 0; i + 1 < m->count; i++) {
		if (rest < m->entry[i].weight)
			return i;
		rest -= m->entry[i].weight;
	}
	return m->count - 1;
}
