/* SPDX-License-Identifier: Apache-2.0 */
/* hslt-scene: lists the problems of a scene file, or what was read from it. Renders nothing. */
#ifndef WORKER_CLI_SCENE_REPORT_H
#define WORKER_CLI_SCENE_REPORT_H

#include "worker/cli/base/options.h"

struct scene_request {
	const char *path;
	struct scene_define defines[OPTION_DEFINES_MAX];
	size_t define_count;
	const char *paths[OPTION_PATHS_MAX]; /* where files that are not in the scene's folder are searched */
	size_t path_count;
	bool lenient; /* leave out or replace what is not supported, with a note */
};

/* Prints a line for everything that is wrong, not supported or ignored, and a summary. *bad: the scene cannot be
 * rendered. */
int scene_report_check(const struct scene_request *r, bool *bad, struct error *e);

/* Prints what was read: film, camera, counts, files with sizes and SHA-256; optionally as one JSON object. */
int scene_report_show(const struct scene_request *r, bool json, struct error *e);

#endif
