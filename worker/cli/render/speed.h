/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Measures how fast one thread of this machine renders a scene, for the length of an epoch (struct plan_request.speed):
 * a separate render of about a second, in CPU time, so that a busy machine does not matter. Threads as in local.h.
 */
#ifndef WORKER_CLI_RENDER_SPEED_H
#define WORKER_CLI_RENDER_SPEED_H

#include "worker/cli/base/options.h"

/* Mutations or samples a second; 0: no light was found. The plan of `a` must be complete. */
int speed_measure(const struct render_arguments *a, const char *folder, const char *scene, double *speed,
		  struct error *e);

#endif
