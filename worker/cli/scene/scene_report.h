/* SPDX-License-Identifier: Apache-2.0 */
/* The reports of hslt-scene: the problems of a scene file, or what was read from it. Renders nothing. */
#ifndef WORKER_CLI_SCENE_SCENE_REPORT_H
#define WORKER_CLI_SCENE_SCENE_REPORT_H

#include "worker/cli/base/options.h"

/* Prints a line for everything that is wrong, not supported or ignored, and a summary. Of the arguments, scene, defines
 * and paths are used. *bad: the scene cannot be rendered. lenient: unsupported parts are left out or replaced, with a
 * note. */
int scene_report_check(const struct render_arguments *a, bool lenient, bool *bad, struct error *e);

/* Prints what was read from the scene: film, camera, counts, files with sizes and SHA-256; if `json` is set, as one
 * JSON object. */
int scene_report_show(const struct render_arguments *a, bool lenient, bool json, struct error *e);

#endif
