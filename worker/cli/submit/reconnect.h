/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Waiting for a job through restarts of its coordinator: who waits calls again, later each time, and goes on watching.
 * One thread.
 */
#ifndef WORKER_CLI_SUBMIT_RECONNECT_H
#define WORKER_CLI_SUBMIT_RECONNECT_H

#include "worker/cli/submit/submit.h"

struct reconnect {
	const char *coordinator, *tls;
	bool insecure;
	double patience; /* s without a coordinator */
};

/* Waits for the job's end and fetches its result, if it has one, into `output`. *cl may be another one afterwards, or
 * NULL. -ECONNREFUSED when nobody was there for longer than `patience`; the sentence says how the image can be had
 * later. -ESTALE: another job has its number. */
int reconnect_job(struct client **cl, const struct reconnect *o, const struct submitted *job, const char *output,
		  struct submit_end *end, struct error *e);

#endif
