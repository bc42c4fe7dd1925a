/* SPDX-License-Identifier: Apache-2.0 */
/* The table of what follows a step of the core, through which a step reaches code that itself makes steps (step.h). */
#ifndef COORDINATOR_JOBS_FOLLOW_UP_H
#define COORDINATOR_JOBS_FOLLOW_UP_H

#include "coordinator/jobs/step.h"

extern const struct follow_up follow_up;

#endif
