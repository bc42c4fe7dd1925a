/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The options that hslt-render and hslt-submit share: what to render of a scene, and how. Parsed by glibc's argp as a
 * child of each program's own table. One thread.
 */
#ifndef WORKER_CLI_BASE_OPTIONS_H
#define WORKER_CLI_BASE_OPTIONS_H

#include "worker/render/render.h"

#include <argp.h>

enum { OPTION_DEFINES_MAX = 256, OPTION_PATHS_MAX = ASSET_FOLDERS_MAX - 1 };

struct render_arguments {
	struct plan_request plan;
	struct render_options render;
	struct scene_define defines[OPTION_DEFINES_MAX];
	size_t define_count;
	const char *paths[OPTION_PATHS_MAX]; /* of --path, in their order */
	size_t path_count;
	const char *mixture; /* of --mutations LIST; NULL: not given */
};

/* Input of the child: a struct render_arguments. Keys from 1000 on are its own, and the short ones 'i' and 'D'. */
extern const struct argp render_argp;

/* Which integrator is left to the scene: choice_make (worker/cli/render/choice.h) finds it after
 * render_plan_from_scene. */
bool integrator_is_open(const struct plan_request *r);

/* Fills in what the options left to the scene: film, depth, samples, mixture of mutations. -EINVAL: the mixture
 * that was asked for is none, a usage error. */
int render_plan_from_scene(struct render_arguments *a, const struct render_summary *s, struct error *e);

/* A whole number, also as "1.5k", or the usage error of `option`. Seconds: also as "5m" or "2h". */
uint64_t option_whole(const struct argp_state *state, const char *option, const char *arg);
unsigned option_threads(const struct argp_state *state, const char *arg);
unsigned option_threads_default(void); /* as many as processors */
double option_seconds(const struct argp_state *state, const char *option, const char *arg);

/* The file of an image, which is OpenEXR: the usage error where its name says that it is something else. "-" is
 * /dev/stdout. */
const char *option_image(const struct argp_state *state, const char *arg);

/* The folders in which the scene's files are searched: its own, then those of --path. */
struct asset_folders option_folders(const struct render_arguments *a, const char *folder);

/* A folder of --path, which must be there, appended to paths; else a usage error. */
void option_path(const struct argp_state *state, const char *arg, const char **paths, size_t *count);

/* "a/b/room.xml" -> "a/b" and "room.xml"; both to be mem_free'd. */
int scene_path_split(const char *path, char **folder, char **name, struct error *e);

#endif
