/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/render/pilot_request.h"

#include "worker/cli/base/options.h"

#include <math.h>

enum {
	PROBE_BOOTSTRAP = 16384,
	PROBE_EPOCH = 16,	     /* mutations per chain; starting a chain costs about one */
	PROBE_SAMPLES_MAX = 1 << 21, /* if the shortest round has more samples, there is no probe */
};
static const double unreachable_error = 1e-9;	/* a target error that no pilot reaches */
static const double max_bootstrap_share = 0.25; /* of the pilot's time, at most */
static const double probe_seconds = 1; /* of one thread: limits the probe's bootstrap if samples take many rays */

int pilot_plan_from_scene(struct render_arguments *a, const struct render_summary *summary, struct error *e)
{
	double target = a->plan.target_error;
	a->plan.target_error = target > 0 ? target : 1; /* set, so that the scene's is not used */
	int rc = render_plan_from_scene(a, summary, e);
	a->plan.target_error = target;
	return rc;
}

static struct plan_request unbounded_request(const struct plan_request *request, const struct plan *render)
{
	struct plan_request r = *request;
	r.spp = r.mutations = 0;
	r.seconds = 0;
	r.target_error = unreachable_error;
	r.groups = render->groups;
	r.chains = render->chains;
	r.bootstrap = render->bootstrap;
	return r;
}

int pilot_render_plan(const struct plan_request *request, struct plan *render, struct error *e)
{
	struct plan_request r = *request;
	if (!(r.target_error > 0))
		r.target_error = 0.01; /* the smallest error that predictions name */
	int rc = plan_make(&r, render, e);
	if (!rc && render->groups < 2)
		rc = error_set(e, EINVAL, "a single group has no error: give --groups 2 or more");
	return rc;
}

bool pilot_probe_request(const struct plan_request *request, const struct plan *render, struct plan_request *probe)
{
	*probe = unbounded_request(request, render);
	uint64_t room = plan_affordable_bootstrap(request, probe_seconds);
	probe->bootstrap = room < PROBE_BOOTSTRAP ? room : PROBE_BOOTSTRAP;
	if (render->bootstrap < probe->bootstrap)
		probe->bootstrap = render->bootstrap;
	probe->epoch = 1;
	if (render->kind == PLAN_CHAINS) {
		probe->epoch = PROBE_EPOCH;
		probe->mutations = (uint64_t)render->chains * PROBE_EPOCH;
		return true;
	}
	uint64_t round = plan_extended_pixels(render) * render->groups;
	probe->spp = render->groups;
	return round <= PROBE_SAMPLES_MAX;
}

void pilot_request(const struct plan_request *request, const struct plan *render, const struct plan_request *probe,
		   const struct pilot_cost *cost, double seconds, struct plan_request *pilot)
{
	*pilot = unbounded_request(request, render);
	pilot->seconds = seconds;
	pilot->epoch = 1;
	if (!cost)
		return;
	double sample = cost->bootstrap_seconds / (double)probe->bootstrap,
	       max_bootstrap = max_bootstrap_share * seconds / sample;
	if (max_bootstrap < (double)pilot->bootstrap)
		pilot->bootstrap = (uint64_t)fmax((double)probe->bootstrap, max_bootstrap);
	double remaining = fmax(seconds - sample * (double)pilot->bootstrap, seconds / 4);
	double epochs = remaining / PILOT_ROUNDS / cost->round_seconds;
	/* The pilot's epoch is at most the render's. */
	double max_epochs = (double)render->epoch / (double)probe->epoch;
	pilot->epoch = (uint64_t)fmax(1, (double)probe->epoch * fmin(epochs, max_epochs));
}
