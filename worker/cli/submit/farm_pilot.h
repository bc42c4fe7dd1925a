/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A pilot on a farm (pilot.h): a probe and a short render as separate jobs, whose error estimates come with their
 * status. One thread; shows progress on stderr.
 */
#ifndef WORKER_CLI_SUBMIT_FARM_PILOT_H
#define WORKER_CLI_SUBMIT_FARM_PILOT_H

#include "worker/cli/submit/submit.h"

struct farm_pilot {
	/* in */
	struct client *client;
	const struct submit_request *request; /* of the render, its plan request complete */
	const struct scene_files *files;
	double seconds;
	/* out */
	struct plan render, plan; /* of the render being predicted; of the pilot */
	struct submit_end end;	  /* of the pilot */
};

/* -ECANCELED: a job failed. */
int farm_pilot(struct farm_pilot *p, struct error *e);

#endif
