/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/spelling.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static char to_lower(char c)
{
	return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

/* Returns the number of insertions, deletions, replacements and transpositions of neighbours that turn a into b
 * (optimal string alignment), ignoring case. */
static size_t edit_distance(const char *a, size_t n, const char *b, size_t m)
{
	size_t row[3][SPELLING_NAME_MAX + 1];
	size_t *before_previous = row[0], *previous = row[1], *current = row[2];
	for (size_t j = 0; j <= m; j++)
		previous[j] = before_previous[j] = j;
	for (size_t i = 1; i <= n; i++) {
		current[0] = i;
		for (size_t j = 1; j <= m; j++) {
			size_t d = previous[j - 1] + (to_lower(a[i - 1]) != to_lower(b[j - 1]));
			if (previous[j] + 1 < d)
				d = previous[j] + 1;
			if (current[j - 1] + 1 < d)
				d = current[j - 1] + 1;
			if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] &&
			    before_previous[j - 2] + 1 < d)
				d = before_previous[j - 2] + 1;
			current[j] = d;
		}
		size_t *t = before_previous;
		before_previous = previous;
		previous = current;
		current = t;
	}
	return previous[m];
}

void spelling_offer(struct spelling *s, const char *candidate)
{
	size_t n = strlen(s->wanted_name), m = strlen(candidate);
	if (n > SPELLING_NAME_MAX || m > SPELLING_NAME_MAX || n == 0)
		return;
	size_t d = edit_distance(s->wanted_name, n, candidate, m);
	size_t longest = n > m ? n : m;
	bool is_near = d <= 1 + longest / 4 && d < longest;
	if (is_near && (!s->best_match || d < s->best_distance)) {
		memcpy(s->copy, candidate, m + 1);
		s->best_match = s->copy;
		s->best_distance = d;
	}
}

const char *spelling_hint(const struct spelling *s, char *text, size_t size)
{
	if (s->best_match)
		snprintf(text, size, "; did you mean `%s`?", s->best_match);
	else
		text[0] = 0;
	return text;
}

void spelling_append_to_list(char *text, size_t size, const char *name)
{
	size_t used = strlen(text), n = strlen(name);
	if (used >= 3 && strcmp(text + used - 3, "...") == 0)
		return;
	if (used + n + 8 > size)
		name = "...";
	snprintf(text + used, size - used, "%s%s", used ? ", " : "", name);
}
