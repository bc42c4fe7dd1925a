/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What Mitsuba 3's reader of XML allows and the standard does not, made standard. Lines keep their numbers. Pure; any
 * thread.
 */
#ifndef WORKER_RENDER_SCENE_XML_TIDY_H
#define WORKER_RENDER_SCENE_XML_TIDY_H

#include <stddef.h>

/* Bytes that follow from `size` bytes of text, to be freed with mem_free; their number is put into `size`. NULL: out of
 * memory. */
char *xml_tidy(const void *text, size_t *size);

#endif
