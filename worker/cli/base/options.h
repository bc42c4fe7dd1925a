/* SPDX-License-Identifier: Apache-2.0 */
/* The options that hslt-render, hslt-submit and hslt-accuracy share: what to render of a scene, and how. One thread. */
#ifndef WORKER_CLI_BASE_OPTIONS_H
#define WORKER_CLI_BASE_OPTIONS_H

#include "common/base/option.h"
#include "common/plan/plan_text.h"
#include "worker/render/render.h"

enum { OPTION_DEFINES_MAX = PLAN_DEFINES_MAX, OPTION_PATHS_MAX = ASSET_FOLDERS_MAX - 1 };

/* A program's arguments begin with it. */
struct render_arguments {
	const char *scene, *output;
	struct plan_request plan;
	struct render_options render;
	struct scene_define defines[OPTION_DEFINES_MAX];
	size_t define_count;
	const char *paths[OPTION_PATHS_MAX]; /* of --path, in order */
	size_t path_count;
	const char *mixture; /* of --mutations LIST; NULL: not given */
	const char
		*sensor; /* the id given to --sensor; NULL: none, or it has been resolved to a number in the settings */
};

extern const struct option_table render_table; /* fills a struct render_arguments */

/* Whether the choice of the integrator is left to the scene: choice_make (worker/cli/render/choice.h) makes it after
 * render_plan_from_scene. */
bool integrator_is_open(const struct plan_request *r);

/* Fills in what the options left to the scene: film, depth, samples, mixture of mutations. -EINVAL: the given
 * mixture is invalid, a usage error. */
int render_plan_from_scene(struct render_arguments *a, const struct render_summary *s, struct error *e);

/* That the integrator's chains hold shorter paths than the plan has; empty: they do not. */
void option_depth_note(const char *integrator, uint32_t max_depth, char *text, size_t size);

unsigned option_threads_default(void); /* number of processors */

/* For rows of tables: they fill a struct render_arguments; -EINVAL with a sentence is a usage error. The output, which
 * is OpenEXR: an error if its name has another ending. "-" is /dev/stdout. */
int option_image(void *target, char *arg, struct error *e);
int option_path(void *target, char *arg, struct error *e);   /* a folder of --path, which must exist */
int option_define(void *target, char *arg, struct error *e); /* NAME=VALUE of -D, split in place */

/* For a program with one scene: the index-th word that is not an option. */
int option_scene(void *target, size_t index, char *word, struct error *e);

/* render_scene_read; a sensor given by id becomes a number in the settings. */
int option_scene_read(struct scene *s, const struct asset_source *assets, const char *name, struct render_arguments *a,
		      struct error *e);

/* The options that plan_options_with writes; the texts are borrowed. */
void option_plan_scene(const struct render_arguments *a, struct plan_scene *out);

/* The folders in which the scene's files are searched: its own, then those of --path. */
struct asset_folders option_folders(const struct render_arguments *a, const char *folder);

/* "a/b/room.xml" -> "a/b" and "room.xml"; free both with mem_free. -ENOENT: it is not there, and no --path may hold it.
 */
int scene_path_split(const char *path, const struct render_arguments *a, char **folder, char **name, struct error *e);

#endif
