/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/scene/compatibility.h"
#include "worker/cli/scene/scene_report.h"

#include "common/base/output.h"
#include "common/base/version.h"
#include "worker/cli/base/options.h"

#include <argp.h>
#include <stdio.h>
#include <string.h>

const char *argp_program_version = "hslt-scene " HSLT_VERSION;

static const char doc[] =
	"Says what is wrong with a scene file, or what was read of it. Renders nothing."
	"\v"
	"check: everything that is wrong or not supported, a line each with file, line and element, and as `note:` what is ignored.\n"
	"show: film, camera, counts, the effects that the scene calls for, and its files with the beginning of their SHA-256.\n"
	"compatibility: what is read of Mitsuba's scenes, all plug-ins and parameters, as docs/compatibility.md has it.\n"
	"\n"
	"Examples:\n"
	"  hslt-scene check room.xml\n"
	"  hslt-scene check -D light=sun room.xml\n"
	"  hslt-scene show --json room.xml\n"
	"\n"
	"Exit codes: 0 the scene can be rendered, 1 it cannot, 2 usage.";

static const struct argp_option options[] = {
	{"define", 'D', "NAME=VALUE", 0, "For $NAME in the scene", 0},
	{"path", 'p', "FOLDER", 0, "Where files that are not in the scene's folder are searched; may be given again",
	 0},
	{"lenient", 'l', NULL, 0,
	 "As --lenient of hslt-render: what is not supported is left out or replaced, and is no problem but a note", 0},
	{"json", 'j', NULL, 0, "show: one JSON object", 0},
	{0},
};

struct arguments {
	const char *verb;
	bool json;
	struct scene_request request;
};

/* NAME=VALUE; the name is cut out in place. */
static void take_define(struct scene_request *r, char *arg, struct argp_state *state)
{
	char *value = strchr(arg, '=');
	if (!value || value == arg)
		argp_error(state, "-D takes NAME=VALUE, not '%s'", arg);
	if (r->define_count == sizeof r->defines / sizeof *r->defines)
		argp_error(state, "too many -D");
	*value = 0;
	r->defines[r->define_count++] = (struct scene_define){arg, value + 1};
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct arguments *a = state->input;
	switch (key) {
	case 'D':
		take_define(&a->request, arg, state);
		return 0;
	case 'p':
		option_path(state, arg, a->request.paths, &a->request.path_count);
		return 0;
	case 'l':
		a->request.lenient = true;
		return 0;
	case 'j':
		a->json = true;
		return 0;
	case ARGP_KEY_ARG:
		if (a->request.path)
			argp_error(state, "one scene, not more");
		*(a->verb ? &a->request.path : &a->verb) = arg;
		return 0;
	case ARGP_KEY_END:
		if (a->verb && strcmp(a->verb, "compatibility") == 0 && !a->request.path)
			return 0;
		if (!a->request.path)
			argp_error(state, "`check SCENE.xml` or `show SCENE.xml` is needed");
		if (strcmp(a->verb, "check") != 0 && strcmp(a->verb, "show") != 0)
			argp_error(state, "'%s' is neither check nor show", a->verb);
		if (a->json && strcmp(a->verb, "show") != 0)
			argp_error(state, "--json belongs to show");
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

int main(int argc, char **argv)
{
	static struct arguments a;
	struct error e;
	bool bad = false;
	output_check_at_exit();
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse, "check|show SCENE.xml\ncompatibility", doc, NULL, NULL, NULL}, argc,
		   argv, 0, NULL, &a);
	if (!a.request.path) {
		compatibility_print(stdout);
		return 0;
	}
	int rc = strcmp(a.verb, "check") == 0 ? scene_report_check(&a.request, &bad, &e)
					      : scene_report_show(&a.request, a.json, &e);
	if (rc)
		fprintf(stderr, "hslt-scene: %s\n", e.text);
	return rc || bad ? 1 : 0;
}
