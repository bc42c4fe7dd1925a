/* SPDX-License-Identifier: Apache-2.0 */
/* Short texts in fixed-size arrays. Any thread. */
#ifndef COMMON_BASE_TEXT_H
#define COMMON_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Copies a text, cut to fit, but never inside a UTF-8 sequence. */
void text_copy(char *out, size_t size, const char *from);
/* Prints a text, cut like text_copy. */
__attribute__((format(printf, 3, 4))) void text_print(char *out, size_t size, const char *format, ...);

/* Returns whether the text is UTF-8 without control characters: safe to display, send and write as JSON. */
bool text_is_clean(const char *text);
/* Returns the length of the UTF-8 sequence at p (1 to 4), or 0 if it is invalid: RFC 3629, no surrogates, shortest
 * form. */
size_t text_utf8_length(const unsigned char *p);
/* Makes a text safe in place: each invalid byte becomes '?', each control character a blank. */
void text_clean(char *text);

bool text_is_among(const char *text, const char *const *list, size_t count);

/* Casts const away, for interfaces that take `char *` but do not write: generated messages, defaults of options. */
char *text_unconst(const char *text);

/* The following functions read a number and return false if the text is malformed or the number not finite. All but
 * text_parse_ratio refuse negative numbers. */

/* Reads "0.05" or "5%". */
bool text_parse_ratio(const char *text, double *ratio);
/* Reads a whole number with decimal units: "1000", "1.5k", "2M", "1G". */
bool text_parse_count(const char *text, uint64_t *count);
/* Reads `count` numbers as text_parse_count does, the i-th followed by separators[i]: "1.5k,0,320,360". */
bool text_parse_counts(const char *text, const char *separators, uint32_t *out, size_t count);
/* Reads a time: "90s", "5m", "2h", "1d"; a plain number is in units of `unit` seconds. */
bool text_parse_time(const char *text, double unit, double *seconds);
/* Reads a size: "500M", "20GB" in powers of 1000; a plain number is in units of `unit` bytes. */
bool text_parse_bytes(const char *text, double unit, double *bytes);

/* Appends to a fixed-size array. A text that does not fit is cut like text_copy, and later texts are dropped. Start
 * with {array, size}. */
struct text {
	char *end;
	size_t remaining;
};
__attribute__((format(printf, 2, 3))) void text_appendf(struct text *t, const char *format, ...);

/* Prints the texts, one per line, without a newline at the end. If not all fit, the last line is "and N more". */
void text_join_lines(char *out, size_t size, const char *const *texts, size_t count);

#endif
