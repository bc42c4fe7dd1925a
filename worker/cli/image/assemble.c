/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Crops are added one by one (add_crop). The first determines the film, the layers and the attributes that all must
 * share; each crop is checked against the first, its pixels are copied, and the numbers in its header are added up. At
 * the end, the film is cut to the rectangle that the crops cover (crop_to_covered), and the image is written
 * (encode_image).
 *
 * Failures name the file, and the attribute or pixel that is wrong: crops of different renders, crops that overlap, or
 * a pixel inside the rectangle that no crop has.
 */
#include "worker/cli/image/assemble.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/exr/image_file.h"
#include "common/exr/exr_read.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Attributes that must be equal in all crops, whose numbers are added up, or that have rules of their own in add_header
 * and encode_image. Any other attribute is kept if all crops agree on it. */
static const char *const equal_attributes[] = {"hslt:version",	"hslt:scene",	 "hslt:integrator",
					       "hslt:minDepth", "hslt:maxDepth", "hslt:effects"};
static const char *const summed_attributes[] = {"hslt:mutations",   "hslt:accepted",   "hslt:independent",
						"hslt:nan",	    "hslt:infinite",   "hslt:negative",
						"hslt:raysClosest", "hslt:raysShadow", "hslt:stuck"};
static const char *const special_attributes[] = {"hslt:relMSE",	     "hslt:relMSELow95", "hslt:relMSEHigh95",
						 "hslt:relMSEUpper", "hslt:agreement",	 "hslt:disagreement",
						 "hslt:cpuSeconds",  "hslt:wallSeconds", "hslt:mixed",
						 "hslt:date",	     "hslt:workers"};
enum {
	EQUAL_COUNT = sizeof equal_attributes / sizeof *equal_attributes,
	SUMMED_COUNT = sizeof summed_attributes / sizeof *summed_attributes,
	SPECIAL_COUNT = sizeof special_attributes / sizeof *special_attributes
};
static const char *const equal_options[] = {"--set ", "--effects "};
enum { TEXT_SIZE = 8192 };

struct sums {
	uint64_t totals[SUMMED_COUNT];
	bool in_all[SUMMED_COUNT]; /* the attribute is present in every crop */
	double mse;		   /* sum of relMSE times pixels */
	/* Sums of squares: distance of relMSE from the ends of its interval, times pixels. */
	double squares_below, squares_above;
	double pixels;
	bool has_mse; /* every crop has a relMSE and its interval */
	double cpu_seconds, wall_seconds;
	int has_mixed_fingerprints;
	bool too_short, disagree, agree;
	char disagreement[TEXT_SIZE];
};

struct assembly {
	struct exr_image film;
	unsigned char *is_covered;     /* [pixel]: 1 if a crop has it */
	bool *is_kept;		       /* [attribute of the first crop]: all crops so far agree on it */
	struct exr_image first_header; /* header of the first crop */
	struct sums sums;
};

static bool attributes_equal(const struct exr_attribute *a, const struct exr_attribute *b)
{
	if (!a || !b || a->type != b->type)
		return !a && !b;
	return a->type == EXR_ATTRIBUTE_STRING ? strcmp(a->string, b->string) == 0
	       : a->type == EXR_ATTRIBUTE_INT  ? a->integer == b->integer
					       : memcmp(&a->number, &b->number, sizeof a->number) == 0;
}

static const char *get_string(const struct exr_image *img, const char *name)
{
	const struct exr_attribute *a = exr_find_attribute(img, name);
	return a && a->type == EXR_ATTRIBUTE_STRING ? a->string : "";
}

static double get_number(const struct exr_image *img, const char *name)
{
	const struct exr_attribute *a = exr_find_attribute(img, name);
	return a && a->type == EXR_ATTRIBUTE_DOUBLE ? a->number : NAN;
}

/* Returns whether an option has the same argument, up to the next space, in two texts of hslt:options. */
static bool has_same_option(const char *a, const char *b, const char *option)
{
	const char *x = strstr(a, option), *y = strstr(b, option);
	if (!x || !y)
		return !x && !y;
	size_t n = strcspn(x + strlen(option), " "), m = strcspn(y + strlen(option), " ");
	return n == m && memcmp(x, y, strlen(option) + n) == 0;
}

static int check_render(const struct exr_image *first, const struct exr_image *img, struct error *e)
{
	if (img->full_width != first->full_width || img->full_height != first->full_height)
		return error_set(e, EINVAL, "a crop of a film of %ux%u; the first one's film has %ux%u",
				 img->full_width, img->full_height, first->full_width, first->full_height);
	if ((uint64_t)img->x + img->width > img->full_width || (uint64_t)img->y + img->height > img->full_height)
		return error_set(e, EINVAL, "its pixels are outside its film of %ux%u", img->full_width,
				 img->full_height);
	bool layers = img->channel_count == first->channel_count;
	for (uint32_t c = 0; layers && c < img->channel_count; c++)
		layers = strcmp(img->channel_names[c], first->channel_names[c]) == 0;
	if (!layers)
		return error_set(e, EINVAL, "it has other layers than the first crop");
	for (size_t i = 0; i < EQUAL_COUNT; i++)
		if (!attributes_equal(exr_find_attribute(first, equal_attributes[i]),
				      exr_find_attribute(img, equal_attributes[i])))
			return error_set(e, EINVAL, "it is not of the same render as the first crop: %s differs",
					 equal_attributes[i]);
	for (size_t i = 0; i < sizeof equal_options / sizeof *equal_options; i++)
		if (!has_same_option(get_string(first, "hslt:options"), get_string(img, "hslt:options"),
				     equal_options[i]))
			return error_set(e, EINVAL, "it is not of the same render as the first crop: %.*s differs",
					 (int)strlen(equal_options[i]) - 1, equal_options[i]);
	return 0;
}

static int begin_assembly(struct assembly *a, const struct exr_image *img, struct error *e)
{
	struct exr_image *f = &a->film;
	size_t pixels = (size_t)img->full_width * img->full_height;
	*f = (struct exr_image){.full_width = img->full_width,
				.full_height = img->full_height,
				.width = img->full_width,
				.height = img->full_height,
				.channel_count = img->channel_count};
	memcpy(f->channel_names, img->channel_names, sizeof f->channel_names);
	a->is_covered = mem_alloc(pixels, 1);
	a->is_kept = mem_alloc(img->attribute_count, sizeof *a->is_kept);
	bool ok = a->is_covered && a->is_kept;
	for (uint32_t c = 0; ok && c < f->channel_count; c++)
		ok = (f->planes[c] = mem_alloc(pixels, sizeof(float))) != NULL;
	if (!ok)
		return error_set(e, ENOMEM, "no memory for a film of %ux%u", f->width, f->height);
	for (size_t i = 0; i < img->attribute_count; i++)
		a->is_kept[i] = true;
	for (size_t i = 0; i < SUMMED_COUNT; i++)
		a->sums.in_all[i] = true;
	a->sums.has_mse = true;
	return 0;
}

static int copy_pixels(struct assembly *a, const struct exr_image *img, struct error *e)
{
	struct exr_image *f = &a->film;
	for (uint32_t y = 0; y < img->height; y++) {
		size_t target = (size_t)(img->y + y) * f->width + img->x;
		for (uint32_t x = 0; x < img->width; x++)
			if (a->is_covered[target + x])
				return error_set(e, EINVAL, "another crop also has its pixel %u,%u", img->x + x,
						 img->y + y);
		memset(a->is_covered + target, 1, img->width);
		for (uint32_t c = 0; c < f->channel_count; c++)
			memcpy(f->planes[c] + target, img->planes[c] + (size_t)y * img->width,
			       img->width * sizeof(float));
	}
	return 0;
}

static void add_convergence(struct sums *s, const struct exr_image *img)
{
	const char *agreement = get_string(img, "hslt:agreement"), *text = get_string(img, "hslt:disagreement");
	s->agree |= strcmp(agreement, "agree") == 0;
	s->too_short |= strcmp(agreement, "too short") == 0;
	s->disagree |= strcmp(agreement, "disagree") == 0;
	size_t used = strlen(s->disagreement);
	if (*text)
		snprintf(s->disagreement + used, sizeof s->disagreement - used, "%scrop %u,%u,%u,%u: %s",
			 used ? "; " : "", img->x, img->y, img->width, img->height, text);
}

static void add_header(struct assembly *a, const struct exr_image *img)
{
	struct sums *s = &a->sums;
	double pixels = (double)img->width * img->height;
	for (size_t i = 0; i < SUMMED_COUNT; i++) {
		const char *digits = get_string(img, summed_attributes[i]);
		s->in_all[i] &= *digits != 0;
		s->totals[i] += strtoull(digits, NULL, 10);
	}
	double mse = get_number(img, "hslt:relMSE"), low = get_number(img, "hslt:relMSELow95"),
	       high = get_number(img, "hslt:relMSEHigh95");
	s->has_mse &= isfinite(mse) && isfinite(low) && isfinite(high);
	s->mse += mse * pixels;
	s->squares_below += (mse - low) * pixels * (mse - low) * pixels;
	s->squares_above += (high - mse) * pixels * (high - mse) * pixels;
	s->pixels += pixels;
	s->cpu_seconds += get_number(img, "hslt:cpuSeconds");
	s->wall_seconds = fmax(s->wall_seconds, get_number(img, "hslt:wallSeconds"));
	const struct exr_attribute *mixed = exr_find_attribute(img, "hslt:mixed");
	s->has_mixed_fingerprints |= mixed && mixed->type == EXR_ATTRIBUTE_INT && mixed->integer;
	add_convergence(s, img);
	for (size_t i = 0; i < a->first_header.attribute_count; i++)
		a->is_kept[i] &= attributes_equal(&a->first_header.attributes[i],
						  exr_find_attribute(img, a->first_header.attributes[i].name));
}

static int add_crop(struct assembly *a, const char *path, struct error *e)
{
	unsigned char *bytes = NULL;
	struct exr_image img = {0};
	size_t size;
	int rc = image_file_read(path, &bytes, &size, e);
	if (rc)
		return rc;
	rc = exr_read(bytes, size, &img, e);
	mem_free(bytes);
	bool first = !rc && !a->film.channel_count;
	if (!rc)
		rc = check_render(first ? &img : &a->first_header, &img, e);
	if (!rc && first)
		rc = begin_assembly(a, &img, e);
	if (!rc)
		rc = copy_pixels(a, &img, e);
	if (first) {
		a->first_header = img;
		for (uint32_t c = 0; c < img.channel_count; c++) {
			mem_free(img.planes[c]);
			a->first_header.planes[c] = NULL;
		}
	}
	if (!rc)
		add_header(a, &img);
	if (!first)
		exr_image_fini(&img);
	return rc ? error_prefix(e, rc, "%s", path) : 0;
}

/* Reduces the film to the rectangle that the crops cover. */
static int crop_to_covered(struct assembly *a, struct error *e)
{
	struct exr_image *f = &a->film;
	uint32_t x0 = f->width, y0 = f->height, x1 = 0, y1 = 0, width = f->width;
	for (uint32_t y = 0; y < f->height; y++)
		for (uint32_t x = 0; x < f->width; x++)
			if (a->is_covered[(size_t)y * f->width + x]) {
				x0 = x < x0 ? x : x0;
				x1 = x > x1 ? x : x1;
				y0 = y < y0 ? y : y0;
				y1 = y;
			}
	for (uint32_t y = y0; y <= y1; y++) {
		const unsigned char *row = a->is_covered + (size_t)y * width, *hole = memchr(row + x0, 0, x1 - x0 + 1);
		if (hole)
			return error_set(e, EINVAL, "no crop has pixel %u,%u", (uint32_t)(hole - row), y);
	}
	f->x = x0;
	f->y = y0;
	f->width = x1 - x0 + 1;
	f->height = y1 - y0 + 1;
	for (uint32_t c = 0; c < f->channel_count; c++)
		for (uint32_t y = 0; y < f->height; y++)
			memmove(f->planes[c] + (size_t)y * f->width, f->planes[c] + (size_t)(y0 + y) * width + x0,
				f->width * sizeof(float));
	return 0;
}

static void put_number(struct exr_image *f, const char *name, double x)
{
	f->attributes[f->attribute_count++] =
		(struct exr_attribute){.name = name, .type = EXR_ATTRIBUTE_DOUBLE, .number = x};
}

static void put_int(struct exr_image *f, const char *name, int x)
{
	f->attributes[f->attribute_count++] =
		(struct exr_attribute){.name = name, .type = EXR_ATTRIBUTE_INT, .integer = x};
}

static void put_string(struct exr_image *f, const char *name, const char *text)
{
	f->attributes[f->attribute_count++] =
		(struct exr_attribute){.name = name, .type = EXR_ATTRIBUTE_STRING, .string = text};
}

/* Writes the image. The names and texts of its attributes belong to the tables, the first crop and the sums. */
static int encode_image(struct assembly *a, size_t count, unsigned char **bytes, size_t *size, struct error *e)
{
	struct exr_image *f = &a->film;
	const struct sums *s = &a->sums;
	char digits[SUMMED_COUNT][24];
	struct exr_attribute *list =
		mem_alloc(a->first_header.attribute_count + SUMMED_COUNT + SPECIAL_COUNT + 1, sizeof *list);
	if (!list)
		return error_set(e, ENOMEM, "no memory for a header");
	f->attributes = list;
	for (size_t i = 0; i < a->first_header.attribute_count; i++) {
		const struct exr_attribute *from = &a->first_header.attributes[i];
		if (a->is_kept[i] && !text_is_among(from->name, summed_attributes, SUMMED_COUNT) &&
		    !text_is_among(from->name, special_attributes, SPECIAL_COUNT))
			list[f->attribute_count++] = *from;
	}
	for (size_t i = 0; i < SUMMED_COUNT; i++)
		if (s->in_all[i]) {
			snprintf(digits[i], sizeof digits[i], "%" PRIu64, s->totals[i]);
			put_string(f, summed_attributes[i], digits[i]);
		}
	if (s->has_mse) {
		double mse = s->mse / s->pixels;
		put_number(f, "hslt:relMSE", mse);
		put_number(f, "hslt:relMSELow95", fmax(0, mse - sqrt(s->squares_below) / s->pixels));
		put_number(f, "hslt:relMSEHigh95", mse + sqrt(s->squares_above) / s->pixels);
	}
	if (s->agree || s->too_short || s->disagree)
		put_string(f, "hslt:agreement", s->disagree ? "disagree" : s->too_short ? "too short" : "agree");
	if (*s->disagreement)
		put_string(f, "hslt:disagreement", s->disagreement);
	if (isfinite(s->cpu_seconds))
		put_number(f, "hslt:cpuSeconds", s->cpu_seconds);
	put_number(f, "hslt:wallSeconds", s->wall_seconds);
	put_int(f, "hslt:mixed", s->has_mixed_fingerprints);
	put_int(f, "hslt:crops", (int)count);
	int rc = exr_write(f, bytes, size, e);
	f->attributes = NULL;
	f->attribute_count = 0;
	mem_free(list);
	return rc;
}

int assemble_crops(const char *const *paths, size_t count, unsigned char **bytes, size_t *size, bool *disagree,
		   struct error *e)
{
	struct assembly a = {0};
	int rc = 0;
	for (size_t i = 0; !rc && i < count; i++)
		rc = add_crop(&a, paths[i], e);
	if (!rc)
		rc = crop_to_covered(&a, e);
	if (!rc)
		rc = encode_image(&a, count, bytes, size, e);
	*disagree = a.sums.disagree;
	exr_image_fini(&a.film);
	exr_image_fini(&a.first_header);
	mem_free(a.is_covered);
	mem_free(a.is_kept);
	return rc;
}
