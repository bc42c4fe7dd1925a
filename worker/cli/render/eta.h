/* SPDX-License-Identifier: Apache-2.0 */
/* Predicts when a render on this machine ends. Pure; any thread. */
#ifndef WORKER_CLI_RENDER_ETA_H
#define WORKER_CLI_RENDER_ETA_H

#include "worker/cli/render/local_run.h"

/* Returns the seconds until the first bound ends the render; NAN: not known yet. Of the plan, the bound on time is
 * used. forecast: the seconds from the first bootstrap sample to the target error; 0: unknown. Work counts at the speed
 * of the rounds only, because bootstrap samples take another time. */
double eta_seconds(const struct plan *plan, const struct local_progress *p, double forecast);

#endif
