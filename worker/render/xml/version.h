/* SPDX-License-Identifier: Apache-2.0 */
/* The versions of scene files. Any thread. */
#ifndef WORKER_RENDER_XML_VERSION_H
#define WORKER_RENDER_XML_VERSION_H

#include "common/base/arena.h"
#include "worker/render/xml/element.h"

#include <stdint.h>

/* Reads "3", "3.0" or "3.0.0". *minor is 0 if the text has none, and negative if it cannot be read. Returns false if
 * there is no major version. */
bool version_parse(const char *text, int64_t *major, int64_t *minor);

/* Returns a note, from the arena, if the file that begins with el is of a version newer than any known. NULL if it is
 * not, or if out of memory: the arena, of which XML_MEMORY_MAX limits the size, then fails for what comes next, too. */
const char *version_newer_note(const struct xml_element *el, int64_t major, struct arena *arena);

#endif
