/* SPDX-License-Identifier: Apache-2.0 */
/* Submits jobs as a client does, and reads what the status socket says about them. */
#include "tests/load/load.h"

#include "common/base/mem.h"
#include "worker/cli/submit/submit.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { EPOCH = 1 << 20 };

/* A job that does not end and whose error is never estimated: rounds of long epochs. */
static struct plan_request make_plan_request(const struct load_settings *s, unsigned index)
{
	return (struct plan_request){.integrator = "hslt",
				     .kind = PLAN_CHAINS,
				     .width = s->width,
				     .height = s->height,
				     .border = 1,
				     .seed = index,
				     .mutations = UINT64_C(1) << 50,
				     .min_depth = 1,
				     .max_depth = 16,
				     .groups = s->groups,
				     .parts = s->parts,
				     .chains = s->groups * s->parts,
				     .bootstrap = UINT64_C(16) * s->groups * s->parts,
				     .epoch = EPOCH,
				     .mixture = "bidirectional=0.1,hslt=0.9"};
}

void load_submit(struct load *l, const char *host_port, const char *tls, unsigned index)
{
	static struct render_arguments args;
	char folder[] = "tests/load", scene[] = "load.xml", text[PLAN_TEXT_MAX], name[32];
	struct scene_file file = {.name = scene};
	struct scene_files files = {.folder = folder,
				    .folders = asset_folders_make(folder, NULL, 0),
				    .scene = scene,
				    .file_count = 1,
				    .files = &file};
	struct submit_request request = {.name = name, .output = "", .args = &args};
	struct load_job *j = &l->jobs[index];
	struct asset_source assets = asset_source_for_folder(folder);
	struct asset a;
	struct client *cl;
	struct submitted_job job;
	struct error e;
	snprintf(name, sizeof name, "load %u", index);
	args.plan = make_plan_request(&l->settings, index);
	files.summary.brightness_bound = 1;
	int rc = plan_make(&args.plan, &j->plan, &e);
	if (!rc)
		rc = assets.open(assets.user, scene, &a, &e);
	if (!rc) {
		file.size = a.size;
		rc = blob_hash_bytes(a.bytes, a.size, &file.hash, &e);
		assets.close(assets.user, &a);
	}
	if (!rc)
		rc = client_open(&cl, host_port, tls, l->settings.insecure, "load", &e);
	if (rc)
		load_die("%s", e.text);
	rc = submit_send(cl, &request, &files, &job, text, sizeof text, &e);
	client_close(cl);
	j->id = job.job;
	j->acknowledged_epochs = mem_alloc((size_t)j->plan.groups * j->plan.parts, sizeof *j->acknowledged_epochs);
	if (rc || !j->acknowledged_epochs)
		load_die("%s", rc ? e.text : "no memory for a job");
}

double load_counted_mutations(const struct load *l, const char *socket, uint64_t job)
{
	char command[4096];
	snprintf(command, sizeof command, "%s/hslt-status --socket %s --json j%llu", l->settings.bin, socket,
		 (unsigned long long)job);
	FILE *f = popen(command, "r");
	json_error_t fault;
	json_t *o = f ? json_loadf(f, JSON_DISABLE_EOF_CHECK, &fault) : NULL;
	json_t *view = json_object_get(o, "job") ? json_object_get(o, "job") : o;
	json_t *list = json_object_get(o, "jobs");
	if (json_array_size(list))
		view = json_array_get(list, 0);
	json_t *n = json_object_get(view, "mutations");
	double mutations = n ? (double)json_integer_value(n) : NAN;
	json_decref(o);
	if (f)
		pclose(f);
	return mutations;
}
