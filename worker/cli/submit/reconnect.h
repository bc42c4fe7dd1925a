/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Waits for a job across restarts of its coordinator: reconnects, with growing pauses, and continues to watch the job.
 * One thread.
 */
#ifndef WORKER_CLI_SUBMIT_RECONNECT_H
#define WORKER_CLI_SUBMIT_RECONNECT_H

#include "worker/cli/submit/submit.h"

struct reconnect {
	const char *coordinator, *tls;
	bool insecure;
	double patience_seconds; /* how long to wait for a coordinator */
};

/* Waits for the job's end and fetches its result, if there is one, into `output`. *cl may be another connection
 * afterwards, or NULL. Returns -ECONNREFUSED if no coordinator answered within `patience_seconds`, -EKEYEXPIRED if a
 * certificate stayed expired for as long (in both cases the sentence says how to get the image later), -ESTALE if
 * another job has the number now, or another error of the client. */
int reconnect_job(struct client **cl, const struct reconnect *o, const struct submitted_job *job, const char *output,
		  struct submit_outcome *outcome, struct error *e);

#endif
