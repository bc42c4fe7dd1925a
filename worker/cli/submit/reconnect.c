/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/submit/reconnect.h"

#include "common/base/clock.h"
#include "common/base/target.h"
#include <stdio.h>

static const double first_pause = 0.25, longest_pause = 10;

static void sleep_seconds(double seconds)
{
	struct timespec t = {(time_t)seconds, (long)(1e9 * (seconds - (double)(time_t)seconds))};
	nanosleep(&t, NULL);
}

static bool is_gone(int rc)
{
	return rc == -ECONNRESET || rc == -ECONNREFUSED || rc == -ETIMEDOUT || rc == -EHOSTUNREACH;
}

static int try_once(struct client *cl, const struct submitted *job, const char *output, struct submit_end *end,
		    struct error *e)
{
	int rc = submit_wait(cl, job, end, e);
	/* Fetches also if the job made an image that has been deleted since: the coordinator's error tells that. */
	if (!rc && (end->has_result || end->exit_code != 3))
		rc = client_fetch(cl, job->job, FARM__WHAT__WHAT_RESULT, output, e);
	return rc;
}

/* Connects again and again, with growing pauses, until a coordinator answers or the patience is over. A refusal is
 * retried, too, because the coordinator accepted this client before: an expired certificate may be renewed, or a clock
 * corrected. */
static int call_again(struct client **cl, const struct reconnect *o, struct error *e)
{
	double gone = clock_seconds(), pause = first_pause;
	int rc;
	do {
		double left = gone + o->patience - clock_seconds();
		sleep_seconds(pause < left ? pause : left > 0 ? left : 0);
		pause = 2 * pause < longest_pause ? 2 * pause : longest_pause;
		rc = client_open(cl, o->coordinator, o->tls, o->insecure, "hslt-submit", e);
	} while ((is_gone(rc) || rc == -EKEYEXPIRED) && clock_seconds() - gone < o->patience);
	return rc;
}

int reconnect_job(struct client **cl, const struct reconnect *o, const struct submitted *job, const char *output,
		  struct submit_end *end, struct error *e)
{
	int rc;
	while (is_gone(rc = try_once(*cl, job, output, end, e))) {
		client_close(*cl);
		*cl = NULL;
		fprintf(stderr, "hslt-submit: %s; trying again for %g s\n", e->text, o->patience);
		rc = call_again(cl, o, e);
		if (is_gone(rc))
			return error_set(
				e, ECONNREFUSED,
				"no coordinator at %s for %g s. The job is in its spool and continues when it is back: hslt-job "
				"fetch j%llu -o %s",
				o->coordinator, o->patience, (unsigned long long)job->job, target_arg(output));
		if (rc == -EKEYEXPIRED) {
			struct error why = *e;
			return error_set(e, EKEYEXPIRED, "%s. The job continues: hslt-job fetch j%llu -o %s", why.text,
					 (unsigned long long)job->job, target_arg(output));
		}
		if (rc)
			break;
	}
	if (rc && end->has_result) {
		struct error why = *e;
		rc = error_set(e, -rc, "%s. The image stays on the farm: hslt-job fetch j%llu -o FILE", why.text,
			       (unsigned long long)job->job);
	}
	return rc;
}
