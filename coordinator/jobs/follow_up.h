/* SPDX-License-Identifier: Apache-2.0 */
/* What follows from the core's answers: the table by which a step reaches all that steps in its turn (step.h). */
#ifndef COORDINATOR_JOBS_FOLLOW_UP_H
#define COORDINATOR_JOBS_FOLLOW_UP_H

#include "coordinator/jobs/step.h"

extern const struct follow_up follow_up;

#endif
