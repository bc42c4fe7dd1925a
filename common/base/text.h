/* SPDX-License-Identifier: Apache-2.0 */
/* Short texts in fixed-size arrays. Any thread. */
#ifndef COMMON_BASE_TEXT_H
#define COMMON_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Copies, truncating what does not fit, but never inside a UTF-8 sequence. */
void text_copy(char *out, size_t size, const char *from);
/* The same with a format. */
__attribute__((format(printf, 3, 4))) void text_print(char *out, size_t size, const char *format, ...);

/* UTF-8 without control characters: safe to display, send and write as JSON. */
bool text_is_clean(const char *text);
/* Length of the UTF-8 sequence at p (1 to 4), 0 if it is invalid: RFC 3629, no surrogates, shortest form. */
size_t text_utf8_length(const unsigned char *p);
/* Makes a text safe in place: invalid UTF-8 becomes '?', a control character a blank. */
void text_clean(char *text);

bool text_is_among(const char *text, const char *const *list, size_t count);

/* Casts const away for interfaces that lack it but change nothing: generated messages, constant arguments. */
char *text_borrow(const char *text);

/* "0.05" or "5%". false: not a number. */
bool text_ratio(const char *text, double *ratio);

/* A whole number with decimal units: "1000", "1.5k", "2M", "1G"; a time: "90", "90s", "5m", "2h", "1d". false:
 * malformed, not finite, negative, or not a whole number. */
bool text_count(const char *text, uint64_t *count);
/* `count` counts with these separators between them: "1.5k,0,320,360". */
bool text_counts(const char *text, const char *separators, uint32_t *out, size_t count);
/* Without a unit of its own the number is in `unit` seconds. */
bool text_time(const char *text, double unit, double *seconds);
/* "500M", "20GB": powers of 1000; a plain number is in `unit` bytes. */
bool text_bytes(const char *text, double unit, double *bytes);

/* Appends to a fixed-size array. What does not fit is truncated as above, and later text is dropped. Start with
 * {array, size}. */
struct text {
	char *at;
	size_t left;
};
__attribute__((format(printf, 2, 3))) void text_put(struct text *t, const char *format, ...);

/* The texts, one per line, without a newline at the end. Where not all fit, the last line is "and N more". */
void text_lines(char *out, size_t size, const char *const *texts, size_t count);

#endif
