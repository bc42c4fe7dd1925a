/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/scene/compatibility.h"
#include "worker/cli/scene/scene_report.h"

#include "common/base/program.h"
#include "worker/cli/base/options.h"
#include "worker/cli/base/source_place.h"

#include <stdio.h>
#include <string.h>

struct arguments {
	struct render_arguments render;
	const char *verb;
	bool json, lenient;
};

static const struct option_row option_rows[] = {
	{"define", 'D', "NAME=VALUE", "Value of $NAME in the scene", OPTION_CUSTOM(option_define)},
	{"path", 'p', "FOLDER", "Search here for files that are not in the scene's folder; may be repeated",
	 OPTION_CUSTOM(option_path)},
	{"lenient", 'l', NULL,
	 "Like --lenient of hslt-render: leave out or replace what is not supported, with a note instead of a problem",
	 OPTION_FLAG(struct arguments, lenient)},
	{"json", 'j', NULL, "show: one JSON object", OPTION_FLAG(struct arguments, json)},
	{0},
};

static const char *verb_at(size_t i)
{
	static const char *const verbs[] = {"check", "show", "compatibility", NULL};
	return verbs[i];
}

static int parse_word(void *target, size_t index, char *word, struct error *e)
{
	struct arguments *a = target;
	if (index > 1)
		return error_set(e, EINVAL, "only one scene is accepted");
	*(index == 0 ? &a->verb : &a->render.scene) = word;
	return 0;
}

static int check_options(void *target, struct error *e)
{
	const struct arguments *a = target;
	bool reads = strcmp(a->verb, "compatibility") != 0;
	if (reads && !a->render.scene)
		return error_set(e, EINVAL, "`%s SCENE.xml`: a scene is needed", a->verb);
	if (!reads && a->render.scene)
		return error_set(e, EINVAL, "compatibility does not take a scene");
	if (a->json && strcmp(a->verb, "show") != 0)
		return error_set(e, EINVAL, "--json is only for show");
	return 0;
}

static const struct program program = {
	.name = "hslt-scene",
	.synopsis = "check|show SCENE.xml\ncompatibility",
	.summary = "Lists the problems of a scene file, or what was read from it. Renders nothing.",
	.examples = "hslt-scene check room.xml\n"
		    "hslt-scene check -D light=sun room.xml\n"
		    "hslt-scene show --json room.xml",
	.details =
		"check: a line with file, line and element for everything that is wrong or not supported, and a "
		"`note:` for what is ignored.\nshow: film, camera, counts, the effects that the scene needs, "
		"and its files with the first digits of their SHA-256.\ncompatibility: what is supported of Mitsuba's "
		"scenes, all plug-ins and parameters, as in docs/compatibility.md.",
	.exit_codes = "0 the scene can be rendered, 1 it cannot, 2 usage",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_options},
	.verbs = verb_at,
	.parse_word = parse_word,
};

int main(int argc, char **argv)
{
	static struct arguments a;
	struct error e;
	bool bad = false;
	program_parse_options(&program, argc, argv, &a);
	if (!a.render.scene) {
		compatibility_print(stdout);
		return 0;
	}
	int rc = strcmp(a.verb, "check") == 0 ? scene_report_check(&a.render, a.lenient, &bad, &e)
					      : scene_report_show(&a.render, a.lenient, a.json, &e);
	if (rc)
		source_place_print(stderr, "hslt-scene: ", a.render.scene, e.text);
	return rc || bad ? 1 : 0;
}
