/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/spelling.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static char lower(char c)
{
	return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c;
}

/* Returns the number of insertions, deletions, replacements and transpositions of neighbours that turn a into b
 * (optimal string alignment), ignoring case. */
static size_t edit_distance(const char *a, size_t n, const char *b, size_t m)
{
	size_t row[3][SPELLING_MOST + 1];
	size_t *two = row[0], *one = row[1], *now = row[2];
	for (size_t j = 0; j <= m; j++)
		one[j] = two[j] = j;
	for (size_t i = 1; i <= n; i++) {
		now[0] = i;
		for (size_t j = 1; j <= m; j++) {
			size_t d = one[j - 1] + (lower(a[i - 1]) != lower(b[j - 1]));
			if (one[j] + 1 < d)
				d = one[j] + 1;
			if (now[j - 1] + 1 < d)
				d = now[j - 1] + 1;
			if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && two[j - 2] + 1 < d)
				d = two[j - 2] + 1;
			now[j] = d;
		}
		size_t *t = two;
		two = one;
		one = now;
		now = t;
	}
	return one[m];
}

void spelling_offer(struct spelling *s, const char *candidate)
{
	size_t n = strlen(s->wanted), m = strlen(candidate);
	if (n > SPELLING_MOST || m > SPELLING_MOST || n == 0)
		return;
	size_t d = edit_distance(s->wanted, n, candidate, m);
	size_t longest = n > m ? n : m;
	bool near = d <= 1 + longest / 4 && d < longest;
	if (near && (!s->best || d < s->distance)) {
		memcpy(s->copy, candidate, m + 1);
		s->best = s->copy;
		s->distance = d;
	}
}

const char *spelling_hint(const struct spelling *s, char *text, size_t size)
{
	if (s->best)
		snprintf(text, size, "; did you mean `%s`?", s->best);
	else
		text[0] = 0;
	return text;
}

void spelling_list(char *text, size_t size, const char *name)
{
	size_t used = strlen(text), n = strlen(name);
	if (used >= 3 && strcmp(text + used - 3, "...") == 0)
		return;
	if (used + n + 8 > size)
		name = "...";
	snprintf(text + used, size - used, "%s%s", used ? ", " : "", name);
}
