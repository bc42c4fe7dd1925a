/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The program hslt-compare: prints the difference of two images (compare.h) as text or JSON, and optionally writes a
 * heat map. With --exact it compares bits and headers, and prints the first difference.
 *
 * The exit code is 1 after a failure (images of different sizes, or without R, G and B), if there is a difference with
 * --exact, or if the relMSE is above --max-relmse.
 */
#include "common/base/mem.h"
#include "common/base/program.h"
#include "common/base/output_target.h"
#include "common/base/text.h"
#include "common/estimate/stated_error.h"
#include "common/exr/output_files.h"
#include "worker/cli/image/compare.h"
#include "worker/cli/image/compare_exact.h"

#include <float.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

struct arguments {
	const char *paths[2], *heatmap;
	double trim, max_rel_mse; /* max_rel_mse: --max-relmse; negative: not given */
	uint32_t width, height;	  /* --size; 0: not given */
	bool exact, json;
	int stdin_count; /* number of images from stdin */
};

static int parse_size(void *target, char *arg, struct error *e)
{
	struct arguments *a = target;
	uint32_t n[2];
	if (!text_parse_counts(arg, "x", n, 2) || !n[0] || !n[1])
		return error_set(e, EINVAL, "--size takes WxH, not '%s'", arg);
	a->width = n[0];
	a->height = n[1];
	return 0;
}

static const struct option_row option_rows[] = {
	{"exact", 0, NULL, "Only check whether all bits are equal", OPTION_FLAG(struct arguments, exact)},
	{"trim", 0, "F", "Omit the worst share F of the pixels: 0.001 or 0.1%",
	 OPTION_RATIO(struct arguments, trim, 0, 1), .excludes_max = true},
	{"size", 0, "WxH", "First average both to this size, which must divide theirs", OPTION_CUSTOM(parse_size)},
	{"heatmap", 0, "FILE.png", "Write relative errors as colours, from black (0.1 %) to white (100 %)",
	 OPTION_TEXT(struct arguments, heatmap)},
	{"max-relmse", 0, "X", "Fail when the relMSE is above X",
	 OPTION_NUMBER(struct arguments, max_rel_mse, 0, DBL_MAX)},
	{"json", 0, NULL, "Print one JSON object", OPTION_FLAG(struct arguments, json)},
	{0},
};

static int parse_word(void *target, size_t index, char *word, struct error *e)
{
	struct arguments *a = target;
	if (index > 1)
		return error_set(e, EINVAL, "only two images can be compared");
	bool dash = strcmp(word, "-") == 0;
	a->paths[index] = dash ? "/dev/stdin" : word;
	a->stdin_count += dash;
	return a->stdin_count < 2 ? 0 : error_set(e, EINVAL, "only one image can come from stdin");
}

static struct output_files list_outputs(const struct arguments *a)
{
	return (struct output_files){{{"--heatmap", a->heatmap, OUTPUT_PNG}}};
}

static int check_options(void *target, struct error *e)
{
	const struct arguments *a = target;
	if (!a->paths[1])
		return error_set(e, EINVAL, "A.exr and B.exr are needed");
	if (a->heatmap && strcmp(output_target_from_arg(a->heatmap), TARGET_STDOUT) == 0)
		return error_set(e, EINVAL, "--heatmap takes the name of a file: the figures go to stdout");
	if (a->exact && (a->trim > 0 || a->width || a->heatmap || a->max_rel_mse >= 0))
		return error_set(e, EINVAL, "--exact can only be combined with --json");
	struct output_files outputs = list_outputs(a);
	return output_files_check_names(&outputs, e);
}

static const struct program program = {
	.name = "hslt-compare",
	.synopsis = "A.exr B.exr",
	.summary = "Measures the difference of image A from reference B: EXR files with the channels R, G, B.",
	.examples = "hslt-compare noisy.exr reference.exr\n"
		    "hslt-compare --trim 0.001 --max-relmse 0.01 noisy.exr reference.exr\n"
		    "hslt-compare --size 256x144 --heatmap errors.png noisy.exr reference.exr\n"
		    "hslt-compare --exact one.exr other.exr",
	.details =
		"relMSE is the mean over pixels and channels of (A-B)^2 / (B^2 + (0.01 m)^2), m the mean of B; the relative error is its "
		"square root; PSNR takes the 99.5th percentile of B as peak. --trim omits the worst pixels from relMSE, "
		"RMSE and PSNR, not from the means.\n--exact compares every channel and the header, except for "
		"hslt:wallSeconds, hslt:cpuSeconds, hslt:workers, hslt:end, hslt:sceneHash and hslt:date. - is stdin.",
	.exit_codes = "0 done, 1 failed, different, or above --max-relmse, 2 usage",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_options},
	.parse_word = parse_word,
};

static void print_json(json_t *o)
{
	json_dumpf(o, stdout, JSON_COMPACT);
	putchar('\n');
	json_decref(o);
}

/* Returns a JSON number; null for infinity and NaN, which JSON does not have. */
static json_t *number_to_json(double x)
{
	return isfinite(x) ? json_real(x) : json_null();
}

static json_t *text_to_json(const char *s)
{
	json_t *t = json_string(s);
	return t ? t : json_string("(not UTF-8)");
}

static json_t *triple_to_json(const double x[3])
{
	return json_pack("[o,o,o]", number_to_json(x[0]), number_to_json(x[1]), number_to_json(x[2]));
}

static void print_figures(const struct arguments *a, const struct compare_result *r)
{
	if (a->json) {
		print_json(json_pack("{s:i s:o s:o s:o s:o s:o s:o s:o s:o s:o s:o s:o s:I s:I s:I s:s}", "schema", 1,
				     "a", text_to_json(a->paths[0]), "b", text_to_json(a->paths[1]), "relMSE",
				     number_to_json(r->rel_mse), "relativeError", number_to_json(r->rel_error), "rmse",
				     number_to_json(r->rmse), "psnr", number_to_json(r->psnr), "peak",
				     number_to_json(r->peak), "meanA", triple_to_json(r->mean_a), "meanB",
				     triple_to_json(r->mean_b), "meanRatio", triple_to_json(r->ratio), "luminanceRatio",
				     number_to_json(r->luminance_ratio), "pixels", (json_int_t)r->pixel_count,
				     "leftOut", (json_int_t)r->trimmed_count, "notFinite",
				     (json_int_t)r->not_finite_count, "relMSEDefinition", REL_MSE_DEFINITION));
		return;
	}
	printf("relMSE          %.6g (" REL_MSE_DEFINITION ")\n", r->rel_mse);
	printf("relative error  %.4g %%\n", 100 * r->rel_error);
	printf("RMSE            %.6g\n", r->rmse);
	printf("PSNR            %.2f dB (peak %.6g)\n", r->psnr, r->peak);
	printf("mean A/B        R %.6f  G %.6f  B %.6f  luminance %.6f\n", r->ratio[0], r->ratio[1], r->ratio[2],
	       r->luminance_ratio);
	if (r->trimmed_count)
		printf("left out        %zu of %zu pixels\n", r->trimmed_count, r->pixel_count);
	if (r->not_finite_count)
		printf("not finite      %zu pixels of A\n", r->not_finite_count);
}

static int compare_bits(const struct arguments *a, const struct picture *p, int *code)
{
	char why[1024];
	bool equal = compare_exact(&p[0].image, &p[1].image, why, sizeof why);
	if (a->json)
		print_json(json_pack("{s:i s:o s:o s:b s:o}", "schema", 1, "a", text_to_json(a->paths[0]), "b",
				     text_to_json(a->paths[1]), "equal", equal, "difference", text_to_json(why)));
	else
		printf("%s%s\n", equal ? "equal" : "different: ", why);
	*code = !equal;
	return 0;
}

static int write_heatmap(const char *path, const struct picture *p, struct error *e)
{
	uint32_t width = p->image.width, height = p->image.height;
	unsigned char *rgb = mem_alloc((size_t)width * height, 3);
	int rc = rgb ? compare_heatmap(&p[0], &p[1], rgb, e) : error_set(e, ENOMEM, "%s: no memory for it", path);
	if (rc == 0)
		rc = picture_write_png(path, rgb, width, height, e);
	mem_free(rgb);
	return rc;
}

static int compare_figures(const struct arguments *a, struct picture *p, int *code, struct error *e)
{
	struct compare_result r;
	const struct exr_image *i = &p[0].image, *j = &p[1].image;
	if (i->x != j->x || i->y != j->y)
		fprintf(stderr, "hslt-compare: the pixels begin at %u,%u and %u,%u of their films\n", i->x, i->y, j->x,
			j->y);
	int rc = 0;
	for (int k = 0; rc == 0 && a->width && k < 2; k++)
		if ((rc = picture_shrink(&p[k], a->width, a->height, e)) != 0)
			error_prefix(e, rc, "%s", a->paths[k]);
	if (rc == 0)
		rc = compare_to_reference(&p[0], &p[1], a->trim, &r, e);
	if (rc == 0 && a->heatmap)
		rc = write_heatmap(a->heatmap, p, e);
	if (rc)
		return rc;
	print_figures(a, &r);
	if (a->max_rel_mse >= 0 && !(r.rel_mse <= a->max_rel_mse)) {
		fprintf(stderr, "hslt-compare: the relMSE is %.6g, above %.6g\n", r.rel_mse, a->max_rel_mse);
		*code = 1;
	}
	return 0;
}

int main(int argc, char **argv)
{
	struct arguments a = {.max_rel_mse = -1};
	struct picture p[2] = {0};
	struct error e;
	int code = 0;
	program_parse_options(&program, argc, argv, &a);
	struct output_files outputs = list_outputs(&a);
	int rc = output_files_check(&outputs, a.paths, 2, &e);
	if (rc == 0)
		rc = picture_read(&p[0], a.paths[0], &e);
	if (rc == 0)
		rc = picture_read(&p[1], a.paths[1], &e);
	if (rc == 0)
		rc = a.exact ? compare_bits(&a, p, &code) : compare_figures(&a, p, &code, &e);
	picture_fini(&p[0]);
	picture_fini(&p[1]);
	if (rc)
		fprintf(stderr, "hslt-compare: %s\n", e.text);
	return rc ? 1 : code;
}
