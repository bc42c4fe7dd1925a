/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Mitsuba 3's reader of XML accepts what the standard does not; here it is made standard, for expat. Lines keep their
 * numbers. Pure; any thread.
 */
#ifndef WORKER_RENDER_XML_XML_TIDY_H
#define WORKER_RENDER_XML_XML_TIDY_H

#include <stddef.h>

/* A copy of *size bytes of text that expat can read, to be freed with mem_free; its length is put into *size. NULL: out
 * of memory. */
char *xml_tidy(const void *text, size_t *size);

#endif
