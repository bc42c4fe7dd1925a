/* SPDX-License-Identifier: Apache-2.0 */
/* A file of lines that begin with a word, as Wavefront's are. Blanks around words do not count. Pure. */
#ifndef WORKER_RENDER_SCENE_TEXT_LINES_H
#define WORKER_RENDER_SCENE_TEXT_LINES_H

#include <stdbool.h>
#include <stddef.h>

struct text_line {
	int number;
	const char *word, *rest; /* the rest: without the blanks around it */
	size_t word_length, rest_length;
};

struct text_lines {
	const char *p, *end;
	int number; /* of the last line */
};

/* The next line; false: there is none. An empty one has an empty word. */
bool text_lines_next(struct text_lines *t, struct text_line *out);
bool text_line_is(const struct text_line *l, const char *word);

#endif
