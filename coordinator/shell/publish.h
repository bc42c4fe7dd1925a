/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Work on a whole film: its error, its image as EXR in the spool. Runs in the pool; the order is busy meanwhile and its
 * results wait. Started and finished on the loop's thread. Starting allocates nothing and cannot fail; an image of the
 * result for which there is no memory or no disk is made again later.
 */
#ifndef COORDINATOR_SHELL_PUBLISH_H
#define COORDINATOR_SHELL_PUBLISH_H

#include "common/estimate/convergence.h"
#include "common/estimate/canvas_image.h"
#include "coordinator/core/farm.h"

#include <uv.h>

struct jobs;
struct live_job;

enum publish_what {
	PUBLISH_ERROR_ONLY, /* answered by EVENT_ERROR_KNOWN */
	PUBLISH_PREVIEW,    /* preview.exr */
	PUBLISH_RESULT,	    /* result.exr */
};

struct publishing { /* one of an order at a time */
	uv_work_t work;
	struct jobs *jobs;
	struct live_job *order;
	enum publish_what what;
	uint64_t rounds;
	double wall_seconds;
	enum job_end end;
	struct canvas_image image;
	struct convergence agreement;
	int rc;
	struct error error;
};

void publish_start(struct jobs *s, struct live_job *o, enum publish_what what, uint64_t rounds);

#endif
