/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Waits for a job across restarts of its coordinator: reconnects, with growing pauses, and continues to watch. One
 * thread.
 */
#ifndef WORKER_CLI_SUBMIT_RECONNECT_H
#define WORKER_CLI_SUBMIT_RECONNECT_H

#include "worker/cli/submit/submit.h"

struct reconnect {
	const char *coordinator, *tls;
	bool insecure;
	double patience; /* s without a coordinator */
};

/* Waits for the job's end and fetches its result, if there is one, into `output`. *cl may be another connection
 * afterwards, or NULL. -ECONNREFUSED: nobody answered for longer than `patience`; -EKEYEXPIRED: a certificate had
 * expired for as long; the sentence says how to get the image later. -ESTALE: another job has its number. */
int reconnect_job(struct client **cl, const struct reconnect *o, const struct submitted *job, const char *output,
		  struct submit_end *end, struct error *e);

#endif
