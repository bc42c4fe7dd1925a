/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/xml/version.h"

#include "worker/render/text/number.h"

#include <stdio.h>
#include <string.h>

enum { NEWEST_MAJOR = 3, NOTE_SIZE = 256 };

bool version_parse(const char *text, int64_t *major, int64_t *minor)
{
	const char *end = text + strlen(text), *rest = number_scan_int(text, end, major);
	*minor = 0;
	if (!rest || (*rest != 0 && *rest != '.') || *major < 0)
		return false;
	if (*rest == '.' && !number_scan_int(rest + 1, end, minor))
		*minor = -1;
	return true;
}

const char *version_newer_note(const struct xml_element *el, int64_t major, struct arena *arena)
{
	char text[NOTE_SIZE];
	if (major <= NEWEST_MAJOR)
		return NULL;
	snprintf(text, sizeof text, "version=\"%.32s\" in %.160s:%d is newer than any known: read as by Mitsuba %d",
		 xml_attribute_value(el, "version"), el->file, el->line, NEWEST_MAJOR);
	return arena_strdup(arena, text);
}
