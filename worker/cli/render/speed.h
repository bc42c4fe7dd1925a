/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Measures how fast one thread of this machine renders a scene, which determines the length of an epoch
 * (plan_request.speed). This is a render of its own, of about a second. It is measured in CPU time, so that other
 * programs on the machine do not matter. Threads as in local_run.h.
 */
#ifndef WORKER_CLI_RENDER_SPEED_H
#define WORKER_CLI_RENDER_SPEED_H

#include "worker/cli/base/options.h"

/* *speed: mutations or samples per second; 0: no light was found. The plan request in `a` must be complete. */
int speed_measure(const struct render_arguments *a, const char *folder, const char *name, double *speed,
		  struct error *e);

#endif
