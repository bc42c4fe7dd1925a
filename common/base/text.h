/* SPDX-License-Identifier: Apache-2.0 */
/* Short texts in fixed arrays. Any thread. */
#ifndef COMMON_BASE_TEXT_H
#define COMMON_BASE_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Copies, cutting what does not fit, never in the middle of a UTF-8 sequence. */
void text_copy(char *out, size_t size, const char *from);
/* The same of something formatted. */
__attribute__((format(printf, 3, 4))) void text_print(char *out, size_t size, const char *format, ...);

/* UTF-8 without control characters: what may be shown, sent, and written as JSON. */
bool text_is_clean(const char *text);
/* Makes it that, in place: what is no UTF-8 becomes '?', a control character a blank. */
void text_clean(char *text);

/* The same text, for interfaces that have no const and change nothing: generated messages, arguments that are
 * constants. */
char *text_borrow(const char *text);

/* "0.05" or "5%". false: no number. A share is from 0 to 1. */
bool text_ratio(const char *text, double *ratio);
bool text_share(const char *text, double *share);

/* "1000", "1.5k", "2M", "1G": a whole number, by powers of 1000. "90", "90s", "5m", "2h", "1d": seconds. false: none of
 * these, or the number is not finite, negative, or not whole. */
bool text_count(const char *text, uint64_t *count);
bool text_seconds(const char *text, double *seconds);

/* Appends to a fixed array: what does not fit is cut as above, and nothing comes after it. Begin with {array, size}. */
struct text {
	char *at;
	size_t left;
};
__attribute__((format(printf, 2, 3))) void text_put(struct text *t, const char *format, ...);

#endif
