/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/mem.h"
#include "common/base/output.h"
#include "common/base/version.h"
#include "common/exr/image_file.h"
#include "worker/cli/image/assemble.h"

#include <argp.h>
#include <stdio.h>

const char *argp_program_version = "hslt-assemble " HSLT_VERSION;

static const char doc[] =
	"Puts crops of one render (hslt-render --crop, hslt-submit --crop) together to one image."
	"\v"
	"Example:\n"
	"  hslt-render room.xml -o left.exr --size 640x360 --crop 0,0,320,360\n"
	"  hslt-render room.xml -o right.exr --size 640x360 --crop 320,0,320,360\n"
	"  hslt-assemble left.exr right.exr -o room.exr\n"
	"\n"
	"The crops must not overlap, and must fill a rectangle. Errors of pixels stay what they are; hslt:relMSE is the mean over pixels. What "
	"crops say in common stays in the header, counts are added up.\n"
	"deploy/crops.sh submits a grid of crops to one coordinator or several, and calls this.\n"
	"Exit codes: 0 done, 1 failed, 2 usage, 5 done, but chains of some crop disagree.";

static const struct argp_option options[] = {
	{"output", 'o', "FILE", 0, "The image", 0},
	{0},
};

enum { CROPS_MOST = 4096 };

struct arguments {
	const char *out, *crops[CROPS_MOST];
	size_t count;
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct arguments *a = state->input;
	switch (key) {
	case 'o':
		a->out = arg;
		return 0;
	case ARGP_KEY_ARG:
		if (a->count == CROPS_MOST)
			argp_error(state, "at most %d crops", CROPS_MOST);
		a->crops[a->count++] = arg;
		return 0;
	case ARGP_KEY_END:
		if (!a->count || !a->out)
			argp_error(state, "crops and -o FILE are needed");
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

int main(int argc, char **argv)
{
	static struct arguments a;
	struct error e;
	unsigned char *bytes = NULL;
	size_t size;
	bool disagree = false;
	output_check_at_exit();
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse, "CROP.exr...", doc, NULL, NULL, NULL}, argc, argv, 0, NULL, &a);
	int rc = assemble(a.crops, a.count, &bytes, &size, &disagree, &e);
	if (!rc)
		rc = image_file_write(a.out, bytes, size, &e);
	mem_free(bytes);
	if (rc)
		fprintf(stderr, "hslt-assemble: %s\n", e.text);
	else if (disagree)
		fprintf(stderr,
			"hslt-assemble: chains of some crops disagree: hslt:disagreement in the header says where\n");
	return rc ? 1 : disagree ? 5 : 0;
}
