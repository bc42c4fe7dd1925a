/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How fast one thread of this machine is with a scene, for the length of an epoch (struct plan_request.speed): a render
 * of about a second on its own, in processor time, so that a busy machine does not show. Threads as local.h.
 */
#ifndef WORKER_CLI_RENDER_SPEED_H
#define WORKER_CLI_RENDER_SPEED_H

#include "worker/cli/base/options.h"

/* Mutations or samples a second; 0: no light was found. The plan of `a` is complete. */
int speed_measure(const struct render_arguments *a, const char *folder, const char *scene, double *speed,
		  struct error *e);

#endif
