/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/text/text_lines.h"

#include "worker/render/text/number.h"

#include <string.h>

bool text_lines_next(struct text_lines *t, struct text_line *out)
{
	if (t->cursor >= t->end)
		return false;
	const char *newline = memchr(t->cursor, '\n', (size_t)(t->end - t->cursor)), *last = newline ? newline : t->end;
	*out = (struct text_line){.number = ++t->number};
	out->word = number_line_rest(t->cursor, last, &out->rest_length);
	while (out->word_length < out->rest_length && !number_is_blank(out->word[out->word_length]))
		out->word_length++;
	out->rest = number_line_rest(out->word + out->word_length, last, &out->rest_length);
	t->cursor = newline ? newline + 1 : t->end;
	return true;
}

bool text_line_is(const struct text_line *l, const char *word)
{
	return strlen(word) == l->word_length && memcmp(l->word, word, l->word_length) == 0;
}
