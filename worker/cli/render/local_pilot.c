/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/render/local_pilot.h"

#include "worker/cli/render/pilot_request.h"

static void on_round(void *user, const struct local_round *r)
{
	struct local_pilot *p = user;
	if (r->image)
		forecast_add_image(&p->looks, &p->plan, r->image, r->cpu_seconds, r->seconds);
	/* If there are few estimates when the time is over, as on a busy machine, the pilot goes on until there are
	 * enough for a prediction with wide intervals, but not for ever. */
	double seconds = r->bootstrap_seconds + r->seconds;
	bool enough = p->looks.count >= PILOT_LOOKS_MIN || r->rounds >= PILOT_ROUNDS_MAX;
	p->has_ended = p->is_timed && enough && seconds >= (p->looks.count < PILOT_LOOKS_WANTED ? 4 : 1) * p->seconds;
	if (p->has_ended)
		atomic_store(p->stop, true);
}

static void forward_progress(void *user, const struct local_progress *r)
{
	struct local_pilot *p = user;
	if (p->on_progress)
		p->on_progress(p->user, r);
}

/* Runs a probe or pilot. Its estimates are in p->looks, its times in r; the image is dropped. */
static int run_pilot(struct local_pilot *p, const struct plan_request *request, struct local_run *r, struct error *e)
{
	int rc = plan_make(request, &p->plan, e);
	if (rc)
		return rc;
	p->looks.count = 0;
	*r = (struct local_run){.world = p->world,
				.plan = &p->plan,
				.threads = p->threads,
				.stop = p->stop,
				.on_progress = forward_progress,
				.on_round = on_round,
				.user = p};
	rc = local_run(r, e);
	bool has_no_canvas = !r->canvas, black = r->bootstrap_result.is_black;
	canvas_free(r->canvas);
	if (!rc && has_no_canvas)
		rc = error_set(e, EINTR, "interrupted before the first round of the pilot was complete");
	if (!rc && black)
		rc = error_set(e, ENODATA, "no bootstrap sample carried light: the image would be black");
	return rc;
}

int local_pilot(struct local_pilot *p, struct error *e)
{
	struct plan_request probe, pilot;
	struct local_run r;
	struct pilot_cost cost = {0};
	bool has_probe = false;
	int rc = pilot_render_plan(p->request, &p->render, e);
	if (!rc && pilot_probe_request(p->request, &p->render, &probe)) {
		has_probe = true;
		rc = run_pilot(p, &probe, &r, e);
		cost = (struct pilot_cost){r.bootstrap_seconds, r.seconds - r.bootstrap_seconds};
	}
	if (rc)
		return rc;
	pilot_request(p->request, &p->render, &probe, has_probe ? &cost : NULL, p->seconds, &pilot);
	pilot.seconds = 0;
	p->is_timed = true;
	rc = run_pilot(p, &pilot, &r, e);
	p->cpu_seconds = r.cpu_seconds;
	p->wall_seconds = r.seconds;
	p->bootstrap_cpu_seconds = r.bootstrap_cpu_seconds;
	p->bootstrap_seconds = r.bootstrap_seconds;
	return rc;
}
