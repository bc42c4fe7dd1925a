/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What there is to say of a scene while it is read: what is ignored, each kind of thing once, and what is wrong, all of
 * it. One thread; texts live in the arena given.
 */
#ifndef WORKER_RENDER_SCENE_REPORT_H
#define WORKER_RENDER_SCENE_REPORT_H

#include "common/base/arena.h"
#include "common/base/error.h"

#include <stdarg.h>
#include <stdint.h>

enum { REPORT_NOTES_MAX = 256, REPORT_PROBLEMS_MAX = 1024, REPORT_TEXT_MAX = 512 };

struct report {
	struct arena *arena;
	uint32_t note_count, problem_count;
	const char **notes, **note_keys, **problems; /* REPORT_..._MAX */
	int code;				     /* of the first problem; 0: none */
	struct error first;
};

int report_init(struct report *r, struct arena *arena, struct error *e);

/* key: what kind of thing it is about; said before, it is not said again. 0 or -ENOMEM. */
int report_note(struct report *r, const char *file, const char *key, struct error *e, const char *format, va_list ap);

int report_text(struct report *r, const char *file, const char *key, const char *said, struct error *e);

/* Something failed with `code` and the text in e. What can be gone on after is kept, and 0 returned; no memory cannot.
 * 0 stays 0, and REPORT_TOLD becomes 0: it has been kept before. REPORT_FULL: there is no room for more, and reading
 * on would only take time; it stays what it is. */
enum { REPORT_TOLD = 1, REPORT_FULL = 2 };
int report_problem(struct report *r, int code, struct error *e);

#endif
