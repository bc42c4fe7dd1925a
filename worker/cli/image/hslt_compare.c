/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The program: two images and what differs between them (compare.h), as text or JSON, with a heat map where one is
 * asked for; --exact compares bits and headers and says the first difference.
 *
 * Exit code 1: a failure (images of different sizes, or with other channels), a difference with --exact, or more than
 * --max-relmse.
 */
#include "common/base/mem.h"
#include "common/base/output.h"
#include "common/base/version.h"
#include "common/estimate/stated_error.h"
#include "worker/cli/image/compare.h"

#include <argp.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const char *argp_program_version = "hslt-compare " HSLT_VERSION;

static const char doc[] =
	"Says how far the picture A is from the reference B: EXR files with the channels R, G, B."
	"\v"
	"Examples:\n"
	"  hslt-compare noisy.exr reference.exr\n"
	"  hslt-compare --trim 0.001 --max-relmse 0.01 noisy.exr reference.exr\n"
	"  hslt-compare --size 256x144 --heatmap errors.png noisy.exr reference.exr\n"
	"  hslt-compare --exact one.exr other.exr\n"
	"\n"
	"relMSE is the mean over pixels and channels of (A-B)^2 / (B^2 + (0.01 m)^2), m the mean of B; the relative error is its "
	"square root; PSNR takes the 99.5th percentile of B as peak. --trim leaves the worst pixels out of relMSE, RMSE and PSNR, "
	"not out of the means.\n"
	"--exact looks at every channel and at the header, but for hslt:wallSeconds, hslt:cpuSeconds, hslt:workers, hslt:end and "
	"hslt:date.\n"
	"Exit codes: 0 done, 1 failed, different, or above --max-relmse, 2 usage.";

enum { OPTION_TRIM = 256, OPTION_HEATMAP, OPTION_MAX, OPTION_JSON, OPTION_SIZE, OPTION_EXACT };

static const struct argp_option options[] = {
	{"exact", OPTION_EXACT, NULL, 0, "Only ask whether all bits are the same", 0},
	{"trim", OPTION_TRIM, "F", 0, "Leave out the worst share F of the pixels: 0.001", 0},
	{"size", OPTION_SIZE, "WxH", 0, "Average both to this size first; it must divide theirs", 0},
	{"heatmap", OPTION_HEATMAP, "FILE.png", 0, "Relative errors as colours: 0.1 % black to 100 % white", 0},
	{"max-relmse", OPTION_MAX, "X", 0, "Fail when the relMSE is above X", 0},
	{"json", OPTION_JSON, NULL, 0, "Print one JSON object", 0},
	{0},
};

struct arguments {
	const char *path[2], *heatmap;
	double trim, most; /* most: negative for none */
	uint32_t width, height;
	bool exact, json;
};

static double parse_below(struct argp_state *state, const char *option, const char *arg, double below)
{
	char *end;
	double x = strtod(arg, &end);
	if (end == arg || *end || !(x >= 0 && x < below))
		argp_error(state, "%s takes a number from 0 to below %g, not '%s'", option, below, arg);
	return x;
}

static void check_usage(const struct arguments *a, struct argp_state *state)
{
	if (!a->path[1])
		argp_error(state, "A.exr and B.exr are needed");
	if (a->exact && (a->trim > 0 || a->width || a->heatmap || a->most >= 0))
		argp_error(state, "--exact goes with --json only");
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct arguments *a = state->input;
	char rest;
	switch (key) {
	case OPTION_EXACT:
		a->exact = true;
		return 0;
	case OPTION_TRIM:
		a->trim = parse_below(state, "--trim", arg, 1);
		return 0;
	case OPTION_SIZE:
		if (*arg < '0' || *arg > '9' || sscanf(arg, "%ux%u%c", &a->width, &a->height, &rest) != 2 ||
		    !a->width || !a->height)
			argp_error(state, "--size takes WxH, not '%s'", arg);
		return 0;
	case OPTION_HEATMAP:
		a->heatmap = arg;
		return 0;
	case OPTION_MAX:
		a->most = parse_below(state, "--max-relmse", arg, HUGE_VAL);
		return 0;
	case OPTION_JSON:
		a->json = true;
		return 0;
	case ARGP_KEY_ARG:
		if (a->path[1])
			argp_error(state, "two pictures, not more");
		a->path[a->path[0] ? 1 : 0] = arg;
		return 0;
	case ARGP_KEY_END:
		check_usage(a, state);
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

static void print_json(json_t *o)
{
	json_dumpf(o, stdout, JSON_COMPACT);
	putchar('\n');
	json_decref(o);
}

/* JSON has no infinity. */
static json_t *real(double x)
{
	return isfinite(x) ? json_real(x) : json_null();
}

static json_t *text(const char *s)
{
	json_t *t = json_string(s);
	return t ? t : json_string("(not UTF-8)");
}

static json_t *three(const double x[3])
{
	return json_pack("[o,o,o]", real(x[0]), real(x[1]), real(x[2]));
}

static void print_figures(const struct arguments *a, const struct compare_result *r)
{
	if (a->json) {
		print_json(json_pack("{s:i s:o s:o s:o s:o s:o s:o s:o s:o s:o s:o s:o s:I s:I s:I s:s}", "schema", 1,
				     "a", text(a->path[0]), "b", text(a->path[1]), "relMSE", real(r->rel_mse),
				     "relativeError", real(r->relative_error), "rmse", real(r->rmse), "psnr",
				     real(r->psnr), "peak", real(r->peak), "meanA", three(r->mean_a), "meanB",
				     three(r->mean_b), "meanRatio", three(r->ratio), "luminanceRatio",
				     real(r->luminance_ratio), "pixels", (json_int_t)r->pixels, "leftOut",
				     (json_int_t)r->left_out, "notFinite", (json_int_t)r->not_finite,
				     "relMSEDefinition", REL_MSE_DEFINITION));
		return;
	}
	printf("relMSE          %.6g (" REL_MSE_DEFINITION ")\n", r->rel_mse);
	printf("relative error  %.4g %%\n", 100 * r->relative_error);
	printf("RMSE            %.6g\n", r->rmse);
	printf("PSNR            %.2f dB (peak %.6g)\n", r->psnr, r->peak);
	printf("mean A/B        R %.6f  G %.6f  B %.6f  luminance %.6f\n", r->ratio[0], r->ratio[1], r->ratio[2],
	       r->luminance_ratio);
	if (r->left_out)
		printf("left out        %zu of %zu pixels\n", r->left_out, r->pixels);
	if (r->not_finite)
		printf("not finite      %zu pixels of A\n", r->not_finite);
}

static int run_exact(const struct arguments *a, const struct picture *p, int *code)
{
	char why[1024];
	bool equal = compare_exact(&p[0].image, &p[1].image, why, sizeof why);
	if (a->json)
		print_json(json_pack("{s:i s:o s:o s:b s:o}", "schema", 1, "a", text(a->path[0]), "b", text(a->path[1]),
				     "equal", equal, "difference", text(why)));
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

static int run_figures(const struct arguments *a, struct picture *p, int *code, struct error *e)
{
	struct compare_result r;
	const struct exr_image *i = &p[0].image, *j = &p[1].image;
	if (i->x != j->x || i->y != j->y)
		fprintf(stderr, "hslt-compare: the pixels begin at %u,%u and %u,%u of their films\n", i->x, i->y, j->x,
			j->y);
	int rc = 0;
	for (int k = 0; rc == 0 && a->width && k < 2; k++)
		if ((rc = picture_shrink(&p[k], a->width, a->height, e)) != 0)
			error_prefix(e, rc, "%s", a->path[k]);
	if (rc == 0)
		rc = compare(&p[0], &p[1], a->trim, &r, e);
	if (rc == 0 && a->heatmap)
		rc = write_heatmap(a->heatmap, p, e);
	if (rc)
		return rc;
	print_figures(a, &r);
	if (a->most >= 0 && !(r.rel_mse <= a->most)) {
		fprintf(stderr, "hslt-compare: the relMSE is %.6g, above %.6g\n", r.rel_mse, a->most);
		*code = 1;
	}
	return 0;
}

int main(int argc, char **argv)
{
	struct arguments a = {.most = -1};
	struct picture p[2] = {0};
	struct error e;
	int code = 0;
	output_check_at_exit();
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse, "A.exr B.exr", doc, NULL, NULL, NULL}, argc, argv, 0, NULL, &a);
	int rc = picture_read(&p[0], a.path[0], &e);
	if (rc == 0)
		rc = picture_read(&p[1], a.path[1], &e);
	if (rc == 0)
		rc = a.exact ? run_exact(&a, p, &code) : run_figures(&a, p, &code, &e);
	picture_fini(&p[0]);
	picture_fini(&p[1]);
	if (rc)
		fprintf(stderr, "hslt-compare: %s\n", e.text);
	return rc ? 1 : code;
}
