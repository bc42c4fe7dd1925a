/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/scene_parts.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

bool scene_has_note(const struct scene *s, const char *text)
{
	for (uint32_t i = 0; i < s->note_count; i++)
		if (strstr(s->notes[i], text))
			return true;
	return false;
}

const struct scene_node *scene_find_object(const struct scene *s, const char *id)
{
	for (uint32_t i = 0; i < s->object_count; i++)
		if (s->objects[i]->id && strcmp(s->objects[i]->id, id) == 0)
			return s->objects[i];
	fail_msg("there is no %s", id);
	return NULL;
}
