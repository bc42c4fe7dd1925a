/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/mem.h"
#include "common/base/program.h"
#include "common/base/output_target.h"
#include "common/exr/output_files.h"
#include "worker/cli/image/picture.h"
#include "worker/cli/image/tonemap.h"

#include <stdio.h>
#include <string.h>

struct arguments {
	const char *input, *output;
	double stops;
};

static const struct option_row option_rows[] = {
	{"exposure", 'e', "STOPS", "Exposure in stops: each doubles the brightness",
	 OPTION_NUMBER(struct arguments, stops, -100, 100), .default_value = "0"},
	{0},
};

static int parse_word(void *target, size_t index, char *word, struct error *e)
{
	struct arguments *a = target;
	if (index > 1)
		return error_set(e, EINVAL, "only two files are accepted");
	bool dash = strcmp(word, "-") == 0;
	if (index == 0)
		a->input = dash ? "/dev/stdin" : word;
	else
		a->output = output_target_from_arg(word);
	return 0;
}

static struct output_files list_outputs(const struct arguments *a)
{
	return (struct output_files){{{"the output", a->output, OUTPUT_PNG}}};
}

static int check_options(void *target, struct error *e)
{
	const struct arguments *a = target;
	struct output_files outputs = list_outputs(a);
	if (!a->output)
		return error_set(e, EINVAL, "IN.exr and OUT.png are needed");
	return output_files_check_names(&outputs, e);
}

static const struct program program = {
	.name = "hslt-tonemap",
	.synopsis = "IN.exr OUT.png",
	.summary = "Converts the channels R, G, B of an EXR file to a PNG file of 8-bit sRGB.",
	.examples = "hslt-tonemap room.exr room.png\n"
		    "hslt-tonemap --exposure -1.5 room.exr darker.png\n"
		    "hslt-render room.xml -o - | hslt-tonemap - room.png",
	.details = "Values are multiplied by 2^STOPS and clipped to [0,1]. NaN becomes 0, infinities become 0 or "
		   "255; both are counted on stderr. - is stdin or stdout.",
	.exit_codes = "0 done, 1 failed, 2 usage",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_options},
	.parse_word = parse_word,
};

static int tonemap_file(const struct arguments *a, struct error *e)
{
	struct picture p;
	struct output_files outputs = list_outputs(a);
	int rc = output_files_check(&outputs, &a->input, 1, e);
	if (!rc)
		rc = picture_read(&p, a->input, e);
	if (rc)
		return rc;
	size_t pixels = (size_t)p.image.width * p.image.height;
	unsigned char *bytes = mem_alloc(pixels, 3);
	if (bytes) {
		struct tonemap_counts n = tonemap_image(p.rgb, pixels, a->stops, bytes);
		if (n.nan || n.infinite)
			fprintf(stderr, "hslt-tonemap: %s: %zu values are not numbers, %zu are infinite\n", a->input,
				n.nan, n.infinite);
		rc = picture_write_png(a->output, bytes, p.image.width, p.image.height, e);
	} else {
		rc = error_set(e, ENOMEM, "%s: no memory for %zu pixels", a->input, pixels);
	}
	mem_free(bytes);
	picture_fini(&p);
	return rc;
}

int main(int argc, char **argv)
{
	struct arguments a = {0};
	struct error e;
	program_parse_options(&program, argc, argv, &a);
	if (tonemap_file(&a, &e) == 0)
		return 0;
	fprintf(stderr, "hslt-tonemap: %s\n", e.text);
	return 1;
}
