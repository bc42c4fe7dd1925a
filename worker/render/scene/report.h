/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The notes and problems found while a scene is read: everything that is ignored, each kind once, and all errors. One
 * thread; texts are allocated in the given arena.
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
	const char **notes, **problems; /* [REPORT_NOTES_MAX], [REPORT_PROBLEMS_MAX] */
	const char **note_keys;		/* for each note, its keys, one per line */
	int first_code;			/* errno of the first problem; 0: none */
	struct error first_error;
};

int report_init(struct report *r, struct arena *arena, struct error *e);

/* Adds a key to a note, which gets the new text. */
int report_extend_note(struct report *r, uint32_t note, const char *key, const char *text, struct error *e);
/* Returns whether a note with this key exists. */
bool report_has_note(const struct report *r, const char *key);

/* Adds a note. key: identifies the kind of thing, without line feeds; a second note with the same key is dropped.
 * Returns 0 or -ENOMEM. */
int report_note(struct report *r, const char *file, const char *key, struct error *e, const char *format, va_list ap);

/* Like report_note(), for a text that is already formatted. */
int report_note_text(struct report *r, const char *file, const char *key, const char *message, struct error *e);

/* Handles a failure with this `code` and the text in e. A recoverable failure is stored, and the result is 0; lack of
 * memory is not recoverable. REPORT_ALREADY_REPORTED, for a failure that was stored before, and 0 give 0. REPORT_FULL,
 * returned when there is no room for more problems, ends the reading; it is returned unchanged. */
enum { REPORT_ALREADY_REPORTED = 1, REPORT_FULL = 2 };
int report_problem(struct report *r, int code, struct error *e);
/* Like report_problem(), but does nothing if the text is already stored, because several objects refer to the one it
 * is about. */
int report_problem_once(struct report *r, int code, struct error *e);

#endif
