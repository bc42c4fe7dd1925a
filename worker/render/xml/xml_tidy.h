/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Mitsuba 3 accepts XML that violates the standard; this makes it standard, for expat. Line numbers stay the same.
 * Pure; any thread.
 */
#ifndef WORKER_RENDER_XML_XML_TIDY_H
#define WORKER_RENDER_XML_XML_TIDY_H

#include <stddef.h>

/* Returns a copy of *size bytes of text that expat can read, to be freed with mem_free(), and stores its length in
 * *size. NULL if out of memory. */
char *xml_tidy(const void *text, size_t *size);

#endif
