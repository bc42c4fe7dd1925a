/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A pilot on a farm (pilot_request.h): a probe and a short render, each a job of its own, whose estimates of the error
 * come with the job's status. One thread; shows progress on stderr.
 */
#ifndef WORKER_CLI_SUBMIT_FARM_PILOT_H
#define WORKER_CLI_SUBMIT_FARM_PILOT_H

#include "worker/cli/submit/submit.h"

struct farm_pilot {
	/* Set by the caller. */
	struct client *client;
	const struct submit_request *request; /* the render to be predicted; its plan request is complete */
	const struct scene_files *files;
	double seconds; /* time for the pilot */
	/* Set by farm_pilot. */
	struct plan render, plan;      /* the plans of the render and of the pilot */
	struct submit_outcome outcome; /* the end of the pilot, with its estimates */
};

/* Runs the pilot. Returns 0, -ECANCELED if one of its jobs failed, or an error of the connection. */
int farm_pilot(struct farm_pilot *p, struct error *e);

#endif
