/* SPDX-License-Identifier: Apache-2.0 */
/* hslt-scene: what is wrong with a scene file, and what was read of it. Renders nothing. */
#ifndef WORKER_CLI_SCENE_REPORT_H
#define WORKER_CLI_SCENE_REPORT_H

#include "worker/cli/base/options.h"

struct scene_request {
	const char *path;
	struct scene_define defines[OPTION_DEFINES_MAX];
	size_t define_count;
	const char *paths[OPTION_PATHS_MAX]; /* where files that are not in the scene's folder are searched */
	size_t path_count;
	bool lenient; /* what is not supported is left out or replaced, and noted */
};

/* Prints a line for everything that is wrong, not supported, or ignored, and one that sums up. *bad: the scene cannot
 * be rendered. */
int scene_report_check(const struct scene_request *r, bool *bad, struct error *e);

/* Prints what was read: film, camera, counts, files with sizes and SHA-256; as one JSON object where asked. */
int scene_report_show(const struct scene_request *r, bool json, struct error *e);

#endif
