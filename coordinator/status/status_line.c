/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Lines of the status socket about jobs.
 *
 * Every reader gets a snapshot at every change, so snapshots contain ended jobs without their details, and only those
 * that ended last. Details are sent for the one job that a reader asks for; jobs that ended earlier are sent in
 * pages.
 */
#include "coordinator/status/status_line.h"

#include "common/base/clock.h"
#include "coordinator/jobs/listing.h"

#include <stdio.h>
#include <stdlib.h>

json_t *line_new(const char *type)
{
	return json_pack("{s:i s:s s:f}", "schema", 1, "type", type, "time", clock_wall_seconds());
}

json_t *line_error(const char *text)
{
	json_t *o = line_new("error");
	json_object_set_new(o, "text", json_string(text));
	return o;
}

/* Returns the id in a name such as "j12"; 0: not the name of a job. */
static uint64_t parse_job_name(const char *name)
{
	char *end;
	if (!name || *name != 'j' || name[1] < '0' || name[1] > '9')
		return 0;
	errno = 0;
	unsigned long long id = strtoull(name + 1, &end, 10);
	return *end || errno ? 0 : id;
}

json_t *line_job(struct jobs *jobs, const char *name)
{
	char text[64];
	struct job_view v;
	uint64_t id = parse_job_name(name);
	if (!id || !jobs_get_view(jobs, id, &v)) {
		snprintf(text, sizeof text, "%.32s: no such job", name);
		return line_error(text);
	}
	json_t *o = line_new("job");
	json_object_set_new(o, "job", view_to_json(&v, true));
	return o;
}

json_t *line_ended_jobs(struct jobs *jobs, const char *before)
{
	enum { ONE_MORE = LINES_ENDED_MAX + 1 }; /* one more than a page, to know whether there is another page */
	struct error e;
	struct job_view v;
	uint64_t ids[ONE_MORE]; /* in descending order */
	size_t count;
	if (ledger_list_ended(jobs->ledger, LEDGER_BELOW, before ? parse_job_name(before) : UINT64_MAX, ids, ONE_MORE,
			      &count, &e))
		return line_error(e.text);
	bool has_more = count == ONE_MORE;
	count -= has_more;
	json_t *o = line_new("ended"), *list = json_array();
	for (size_t i = count; i-- > 0;)
		if (jobs_get_view(jobs, ids[i], &v))
			json_array_append_new(list, view_to_json(&v, false));
	json_object_set_new(o, "jobs", list);
	json_object_set_new(o, "before",
			    has_more ? json_sprintf("j%llu", (unsigned long long)ids[count - 1]) : json_null());
	return o;
}
