/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/render/eta.h"

#include <math.h>

double eta_seconds(const struct plan *plan, const struct local_progress *p, double forecast)
{
	bool has_speed = p->rounds > 0 && p->round_seconds > 0;
	double speed = has_speed ? p->rounds / p->round_seconds : 0, remaining = INFINITY;
	if (has_speed && isfinite(p->rounds_remaining))
		remaining = p->rounds_remaining / speed;
	if (forecast > 0)
		remaining = fmin(remaining, fmax(forecast - p->seconds, 0));
	if (plan->seconds > 0)
		/* fmin ignores a NAN. */
		remaining = fmin(remaining, merge_seconds_remaining(plan, p->seconds, p->rounds, speed));
	return isfinite(remaining) ? remaining : NAN;
}
