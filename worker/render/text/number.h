/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Numbers in text, with a decimal point whatever the process's locale. NaN, infinity, hexadecimal numbers and values
 * that overflow are not accepted as numbers. Any thread; the only allocation is the C locale, once.
 */
#ifndef WORKER_RENDER_TEXT_NUMBER_H
#define WORKER_RENDER_TEXT_NUMBER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Each reads a number at the start of [p, end) and returns the position after it, or NULL if there is no number or
 * it overflows. Floating-point values are correctly rounded. */
const char *number_scan(const char *p, const char *end, double *out);
const char *number_scan_int(const char *p, const char *end, int64_t *out);

/* Like number_scan(), for files written by programs: the spellings of NaN and infinity that C libraries print
 * ("nan", "-nan(ind)", "inf", "1.#IND") give NaN, which the caller refuses or replaces. */
const char *number_scan_printed(const char *p, const char *end, double *out);

/* Each returns whether the whole text is one number, apart from blanks around it; number_parse() also accepts an `f`
 * after the number. */
bool number_parse(const char *text, double *out);
bool number_parse_int(const char *text, int64_t *out);

/* Reads numbers, as number_parse() accepts them, separated by blanks, commas or both. Returns their count, or -1 if
 * the text contains anything else or more than max numbers. */
int number_parse_list(const char *text, double *out, size_t max);

/* Like number_parse_list(), for the weights of mixtures, which Mitsuba 0.6 also separates by ";". */
int number_parse_weights(const char *text, double *out, size_t max);

/* Returns the rest of the line from p on, without the blanks around it, and stores its length. */
const char *number_line_rest(const char *p, const char *end, size_t *length);

static inline bool number_is_blank(char c)
{
	return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

#endif
