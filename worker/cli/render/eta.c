/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/render/eta.h"

#include <math.h>

double eta_seconds(const struct plan *plan, const struct local_progress *p, double forecast)
{
	bool known = p->rounds > 0 && p->round_seconds > 0;
	double speed = known ? p->rounds / p->round_seconds : 0, left = INFINITY;
	if (known && isfinite(p->rounds_left))
		left = p->rounds_left / speed;
	if (forecast > 0)
		left = fmin(left, fmax(forecast - p->seconds, 0));
	if (plan->seconds > 0)
		left = fmin(left, merge_seconds_left(plan, p->seconds, p->rounds, speed)); /* fmin ignores a NAN */
	return isfinite(left) ? left : NAN;
}
