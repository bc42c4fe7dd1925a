/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/scene_numbers.h"

#include <ctype.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBERS_MAX = 4096, CHANGES_MAX = 3, NUMBER_BYTES = 40 };

struct span {
	const char *begin, *end;
};

static const char *const extremes[] = {
	"0",
	"-0",
	"-1",
	"1",
	"2",
	"5e-324",
	"1e-308",
	"1e-300",
	"1e-160",
	"1e-100",
	"1e-60",
	"1e-45",
	"1e-38",
	"1e-30",
	"1e-20",
	"1e-16",
	"1e-12",
	"1e-9",
	"1e-6",
	"0.9999999999999999",
	"1.0000000000000002",
	"90",
	"179.9999",
	"180",
	"360",
	"1e5",
	"1e6",
	"1e9",
	"1e12",
	"1e16",
	"1e18",
	"1e19",
	"1e20",
	"1e30",
	"1e38",
	"3e38",
	"3.5e38",
	"1e45",
	"1e60",
	"1e100",
	"1e154",
	"1e160",
	"1e300",
	"1.7976931348623157e308",
	"1e309",
	"inf",
	"nan",
	"2147483647",
	"2147483648",
	"4294967295",
	"4294967296",
	"9223372036854775807",
	"9223372036854775808",
	"18446744073709551616",
};
enum { EXTREMES = sizeof extremes / sizeof *extremes };

/* Returns the end of the number at p; NULL if none begins there. */
static const char *number_end(const char *p)
{
	const char *digits = p + (*p == '-' || *p == '+');
	digits += *digits == '.';
	if (!isdigit((unsigned char)*digits))
		return NULL;
	char *end;
	strtod(p, &end);
	return end;
}

static size_t append_numbers(const char *p, const char *end, struct span *out, size_t count)
{
	for (char previous = ' '; p < end && count < NUMBERS_MAX; previous = *p++) {
		const char *last = isalnum((unsigned char)previous) || strchr("_$#", previous) ? NULL : number_end(p);
		if (!last || last > end)
			continue;
		out[count++] = (struct span){p, last};
		p = last - 1;
	}
	return count;
}

static bool has_numbers(const char *name, size_t length)
{
	static const char *const names[] = {"value", "x", "y", "z", "angle", "origin", "target", "up"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (strlen(names[i]) == length && memcmp(names[i], name, length) == 0)
			return true;
	return false;
}

static size_t find_in_xml(const char *text, struct span *out)
{
	size_t count = 0;
	for (const char *p = text; (p = strchr(p, '='));) {
		const char *name = p++;
		if (*p != '"' && *p != '\'')
			continue;
		const char *end = strchr(p + 1, *p);
		while (name > text && isalpha((unsigned char)name[-1]))
			name--;
		if (!end)
			break;
		if (has_numbers(name, (size_t)(p - 1 - name)))
			count = append_numbers(p + 1, end, out, count);
		p = end + 1;
	}
	return count;
}

static size_t find_in_obj(const char *text, struct span *out)
{
	size_t count = 0;
	for (const char *line = text; *line;) {
		const char *end = strchr(line, '\n');
		end = end ? end : line + strlen(line);
		if (*line == 'v' || *line == 'f')
			count = append_numbers(line + 1 + (line[1] == 't' || line[1] == 'n'), end, out, count);
		line = end + (*end == '\n');
	}
	return count;
}

static size_t find_numbers(const char *text, struct span *out)
{
	return strchr(text, '<') ? find_in_xml(text, out) : find_in_obj(text, out);
}

size_t scene_numbers_count(const char *text)
{
	static struct span spans[NUMBERS_MAX];
	return find_numbers(text, spans);
}

/* Replaces half of the numbers by values from the list, with any sign, and multiplies the others by a power of ten. */
static void replace_number(struct span s, struct dice *d, char out[NUMBER_BYTES])
{
	if (dice_below(d, 2) == 0) {
		const char *x = extremes[dice_below(d, EXTREMES)];
		bool negative = *x != '-' && dice_below(d, 4) == 0;
		snprintf(out, NUMBER_BYTES, "%s%s", negative ? "-" : "", x);
		return;
	}
	double reach = dice_below(d, 2) ? 20 : 300, power = dice_between(d, -reach, reach);
	snprintf(out, NUMBER_BYTES, "%.17g", strtod(s.begin, NULL) * exp10(power));
}

char *scene_numbers_mutate(const char *text, struct dice *d, char *what, size_t what_size)
{
	static struct span spans[NUMBERS_MAX];
	size_t count = find_numbers(text, spans), n = 1 + dice_below(d, CHANGES_MAX), used = 0, described = 0;
	if (count == 0)
		return NULL;
	size_t chosen[CHANGES_MAX];
	for (size_t i = 0; i < n; i++)
		chosen[i] = dice_below(d, (uint32_t)count);
	char *out = malloc(strlen(text) + CHANGES_MAX * NUMBER_BYTES + 1);
	const char *p = text;
	what[0] = 0;
	for (size_t k = 0; k < count; k++) {
		bool is_chosen = false;
		for (size_t i = 0; i < n; i++)
			is_chosen |= chosen[i] == k;
		if (!is_chosen)
			continue;
		char number[NUMBER_BYTES];
		replace_number(spans[k], d, number);
		memcpy(out + used, p, (size_t)(spans[k].begin - p));
		used += (size_t)(spans[k].begin - p);
		used += (size_t)sprintf(out + used, "%s", number);
		p = spans[k].end;
		size_t line = 1;
		for (const char *c = text; c < p; c++)
			line += *c == '\n';
		int length = snprintf(what + described, what_size - described, "%sline %zu: %.*s -> %s",
				      described ? "; " : "", line, (int)(spans[k].end - spans[k].begin), spans[k].begin,
				      number);
		described =
			length > 0 && described + (size_t)length < what_size ? described + (size_t)length : described;
	}
	strcpy(out + used, p);
	return out;
}
