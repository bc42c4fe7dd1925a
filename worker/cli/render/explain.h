/* SPDX-License-Identifier: Apache-2.0 */
/* Implements hslt-render --explain: prints which effects a scene needs and why, what omitting the others saves, which
 * integrators were considered and why one was chosen. Renders only the short pilots of that choice. One thread. */
#ifndef WORKER_CLI_RENDER_EXPLAIN_H
#define WORKER_CLI_RENDER_EXPLAIN_H

#include "worker/cli/base/options.h"

/* Reads the scene at `path` and prints the explanation on stdout; if `json` is set, as one JSON object.
 * *is_usage_error: the command line is wrong. */
int explain_scene(const char *path, struct render_arguments *a, bool json, bool *is_usage_error, struct error *e);

#endif
