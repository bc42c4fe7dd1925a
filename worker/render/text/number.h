/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Numbers as text, always with a point, whatever the process's locale. NaN, infinity, hexadecimal and values that
 * overflow are not numbers. Any thread; allocates nothing (except the locale, once).
 */
#ifndef WORKER_RENDER_TEXT_NUMBER_H
#define WORKER_RENDER_TEXT_NUMBER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Reads a number at the start of [p, end) and returns what follows it; NULL: there is none. Correctly rounded. */
const char *number_scan(const char *p, const char *end, double *out);
const char *number_scan_int(const char *p, const char *end, int64_t *out);

/* The same for files written by programs: their spellings of non-numbers ("nan", "-nan(ind)", "inf", "1.#IND") give
 * NaN, which the caller refuses or replaces. */
const char *number_scan_printed(const char *p, const char *end, double *out);

/* The whole text is one number; blanks around it and an `f` after it are allowed. */
bool number_parse(const char *text, double *out);
bool number_parse_int(const char *text, int64_t *out);

/* A list of such numbers, separated by blanks, commas or both. The count, or -1 if it contains anything else or more
 * than max. */
int number_list(const char *text, double *out, size_t max);

/* The same for weights of mixtures, which Mitsuba 0.6 also separates by ";". */
int number_weights(const char *text, double *out, size_t max);

/* The rest of a line from p on, without the blanks around it. */
const char *number_line_rest(const char *p, const char *end, size_t *length);

static inline bool number_is_blank(char c)
{
	return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

#endif
