/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/mem.h"
#include "common/base/output.h"
#include "common/base/version.h"
#include "worker/cli/image/picture.h"
#include "worker/cli/image/tonemap.h"

#include <argp.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const char *argp_program_version = "hslt-tonemap " HSLT_VERSION;

static const char doc[] =
	"Makes a PNG file of 8-bit sRGB from the channels R, G, B of an EXR file."
	"\v"
	"Examples:\n"
	"  hslt-tonemap room.exr room.png\n"
	"  hslt-tonemap --exposure -1.5 room.exr darker.png\n"
	"\n"
	"Values are taken times 2^STOPS and clipped to [0,1]. What is not a number becomes 0, infinities 0 or 255; both are "
	"counted on stderr.\n"
	"Exit codes: 0 done, 1 failed, 2 usage.";

static const struct argp_option options[] = {
	{"exposure", 'e', "STOPS", 0, "Twice as bright for each (0)", 0},
	{0},
};

struct arguments {
	const char *in, *out;
	double stops;
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct arguments *a = state->input;
	char *end;
	switch (key) {
	case 'e':
		a->stops = strtod(arg, &end);
		if (end == arg || *end || !(fabs(a->stops) <= 100))
			argp_error(state, "--exposure takes a number of stops from -100 to 100, not '%s'", arg);
		return 0;
	case ARGP_KEY_ARG:
		if (a->out)
			argp_error(state, "two files, not more");
		*(a->in ? &a->out : &a->in) = arg;
		return 0;
	case ARGP_KEY_END:
		if (!a->out)
			argp_error(state, "IN.exr and OUT.png are needed");
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

static int run(const struct arguments *a, struct error *e)
{
	struct picture p;
	int rc = picture_read(&p, a->in, e);
	if (rc)
		return rc;
	size_t pixels = (size_t)p.image.width * p.image.height;
	unsigned char *bytes = mem_alloc(pixels, 3);
	if (bytes) {
		struct tonemap_counts n = tonemap(p.rgb, pixels, a->stops, bytes);
		if (n.nan || n.infinite)
			fprintf(stderr, "hslt-tonemap: %s: %zu values are not numbers, %zu are infinite\n", a->in,
				n.nan, n.infinite);
		rc = picture_write_png(a->out, bytes, p.image.width, p.image.height, e);
	} else {
		rc = error_set(e, ENOMEM, "%s: no memory for %zu pixels", a->in, pixels);
	}
	mem_free(bytes);
	picture_fini(&p);
	return rc;
}

int main(int argc, char **argv)
{
	struct arguments a = {0};
	struct error e;
	output_check_at_exit();
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse, "IN.exr OUT.png", doc, NULL, NULL, NULL}, argc, argv, 0, NULL, &a);
	if (run(&a, &e) == 0)
		return 0;
	fprintf(stderr, "hslt-tonemap: %s\n", e.text);
	return 1;
}
