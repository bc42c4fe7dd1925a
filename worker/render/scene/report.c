/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/report.h"

#include "common/base/text.h"

#include <stdio.h>
#include <string.h>

int report_init(struct report *r, struct arena *arena, struct error *e)
{
	*r = (struct report){.arena = arena};
	r->notes = arena_alloc(arena, REPORT_NOTES_MAX, sizeof *r->notes);
	r->note_keys = arena_alloc(arena, REPORT_NOTES_MAX, sizeof *r->note_keys);
	r->problems = arena_alloc(arena, REPORT_PROBLEMS_MAX, sizeof *r->problems);
	return r->notes && r->note_keys && r->problems ? 0 : error_set(e, ENOMEM, "out of memory");
}

__attribute__((format(printf, 5, 0))) int report_note(struct report *r, const char *file, const char *key,
						      struct error *e, const char *format, va_list ap)
{
	char text[REPORT_TEXT_MAX];
	vsnprintf(text, sizeof text, format, ap);
	return report_note_text(r, file, key, text, e);
}

bool report_has_note(const struct report *r, const char *key)
{
	size_t length = strlen(key);
	for (uint32_t i = 0; i < r->note_count; i++)
		for (const char *line = r->note_keys[i]; line; line = strchr(line, '\n')) {
			line += *line == '\n';
			if (strncmp(line, key, length) == 0 && (!line[length] || line[length] == '\n'))
				return true;
		}
	return false;
}

int report_extend_note(struct report *r, uint32_t note, const char *key, const char *text, struct error *e)
{
	size_t old_length = strlen(r->note_keys[note]), key_length = strlen(key);
	char *keys = arena_alloc(r->arena, old_length + key_length + 2, 1),
	     *copy = keys ? arena_strdup(r->arena, text) : NULL;
	if (!copy)
		return error_set(e, ENOMEM, "out of memory");
	memcpy(keys, r->note_keys[note], old_length);
	keys[old_length] = '\n';
	memcpy(keys + old_length + 1, key, key_length + 1);
	text_clean(copy);
	r->note_keys[note] = keys;
	r->notes[note] = copy;
	return 0;
}

int report_note_text(struct report *r, const char *file, const char *key, const char *message, struct error *e)
{
	char text[REPORT_TEXT_MAX];
	if (r->note_count == REPORT_NOTES_MAX || report_has_note(r, key))
		return 0;
	snprintf(text, sizeof text, "%s", message);
	text_clean(text);
	if (r->note_count == REPORT_NOTES_MAX - 1)
		snprintf(text, sizeof text, "%s: more things are ignored than are listed here", file);
	const char *note = arena_strdup(r->arena, text), *copy = arena_strdup(r->arena, key);
	if (!note || !copy)
		return error_set(e, ENOMEM, "out of memory");
	r->notes[r->note_count] = note;
	r->note_keys[r->note_count++] = copy;
	return 0;
}

int report_problem(struct report *r, int code, struct error *e)
{
	if (code == 0 || code == REPORT_ALREADY_REPORTED)
		return 0;
	if (code == -ENOMEM || code == REPORT_FULL)
		return code;
	const char *text = arena_strdup(r->arena, e->text);
	if (!text)
		return error_set(e, ENOMEM, "out of memory");
	if (!r->first_code) {
		r->first_code = code;
		r->first_error = *e;
	}
	r->problems[r->problem_count++] = text;
	return r->problem_count < REPORT_PROBLEMS_MAX ? 0 : REPORT_FULL;
}

int report_problem_once(struct report *r, int code, struct error *e)
{
	for (uint32_t i = 0; i < r->problem_count && code && code != -ENOMEM; i++)
		if (strcmp(r->problems[i], e->text) == 0)
			return 0;
	return report_problem(r, code, e);
}
