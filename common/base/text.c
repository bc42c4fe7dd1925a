/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Short texts: checking and cleaning UTF-8 by the table of well-formed sequences (Unicode, section 3.9), reading
 * numbers with units (strtod, then a letter), and printing into fixed-size arrays without cutting inside a character.
 * Nothing allocates.
 *
 * Functions that read return false for malformed text. Functions that print cut a text that does not fit; that is no
 * error.
 */
#include "common/base/text.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

size_t text_utf8_length(const unsigned char *p)
{
	if (p[0] < 0x80)
		return 1;
	size_t n = p[0] >= 0xF0 ? 4 : p[0] >= 0xE0 ? 3 : 2;
	if (p[0] < 0xC2 || p[0] > 0xF4)
		return 0;
	for (size_t i = 1; i < n; i++)
		if ((p[i] & 0xC0) != 0x80)
			return 0;
	if ((p[0] == 0xE0 && p[1] < 0xA0) || (p[0] == 0xED && p[1] > 0x9F) || (p[0] == 0xF0 && p[1] < 0x90) ||
	    (p[0] == 0xF4 && p[1] > 0x8F))
		return 0;
	return n;
}

/* Control characters are those of ASCII and U+0080 to U+009F; terminals understand U+009B, like escape, as the start of
 * a command. */
static bool is_control(const unsigned char *p)
{
	return p[0] < 32 || p[0] == 127 || (p[0] == 0xC2 && p[1] < 0xA0);
}

bool text_is_clean(const char *text)
{
	size_t n;
	for (const unsigned char *p = (const unsigned char *)text; *p; p += n) {
		n = text_utf8_length(p);
		if (n == 0 || is_control(p))
			return false;
	}
	return true;
}

void text_clean(char *text)
{
	size_t n;
	for (unsigned char *p = (unsigned char *)text; *p; p += n ? n : 1) {
		n = text_utf8_length(p);
		if (n == 0)
			*p = '?';
		else if (is_control(p))
			memset(p, ' ', n);
	}
}

/* Returns the length of a text of n bytes without an incomplete UTF-8 sequence at its end. */
static size_t complete_length(const char *text, size_t n)
{
	size_t start = n;
	while (start && n - start < 4 && ((unsigned char)text[start - 1] & 0xC0) == 0x80)
		start--;
	if (start == 0 || (unsigned char)text[start - 1] < 0xC0)
		return n;
	start--;
	return text_utf8_length((const unsigned char *)text + start) ? n : start;
}

void text_copy(char *out, size_t size, const char *from)
{
	size_t n = strlen(from);
	if (n >= size) {
		n = size - 1;
		while (n && ((unsigned char)from[n] & 0xC0) == 0x80)
			n--;
	}
	memmove(out, from, n);
	out[n] = 0;
}

/* Prints and returns the length of the text in `out`; *cut: not all of it fitted. */
__attribute__((format(printf, 4, 0))) static size_t print_truncated(char *out, size_t size, bool *cut,
								    const char *format, va_list ap)
{
	int n = vsnprintf(out, size, format, ap);
	size_t used = n < 0 ? 0 : (size_t)n;
	*cut = used >= size;
	if (*cut && size) {
		used = complete_length(out, size - 1);
		out[used] = 0;
	}
	return used;
}

void text_print(char *out, size_t size, const char *format, ...)
{
	bool cut;
	va_list ap;
	va_start(ap, format);
	print_truncated(out, size, &cut, format, ap);
	va_end(ap);
}

void text_appendf(struct text *t, const char *format, ...)
{
	bool cut;
	va_list ap;
	if (t->remaining == 0)
		return;
	va_start(ap, format);
	size_t used = print_truncated(t->end, t->remaining, &cut, format, ap);
	va_end(ap);
	t->end += used;
	t->remaining = cut ? 1 : t->remaining - used;
}

bool text_parse_ratio(const char *text, double *ratio)
{
	char *end;
	double x = strtod(text, &end);
	if (end != text && *end == '%') {
		x /= 100;
		end++;
	}
	if (end == text || *end || !isfinite(x))
		return false;
	*ratio = x;
	return true;
}

/* Reads a non-negative number, and at most one letter of `units`, which selects the factor at the same index. */
static bool parse_number_and_unit(const char *text, const char *units, const double *factors, double *number,
				  double *factor)
{
	char *end;
	if ((!(*text >= '0' && *text <= '9') && *text != '.') || text[strcspn(text, "xX")])
		return false;
	double x = strtod(text, &end);
	const char *unit = *end ? strchr(units, *end) : NULL;
	if (end == text || (*end && (!unit || end[1])))
		return false;
	*number = x;
	*factor = unit ? factors[unit - units] : 1;
	return isfinite(x * *factor);
}

static bool parse_with_unit(const char *text, const char *units, const double *factors, double *value)
{
	double number, factor;
	if (!parse_number_and_unit(text, units, factors, &number, &factor))
		return false;
	*value = number * factor;
	return true;
}

bool text_parse_count(const char *text, uint64_t *count)
{
	static const double thousands[] = {1e3, 1e3, 1e6, 1e9};
	if (text[strspn(text, "0123456789")] == 0) { /* digits alone: exact also beyond 2^53 */
		errno = 0;
		unsigned long long n = strtoull(text, NULL, 10);
		*count = n;
		return *text && !errno;
	}
	double number, factor;
	if (!parse_number_and_unit(text, "kKMG", thousands, &number, &factor))
		return false;
	/* 1.001 times 1000 is not 1001 in floating point. 1.001k is accepted as 1001 because 1001 / 1000 is 1.001. */
	double x = rint(number * factor);
	if ((x != number * factor && x / factor != number) || x >= 0x1p63)
		return false;
	*count = (uint64_t)x;
	return true;
}

bool text_parse_counts(const char *text, const char *separators, uint32_t *out, size_t count)
{
	const char *next = text;
	for (size_t i = 0; i < count; i++) {
		char number[32], ends[] = {i + 1 < count ? separators[i] : 0, 0};
		size_t n = strcspn(next, ends);
		uint64_t x;
		if (n >= sizeof number || (*ends && !next[n]))
			return false;
		memcpy(number, next, n);
		number[n] = 0;
		if (!text_parse_count(number, &x) || x > UINT32_MAX)
			return false;
		out[i] = (uint32_t)x;
		next += n + 1;
	}
	return true;
}

bool text_parse_time(const char *text, double unit, double *seconds)
{
	static const double units[] = {1, 60, 3600, 86400};
	bool bare = text[strcspn(text, "smhd")] == 0;
	return parse_with_unit(text, "smhd", units, seconds) && (!bare || isfinite(*seconds *= unit));
}

bool text_parse_bytes(const char *text, double unit, double *bytes)
{
	static const double units[] = {1e3, 1e3, 1e6, 1e6, 1e9, 1e9, 1e12, 1e12};
	char plain[40];
	size_t n = strlen(text);
	if (n == 0 || n >= sizeof plain)
		return false;
	memcpy(plain, text, n + 1);
	if (n > 1 && plain[n - 1] == 'B' && strchr("kKmMgGtT", plain[n - 2]))
		plain[n - 1] = 0;
	bool bare = plain[strcspn(plain, "kKmMgGtT")] == 0;
	return parse_with_unit(plain, "kKmMgGtT", units, bytes) && (!bare || isfinite(*bytes *= unit));
}

bool text_is_among(const char *text, const char *const *list, size_t count)
{
	for (size_t i = 0; i < count; i++)
		if (strcmp(text, list[i]) == 0)
			return true;
	return false;
}

void text_join_lines(char *out, size_t size, const char *const *texts, size_t count)
{
	enum { MORE_SIZE = 40 }; /* bytes of "\nand N more" */
	size_t used = 0;
	*out = 0;
	for (size_t i = 0; i < count; i++) {
		size_t n = strlen(texts[i]) + (i > 0), rest = i + 1 < count ? MORE_SIZE : 0;
		if (used + n + rest >= size) {
			text_print(out + used, size - used, "%sand %zu more", i ? "\n" : "", count - i);
			return;
		}
		text_print(out + used, size - used, "%s%s", i ? "\n" : "", texts[i]);
		used += strlen(out + used);
	}
}

char *text_unconst(const char *text)
{
	union {
		const char *from;
		char *to;
	} u = {text};
	return u.to;
}
