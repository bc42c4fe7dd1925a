/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/mem.h"
#include "common/base/program.h"
#include "common/exr/image_file.h"
#include "common/exr/output_files.h"
#include "worker/cli/image/assemble.h"

#include <stdio.h>
#include <string.h>

enum { CROPS_MAX = 4096 };

struct arguments {
	const char *output, *crops[CROPS_MAX];
	size_t crop_count;
};

static const struct option_row option_rows[] = {
	{"output", 'o', "FILE", "The image; -: stdout", OPTION_OUTPUT(struct arguments, output)},
	{0},
};

static int parse_word(void *target, size_t index, char *word, struct error *e)
{
	struct arguments *a = target;
	if (index == CROPS_MAX)
		return error_set(e, EINVAL, "at most %d crops", CROPS_MAX);
	a->crops[a->crop_count++] = word;
	return 0;
}

static struct output_files list_outputs(const struct arguments *a)
{
	return (struct output_files){{{"-o", a->output, OUTPUT_EXR}}};
}

static int check_options(void *target, struct error *e)
{
	const struct arguments *a = target;
	struct output_files outputs = list_outputs(a);
	if (!a->crop_count || !a->output)
		return error_set(e, EINVAL, "crops and -o FILE are needed");
	return output_files_check_names(&outputs, e);
}

static const struct program program = {
	.name = "hslt-assemble",
	.synopsis = "CROP.exr...",
	.summary = "Assembles crops of one render (hslt-render --crop, hslt-submit --crop) into one image.",
	.examples = "hslt-render room.xml -o left.exr --size 640x360 --crop 0,0,320,360\n"
		    "hslt-render room.xml -o right.exr --size 640x360 --crop 320,0,320,360\n"
		    "hslt-assemble left.exr right.exr -o room.exr",
	.details = "The crops must not overlap, and must fill a rectangle. Errors of pixels are kept; hslt:relMSE "
		   "is the mean over pixels. Header attributes on which all crops agree are kept, counts are added.\n"
		   "deploy/crops.sh submits a grid of crops to one coordinator or several, and calls hslt-assemble.",
	.exit_codes = "0 done, 1 failed, 2 usage, 5 done, but chains of some crop disagree",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_options},
	.parse_word = parse_word,
};

int main(int argc, char **argv)
{
	static struct arguments a;
	struct error e;
	unsigned char *bytes = NULL;
	size_t size;
	bool disagree = false;
	program_parse_options(&program, argc, argv, &a);
	struct output_files outputs = list_outputs(&a);
	int rc = output_files_check(&outputs, a.crops, a.crop_count, &e);
	if (!rc)
		rc = assemble_crops(a.crops, a.crop_count, &bytes, &size, &disagree, &e);
	if (!rc)
		rc = image_file_write(a.output, bytes, size, &e);
	mem_free(bytes);
	if (rc)
		fprintf(stderr, "hslt-assemble: %s\n", e.text);
	else if (disagree)
		fprintf(stderr,
			"hslt-assemble: chains of some crops disagree: hslt:disagreement in the header says where\n");
	return rc ? 1 : disagree ? 5 : 0;
}
