/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/submit/reconnect.h"

#include "common/base/clock.h"
#include "common/base/output_target.h"
#include <stdio.h>

static const double initial_pause = 0.25, max_pause = 10;

static void sleep_seconds(double seconds)
{
	struct timespec t = {(time_t)seconds, (long)(1e9 * (seconds - (double)(time_t)seconds))};
	nanosleep(&t, NULL);
}

static bool is_connection_lost(int rc)
{
	return rc == -ECONNRESET || rc == -ECONNREFUSED || rc == -ETIMEDOUT || rc == -EHOSTUNREACH;
}

static int wait_and_fetch(struct client *cl, const struct submitted_job *job, const char *output,
			  struct submit_outcome *outcome, struct error *e)
{
	int rc = submit_wait(cl, job, outcome, e);
	/* Fetches also if the job made an image that has been deleted since: the coordinator's error tells that. */
	if (!rc && (outcome->has_result || outcome->exit_code != 3))
		rc = client_fetch(cl, job->job, FARM__WHAT__WHAT_RESULT, output, e);
	return rc;
}

/* Connects again and again, with growing pauses, until a coordinator answers or the patience is over. A refusal is
 * retried, too, because the coordinator accepted this client before: an expired certificate may be renewed, or a clock
 * corrected. */
static int reconnect_client(struct client **cl, const struct reconnect *o, struct error *e)
{
	double lost_at = clock_seconds(), pause = initial_pause;
	int rc;
	do {
		double remaining = lost_at + o->patience_seconds - clock_seconds();
		sleep_seconds(pause < remaining ? pause : remaining > 0 ? remaining : 0);
		pause = 2 * pause < max_pause ? 2 * pause : max_pause;
		rc = client_open(cl, o->coordinator, o->tls, o->insecure, "hslt-submit", e);
	} while ((is_connection_lost(rc) || rc == -EKEYEXPIRED) && clock_seconds() - lost_at < o->patience_seconds);
	return rc;
}

int reconnect_job(struct client **cl, const struct reconnect *o, const struct submitted_job *job, const char *output,
		  struct submit_outcome *outcome, struct error *e)
{
	int rc;
	while (is_connection_lost(rc = wait_and_fetch(*cl, job, output, outcome, e))) {
		client_close(*cl);
		*cl = NULL;
		fprintf(stderr, "hslt-submit: %s; trying again for %g s\n", e->text, o->patience_seconds);
		rc = reconnect_client(cl, o, e);
		if (is_connection_lost(rc))
			return error_set(
				e, ECONNREFUSED,
				"no coordinator at %s for %g s. The job is in its spool and continues when it is back: hslt-job "
				"fetch j%llu -o %s",
				o->coordinator, o->patience_seconds, (unsigned long long)job->job,
				output_target_to_arg(output));
		if (rc == -EKEYEXPIRED) {
			struct error why = *e;
			return error_set(e, EKEYEXPIRED, "%s. The job continues: hslt-job fetch j%llu -o %s", why.text,
					 (unsigned long long)job->job, output_target_to_arg(output));
		}
		if (rc)
			break;
	}
	if (rc && outcome->has_result) {
		struct error why = *e;
		rc = error_set(e, -rc, "%s. The image stays on the farm: hslt-job fetch j%llu -o FILE", why.text,
			       (unsigned long long)job->job);
	}
	return rc;
}
