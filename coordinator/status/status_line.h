/* SPDX-License-Identifier: Apache-2.0 */
/* Lines of the status socket about jobs, as JSON; NULL if memory runs out. The loop's thread. */
#ifndef COORDINATOR_STATUS_STATUS_LINE_H
#define COORDINATOR_STATUS_STATUS_LINE_H

#include "coordinator/live_job/jobs.h"

#include <jansson.h>

enum { LINES_ENDED_MAX = 50 /* ended jobs in a snapshot, or on one page */ };

json_t *line_new(const char *type); /* an object with schema, type and time */
json_t *line_error(const char *text);
json_t *line_job(struct jobs *jobs, const char *name); /* one job with its details, or an error; name: "j12" */
/* A page: the LINES_ENDED_MAX ended jobs with the highest ids below that of `before`, without details; before NULL: the
 * first page. */
json_t *line_ended_jobs(struct jobs *jobs, const char *before);

#endif
