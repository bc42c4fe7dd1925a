/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/image/compare_exact.h"

#include "common/exr/header.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct first_difference {
	char *text;
	size_t size;
};

__attribute__((format(printf, 2, 3))) static bool set_difference(const struct first_difference *result,
								 const char *format, ...)
{
	va_list ap;
	va_start(ap, format);
	vsnprintf(result->text, result->size, format, ap);
	va_end(ap);
	return false;
}

static bool has_same_shape(const struct exr_image *a, const struct exr_image *b, const struct first_difference *result)
{
	if (a->width != b->width || a->height != b->height)
		return set_difference(result, "%ux%u and %ux%u pixels", a->width, a->height, b->width, b->height);
	if (a->x != b->x || a->y != b->y || a->full_width != b->full_width || a->full_height != b->full_height)
		return set_difference(result, "pixels at %u,%u of %ux%u and at %u,%u of %ux%u", a->x, a->y,
				      a->full_width, a->full_height, b->x, b->y, b->full_width, b->full_height);
	if (a->channel_count != b->channel_count)
		return set_difference(result, "%u and %u channels", a->channel_count, b->channel_count);
	for (uint32_t c = 0; c < a->channel_count; c++)
		if (strcmp(a->channel_names[c], b->channel_names[c]) != 0)
			return set_difference(result, "channel %u is %s and %s", c, a->channel_names[c],
					      b->channel_names[c]);
	return true;
}

static bool has_same_plane(const struct exr_image *a, const struct exr_image *b, uint32_t c,
			   const struct first_difference *result)
{
	size_t pixels = (size_t)a->width * a->height, count = 0, first = 0;
	for (size_t i = pixels; i-- > 0;)
		if (memcmp(&a->planes[c][i], &b->planes[c][i], sizeof(float)) != 0) {
			first = i;
			count++;
		}
	if (count == 0)
		return true;
	return set_difference(
		result, "channel %s at pixel %zu,%zu is %a and %a (%.9g and %.9g); %zu of its %zu pixels differ",
		a->channel_names[c], first % a->width, first / a->width, (double)a->planes[c][first],
		(double)b->planes[c][first], (double)a->planes[c][first], (double)b->planes[c][first], count, pixels);
}

static bool has_same_value(const struct exr_attribute *a, const struct exr_attribute *b,
			   const struct first_difference *result)
{
	if (a->type != b->type)
		return set_difference(result, "%s is of two types", a->name);
	if (a->type == EXR_ATTRIBUTE_STRING)
		return strcmp(a->string, b->string) == 0 ||
		       set_difference(result, "%s is '%s' and '%s'", a->name, a->string, b->string);
	if (a->type == EXR_ATTRIBUTE_DOUBLE)
		return memcmp(&a->number, &b->number, sizeof a->number) == 0 ||
		       set_difference(result, "%s is %.17g and %.17g", a->name, a->number, b->number);
	return a->integer == b->integer || set_difference(result, "%s is %d and %d", a->name, a->integer, b->integer);
}

static bool has_same_header(const struct exr_image *a, const struct exr_image *b, const struct first_difference *result)
{
	for (size_t i = 0; i < a->attribute_count; i++) {
		const char *name = a->attributes[i].name;
		const struct exr_attribute *other = exr_find_attribute(b, name);
		if (header_is_excluded(name))
			continue;
		if (!other)
			return set_difference(result, "only the first has %s", name);
		if (!has_same_value(&a->attributes[i], other, result))
			return false;
	}
	for (size_t i = 0; i < b->attribute_count; i++)
		if (!header_is_excluded(b->attributes[i].name) && !exr_find_attribute(a, b->attributes[i].name))
			return set_difference(result, "only the second has %s", b->attributes[i].name);
	return true;
}

bool compare_exact(const struct exr_image *a, const struct exr_image *b, char *why, size_t why_size)
{
	const struct first_difference result = {why, why_size};
	set_difference(&result, "%s", "");
	if (!has_same_shape(a, b, &result))
		return false;
	for (uint32_t c = 0; c < a->channel_count; c++)
		if (!has_same_plane(a, b, c, &result))
			return false;
	return has_same_header(a, b, &result);
}
