/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/image/compare_exact.h"

#include "common/exr/header.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct answer {
	char *why;
	size_t size;
};

__attribute__((format(printf, 2, 3))) static bool differ(const struct answer *to, const char *format, ...)
{
	va_list ap;
	va_start(ap, format);
	vsnprintf(to->why, to->size, format, ap);
	va_end(ap);
	return false;
}

static bool same_shape(const struct exr_image *a, const struct exr_image *b, const struct answer *to)
{
	if (a->width != b->width || a->height != b->height)
		return differ(to, "%ux%u and %ux%u pixels", a->width, a->height, b->width, b->height);
	if (a->x != b->x || a->y != b->y || a->full_width != b->full_width || a->full_height != b->full_height)
		return differ(to, "pixels at %u,%u of %ux%u and at %u,%u of %ux%u", a->x, a->y, a->full_width,
			      a->full_height, b->x, b->y, b->full_width, b->full_height);
	if (a->channel_count != b->channel_count)
		return differ(to, "%u and %u channels", a->channel_count, b->channel_count);
	for (uint32_t c = 0; c < a->channel_count; c++)
		if (strcmp(a->names[c], b->names[c]) != 0)
			return differ(to, "channel %u is %s and %s", c, a->names[c], b->names[c]);
	return true;
}

static bool same_plane(const struct exr_image *a, const struct exr_image *b, uint32_t c, const struct answer *to)
{
	size_t pixels = (size_t)a->width * a->height, count = 0, first = 0;
	for (size_t i = pixels; i-- > 0;)
		if (memcmp(&a->planes[c][i], &b->planes[c][i], sizeof(float)) != 0) {
			first = i;
			count++;
		}
	if (count == 0)
		return true;
	return differ(to, "channel %s at pixel %zu,%zu is %a and %a (%.9g and %.9g); %zu of its %zu pixels differ",
		      a->names[c], first % a->width, first / a->width, (double)a->planes[c][first],
		      (double)b->planes[c][first], (double)a->planes[c][first], (double)b->planes[c][first], count,
		      pixels);
}

static bool same_attribute(const struct exr_attribute *a, const struct exr_attribute *b, const struct answer *to)
{
	if (a->type != b->type)
		return differ(to, "%s is of two types", a->name);
	if (a->type == EXR_ATTRIBUTE_STRING)
		return strcmp(a->string, b->string) == 0 ||
		       differ(to, "%s is '%s' and '%s'", a->name, a->string, b->string);
	if (a->type == EXR_ATTRIBUTE_DOUBLE)
		return memcmp(&a->number, &b->number, sizeof a->number) == 0 ||
		       differ(to, "%s is %.17g and %.17g", a->name, a->number, b->number);
	return a->integer == b->integer || differ(to, "%s is %d and %d", a->name, a->integer, b->integer);
}

static bool same_header(const struct exr_image *a, const struct exr_image *b, const struct answer *to)
{
	for (size_t i = 0; i < a->attribute_count; i++) {
		const char *name = a->attributes[i].name;
		const struct exr_attribute *other = exr_attribute_find(b, name);
		if (header_excluded(name))
			continue;
		if (!other)
			return differ(to, "only the first has %s", name);
		if (!same_attribute(&a->attributes[i], other, to))
			return false;
	}
	for (size_t i = 0; i < b->attribute_count; i++)
		if (!header_excluded(b->attributes[i].name) && !exr_attribute_find(a, b->attributes[i].name))
			return differ(to, "only the second has %s", b->attributes[i].name);
	return true;
}

bool compare_exact(const struct exr_image *a, const struct exr_image *b, char *why, size_t why_size)
{
	const struct answer to = {why, why_size};
	differ(&to, "%s", "");
	if (!same_shape(a, b, &to))
		return false;
	for (uint32_t c = 0; c < a->channel_count; c++)
		if (!same_plane(a, b, c, &to))
			return false;
	return same_header(a, b, &to);
}
