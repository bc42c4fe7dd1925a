/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Numbers in text. number_scan finds the end of a number itself, because strtod accepts more (hexadecimal, "inf") and
 * stops at a place that depends on the locale. With at most 15 or so digits and a small exponent the value is one exact
 * integer times or divided by one exact power of ten; any other number is converted by strtod_l in the C locale. Lists
 * are read one number at a time, each followed by its separators.
 *
 * Failures are NULL, false or -1, as the header says; the caller words the error.
 */
#include "worker/render/text/number.h"

#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* The powers of ten that a double represents exactly: with a mantissa below 2^53, a single operation rounds
 * correctly. */
static const double power_of_ten[] = {1e0,  1e1,  1e2,	1e3,  1e4,  1e5,  1e6,	1e7,  1e8,  1e9,  1e10, 1e11,
				      1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

enum { NUMBER_TEXT_MAX = 512 };

static locale_t c_locale;
static void make_locale(void)
{
	c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
}

static bool is_digit(char c)
{
	return c >= '0' && c <= '9';
}

/* Converts [first, last), which number_scan has accepted: an optional sign, digits, a point and an exponent. False
 * if it is too long or overflows. */
static bool convert_with_strtod(const char *first, const char *last, double *out)
{
	static pthread_once_t once = PTHREAD_ONCE_INIT;
	pthread_once(&once, make_locale);
	size_t n = (size_t)(last - first);
	if (n >= NUMBER_TEXT_MAX || !c_locale)
		return false;
	char text[NUMBER_TEXT_MAX];
	memcpy(text, first, n);
	text[n] = 0;
	*out = strtod_l(text, NULL, c_locale);
	return isfinite(*out);
}

struct digits {
	uint64_t mantissa;
	int exponent;  /* decimal exponent of the mantissa's last digit */
	bool is_exact; /* no digit had to be left out of the mantissa */
	bool has_digits;
};

static const char *scan_digits(const char *p, const char *end, struct digits *d, bool fraction)
{
	for (; p < end && is_digit(*p); p++) {
		d->has_digits = true;
		if (d->mantissa < (UINT64_C(1) << 53) / 10 - 1) {
			d->mantissa = d->mantissa * 10 + (uint64_t)(*p - '0');
			d->exponent -= fraction;
		} else {
			d->is_exact = false;
		}
	}
	return p;
}

const char *number_scan(const char *p, const char *end, double *out)
{
	const char *first = p;
	bool negative = false;
	if (p < end && (*p == '+' || *p == '-'))
		negative = *p++ == '-';
	struct digits d = {.is_exact = true};
	p = scan_digits(p, end, &d, false);
	if (p < end && *p == '.')
		p = scan_digits(p + 1, end, &d, true);
	if (!d.has_digits)
		return NULL;
	if (p < end && (*p == 'e' || *p == 'E')) {
		const char *q = p + 1;
		bool is_negative_exponent = false;
		if (q < end && (*q == '+' || *q == '-'))
			is_negative_exponent = *q++ == '-';
		if (q < end && is_digit(*q)) {
			int e = 0;
			for (; q < end && is_digit(*q); q++)
				if (e < 100000)
					e = e * 10 + (*q - '0');
			d.exponent += is_negative_exponent ? -e : e;
			p = q;
		}
	}
	if (!d.is_exact || d.exponent < -22 || d.exponent > 22) {
		if (!convert_with_strtod(first, p, out))
			return NULL;
		return p;
	}
	double m = (double)d.mantissa;
	m = d.exponent < 0 ? m / power_of_ten[-d.exponent] : m * power_of_ten[d.exponent];
	*out = negative ? -m : m;
	return p;
}

const char *number_scan_printed(const char *p, const char *end, double *out)
{
	static const char *const non_finite[] = {"nan", "inf", "1.#"};
	const char *word = p < end && (*p == '+' || *p == '-') ? p + 1 : p;
	for (size_t i = 0; i < sizeof non_finite / sizeof *non_finite; i++) {
		if ((size_t)(end - word) < 3 || strncasecmp(word, non_finite[i], 3) != 0)
			continue;
		while (word < end && !number_is_blank(*word))
			word++;
		*out = NAN;
		return word;
	}
	return number_scan(p, end, out);
}

const char *number_scan_int(const char *p, const char *end, int64_t *out)
{
	bool negative = false;
	if (p < end && (*p == '+' || *p == '-'))
		negative = *p++ == '-';
	if (p >= end || !is_digit(*p))
		return NULL;
	int64_t n = 0;
	for (; p < end && is_digit(*p); p++) {
		if (n > (INT64_MAX - 9) / 10)
			return NULL;
		n = n * 10 + (*p - '0');
	}
	*out = negative ? -n : n;
	return p;
}

const char *number_line_rest(const char *p, const char *end, size_t *length)
{
	const char *newline = memchr(p, '\n', (size_t)(end - p)), *last = newline ? newline : end;
	while (p < last && number_is_blank(*p))
		p++;
	while (last > p && number_is_blank(last[-1]))
		last--;
	*length = (size_t)(last - p);
	return p;
}

static const char *skip_blanks(const char *p)
{
	while (number_is_blank(*p))
		p++;
	return p;
}

/* Reads a number of a scene file; a trailing "f", which some programs write as in C, is skipped: "0.5f" is 0.5. */
static const char *scan_scene_number(const char *p, const char *end, double *out)
{
	const char *rest = number_scan(p, end, out);
	return rest && rest < end && (*rest == 'f' || *rest == 'F') ? rest + 1 : rest;
}

bool number_parse(const char *text, double *out)
{
	text = skip_blanks(text);
	const char *rest = scan_scene_number(text, text + strlen(text), out);
	return rest && *skip_blanks(rest) == 0;
}

bool number_parse_int(const char *text, int64_t *out)
{
	text = skip_blanks(text);
	const char *rest = number_scan_int(text, text + strlen(text), out);
	return rest && *skip_blanks(rest) == 0;
}

/* Returns the position after any blanks and separators. Like Mitsuba, treats several separators in a row as one. */
static const char *skip_separators(const char *p, const char *separators)
{
	while (number_is_blank(*p) || (*p && strchr(separators, *p)))
		p++;
	return p;
}

static int parse_list(const char *text, const char *separators, double *out, size_t max)
{
	const char *end = text + strlen(text), *p = skip_separators(text, separators);
	size_t n = 0;
	while (p < end) {
		const char *rest = n < max ? scan_scene_number(p, end, &out[n]) : NULL;
		if (!rest)
			return -1;
		n++;
		p = skip_separators(rest, separators);
		if (p == rest && p < end)
			return -1;
	}
	return (int)n;
}

int number_parse_list(const char *text, double *out, size_t max)
{
	return parse_list(text, ",", out, max);
}

int number_parse_weights(const char *text, double *out, size_t max)
{
	return parse_list(text, ",;", out, max);
}
