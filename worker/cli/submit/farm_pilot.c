/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/submit/farm_pilot.h"

#include "common/base/mem.h"
#include "worker/cli/render/pilot_request.h"

#include <stdio.h>

static int run_pilot(struct farm_pilot *p, const char *kind, const struct plan_request *plan, struct error *e)
{
	char name[160], text[PLAN_TEXT_MAX];
	struct submitted_job job;
	int rc = plan_make(plan, &p->plan, e);
	struct render_arguments *args = rc ? NULL : mem_alloc(1, sizeof *args);
	if (!rc && !args)
		rc = error_set(e, ENOMEM, "no memory for a pilot");
	if (rc)
		return rc;
	*args = *p->request->args;
	args->plan = *plan;
	snprintf(name, sizeof name, "%s of %.120s", kind, p->request->name);
	struct submit_request request = *p->request;
	request.name = name;
	request.args = args;
	p->outcome = (struct submit_outcome){0};
	rc = submit_send(p->client, &request, p->files, &job, text, sizeof text, e);
	mem_free(args);
	if (!rc)
		rc = submit_wait(p->client, &job, &p->outcome, e);
	if (!rc && p->outcome.exit_code == 3)
		rc = error_set(e, ECANCELED, "the %s, job j%llu, ended without an image: %s", kind,
			       (unsigned long long)job.job, p->outcome.reason);
	return rc;
}

int farm_pilot(struct farm_pilot *p, struct error *e)
{
	const struct plan_request *request = &p->request->args->plan;
	struct plan_request probe, pilot;
	struct pilot_cost cost;
	bool has_probe = false;
	int rc = pilot_render_plan(request, &p->render, e);
	if (!rc && pilot_probe_request(request, &p->render, &probe)) {
		rc = run_pilot(p, "probe", &probe, e);
		const struct forecast_history *looks = &p->outcome.looks;
		if (!rc && looks->count) {
			has_probe = true;
			cost = (struct pilot_cost){p->outcome.bootstrap_seconds,
						   looks->looks[looks->count - 1].seconds};
		}
	}
	if (rc)
		return rc;
	pilot_request(request, &p->render, &probe, has_probe ? &cost : NULL, p->seconds, &pilot);
	return run_pilot(p, "pilot", &pilot, e);
}
