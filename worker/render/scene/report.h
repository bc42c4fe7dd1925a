/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The notes and problems found while a scene is read: ignored things, each kind once, and all errors. One thread; texts
 * are allocated in the given arena.
 */
#ifndef WORKER_RENDER_SCENE_REPORT_H
#define WORKER_RENDER_SCENE_REPORT_H

#include "common/base/arena.h"
#include "common/base/error.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>

enum { REPORT_NOTES_MAX = 256, REPORT_PROBLEMS_MAX = 1024, REPORT_TEXT_MAX = 512 };

struct report {
	struct arena *arena;
	uint32_t note_count, problem_count;
	const char **notes, **problems; /* REPORT_..._MAX */
	const char **note_keys;		/* one key per line */
	int code;			/* of the first problem; 0: none */
	struct error first;
};

int report_init(struct report *r, struct arena *arena, struct error *e);

/* Another thing joins a note, which gets the new text. */
int report_extend(struct report *r, uint32_t note, const char *key, const char *text, struct error *e);
/* Whether a note with the key is there. */
bool report_has(const struct report *r, const char *key);

/* key: identifies the kind of thing, without line feeds; a second note with the same key is dropped. 0 or -ENOMEM. */
int report_note(struct report *r, const char *file, const char *key, struct error *e, const char *format, va_list ap);

int report_text(struct report *r, const char *file, const char *key, const char *said, struct error *e);

/* A failure with `code` and the text in e. Recoverable ones are stored, and the result is 0; lack of memory is not
 * recoverable. 0 stays 0, and REPORT_TOLD becomes 0, because it has been stored before. REPORT_FULL: there is no
 * room for more, and reading on would only take time; it is returned unchanged. */
enum { REPORT_TOLD = 1, REPORT_FULL = 2 };
int report_problem(struct report *r, int code, struct error *e);
/* The same, unless the text is there already, because several objects refer to the one that it is about. */
int report_problem_once(struct report *r, int code, struct error *e);

#endif
