/* SPDX-License-Identifier: Apache-2.0 */
/* Splits a text file, such as Wavefront's, into lines that begin with a keyword. Blanks around words are skipped.
 * Pure. */
#ifndef WORKER_RENDER_TEXT_TEXT_LINES_H
#define WORKER_RENDER_TEXT_TEXT_LINES_H

#include <stdbool.h>
#include <stddef.h>

struct text_line {
	int number;
	const char *word, *rest; /* rest: what follows the word, without the blanks around it */
	size_t word_length, rest_length;
};

struct text_lines {
	const char *cursor, *end;
	int number; /* number of the line returned last, from 1 */
};

/* Stores the next line and returns true, or returns false at the end of the text. An empty line has an empty word. */
bool text_lines_next(struct text_lines *t, struct text_line *out);
bool text_line_is(const struct text_line *l, const char *word);

#endif
