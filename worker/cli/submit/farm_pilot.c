/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/submit/farm_pilot.h"

#include "common/base/mem.h"
#include "worker/cli/render/pilot.h"

#include <stdio.h>

static int run_pilot(struct farm_pilot *p, const char *what, const struct plan_request *plan, struct error *e)
{
	char name[160], text[PLAN_TEXT];
	struct submitted job;
	int rc = plan_make(plan, &p->plan, e);
	struct render_arguments *args = rc ? NULL : mem_alloc(1, sizeof *args);
	if (!rc && !args)
		rc = error_set(e, ENOMEM, "no memory for a pilot");
	if (rc)
		return rc;
	*args = *p->request->args;
	args->plan = *plan;
	snprintf(name, sizeof name, "%s of %.120s", what, p->request->name);
	struct submit_request request = *p->request;
	request.name = name;
	request.args = args;
	p->end = (struct submit_end){0};
	rc = submit_send(p->client, &request, p->files, &job, text, sizeof text, e);
	mem_free(args);
	if (!rc)
		rc = submit_wait(p->client, &job, &p->end, e);
	if (!rc && p->end.exit_code == 3)
		rc = error_set(e, ECANCELED, "the %s, job j%llu, ended without an image: %s", what,
			       (unsigned long long)job.job, p->end.why);
	return rc;
}

int farm_pilot(struct farm_pilot *p, struct error *e)
{
	const struct plan_request *request = &p->request->args->plan;
	struct plan_request probe, pilot;
	struct pilot_cost cost;
	bool probed = false;
	int rc = pilot_render_plan(request, &p->render, e);
	if (!rc && pilot_probe(request, &p->render, &probe)) {
		rc = run_pilot(p, "probe", &probe, e);
		const struct forecast_history *looks = &p->end.looks;
		if (!rc && looks->count) {
			probed = true;
			cost = (struct pilot_cost){p->end.bootstrap_seconds, looks->looks[looks->count - 1].seconds};
		}
	}
	if (rc)
		return rc;
	pilot_request(request, &p->render, &probe, probed ? &cost : NULL, p->seconds, &pilot);
	return run_pilot(p, "pilot", &pilot, e);
}
