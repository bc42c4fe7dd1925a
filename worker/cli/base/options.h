/* SPDX-License-Identifier: Apache-2.0 */
/* The options that hslt-render, hslt-submit and hslt-accuracy share: what to render of a scene, and how. One thread. */
#ifndef WORKER_CLI_BASE_OPTIONS_H
#define WORKER_CLI_BASE_OPTIONS_H

#include "common/base/option.h"
#include "common/plan/plan_text.h"
#include "worker/render/render.h"

enum { OPTION_DEFINES_MAX = PLAN_DEFINES_MAX, OPTION_PATHS_MAX = ASSET_FOLDERS_MAX - 1 };

/* The first member of the arguments of each of these programs. */
struct render_arguments {
	const char *scene, *output;
	struct plan_request plan;
	struct render_options render;
	struct scene_define defines[OPTION_DEFINES_MAX];
	size_t define_count;
	const char *paths[OPTION_PATHS_MAX]; /* folders of --path, in order */
	size_t path_count;
	const char *mixture; /* the list of --mutations LIST; NULL: not given */
	const char *sensor;  /* the id of --sensor ID; NULL: not given, or stored as a number in the settings */
};

extern const struct option_table render_option_table; /* fills a struct render_arguments */

/* Returns whether the integrator is still to be chosen. choice_make (worker/cli/render/choice.h) chooses it, after
 * render_plan_from_scene. */
bool integrator_is_undecided(const struct plan_request *r);

/* Fills in the values that the options have left to the scene: film, depth, samples, mixture of mutations. Returns
 * -EINVAL, a usage error, if the given mixture is invalid or the integrator cannot render this scene. */
int render_plan_from_scene(struct render_arguments *a, const struct render_summary *summary, struct error *e);

/* Prints a note if the integrator's chains hold only shorter paths than the plan has; otherwise the text is empty. */
void option_depth_note(const char *integrator, uint32_t max_depth, char *text, size_t size);

unsigned option_threads_default(void); /* the number of processors */

/* Functions for option_row.parse, which fill a struct render_arguments; -EINVAL with a sentence is a usage error. */

/* Takes the image to write, which is OpenEXR; the extension of another format is an error. "-" is /dev/stdout. */
int option_image(void *target, char *arg, struct error *e);
int option_path(void *target, char *arg, struct error *e);   /* a folder of --path, which must exist */
int option_define(void *target, char *arg, struct error *e); /* NAME=VALUE of -D, split in place */

/* parse_word of a program that takes one scene. */
int option_scene(void *target, size_t index, char *word, struct error *e);

/* Like render_scene_read; also turns a sensor that was given by its id into a number in the settings. */
int option_scene_read(struct scene *s, const struct asset_source *assets, const char *name, struct render_arguments *a,
		      struct error *e);

/* Lists -D and --path for plan_print_options_with_scene; *out points to the texts of the arguments. */
void option_plan_scene(const struct render_arguments *a, struct plan_scene *out);

/* Returns the folders in which the scene's files are searched: its own, then those of --path. */
struct asset_folders option_folders(const struct render_arguments *a, const char *folder);

/* Splits "a/b/room.xml" into "a/b" and "room.xml", which are both freed with mem_free. Returns -ENOENT if there is no
 * such file and no --path in which it may be. */
int scene_path_split(const char *path, const struct render_arguments *a, char **folder, char **name, struct error *e);

#endif
