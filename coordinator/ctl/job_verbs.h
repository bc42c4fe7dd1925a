/* SPDX-License-Identifier: Apache-2.0 */
/* The verbs of hslt-job: each asks the coordinator and prints the answer. */
#ifndef COORDINATOR_CTL_JOB_VERBS_H
#define COORDINATOR_CTL_JOB_VERBS_H

#include "common/net/client.h"
#include "coordinator/ctl/job_options.h"

/* -ENOENT: the coordinator refuses. */
int job_verb(struct client *cl, const struct job_options *o, struct error *e);

#endif
