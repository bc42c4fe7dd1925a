/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Quarantined workers and wrong results. The list of quarantined workers is a note in the ledger; the core is told of
 * them at the start, and the note is written again whenever the core quarantines another. Wrong results are logged,
 * and how many unverified results a quarantined worker has contributed is noted in the job.
 *
 * A note that cannot be read is kept under another name, and a list that cannot be written is logged; neither stops
 * the farm.
 */
#include "coordinator/jobs/trust.h"

#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/base/spelling.h"
#include "common/base/text.h"
#include "coordinator/jobs/step.h"

#include <stdlib.h>
#include <string.h>

static const char note[] = "quarantined"; /* name of the note in the ledger */

static int add_worker(json_t *list, const struct worker_status *w, struct error *e)
{
	json_error_t fault;
	json_t *o = json_pack_ex(&fault, 0, "{s:s s:s s:s s:I s:s}", "certificate", w->certificate, "name", w->name,
				 "home", w->home, "restarts", (json_int_t)w->restarts, "why", w->text);
	if (!o)
		return error_set(e, EINVAL, "the quarantined worker %s cannot be recorded: %s", w->name, fault.text);
	return json_array_append_new(list, o) ? error_set(e, ENOMEM, "no memory for the list of quarantined workers")
					      : 0;
}

static void write_quarantined(struct jobs *jobs)
{
	struct worker_status w;
	struct error e;
	int rc = 0;
	json_t *list = json_array(), *o = json_pack("{s:i s:o}", "schema", 1, "workers", list);
	for (uint64_t who = 0;
	     !rc && (who = farm_next_quarantined(jobs->farm, who)) && farm_worker(jobs->farm, who, &w);)
		rc = add_worker(list, &w, &e);
	char *text = json_dumps(o, JSON_INDENT(1));
	json_decref(o);
	if (!rc && !text)
		rc = error_set(&e, ENOMEM, "no memory for the list of quarantined workers");
	if (!rc)
		rc = ledger_set(jobs->ledger, note, text, &e);
	if (rc)
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	free(text);
}

static const char *text_of(const json_t *o, const char *key)
{
	const char *text = json_string_value(json_object_get(o, key));
	return text ? text : "";
}

static void tell_core(struct jobs *jobs, const json_t *w)
{
	struct event ev = {.kind = EVENT_QUARANTINED,
			   .text = text_of(w, "why"),
			   .join = {.certificate = text_of(w, "certificate"),
				    .name = text_of(w, "name"),
				    .home = text_of(w, "home"),
				    .restarts = (uint64_t)json_integer_value(json_object_get(w, "restarts"))}};
	const char *forgiven = jobs->config.forgive;
	if (forgiven && strcmp(forgiven, ev.join.name) == 0) {
		log_event(LOG_WORKER_FORGIVEN, "name=%s why=%s", log_quote(ev.join.name).text, log_quote(ev.text).text);
		return;
	}
	log_event(LOG_WORKER_QUARANTINED, "name=%s why=%s", log_quote(ev.join.name).text, log_quote(ev.text).text);
	jobs_step(jobs, &ev);
}

/* Logs that --forgive names nobody in the list. This may be a start with the same option as before, which is no
 * mistake; but a typing error would leave the worker quarantined. */
static void tell_unforgiven(const struct jobs *jobs, const json_t *list)
{
	const char *name = jobs->config.forgive;
	struct spelling near = {.wanted = name ? name : ""};
	char hint[96], text[160];
	for (size_t i = 0; name && i < json_array_size(list); i++) {
		const char *other = text_of(json_array_get(list, i), "name");
		if (strcmp(other, name) == 0)
			return;
		spelling_offer(&near, other);
	}
	if (!name)
		return;
	text_print(text, sizeof text, "nobody of that name is quarantined%s", spelling_hint(&near, hint, sizeof hint));
	log_event(LOG_NOT_FORGIVEN, "name=%s text=%s", log_quote(name).text, log_quote(text).text);
}

static const char empty[] = "{\"schema\": 1, \"workers\": []}";

/* Keeps a damaged note under another name. The farm need not stop for it: a worker that gives wrong results will do
 * so again, and be found again. */
static int keep_damaged_note(struct jobs *jobs, const char *text, struct error *e)
{
	log_event(LOG_SPOOL_FAULT,
		  "text=\"the note %s in jobs.db is no list of workers: it is kept as %s-damaged, and its workers "
		  "are no longer quarantined\"",
		  note, note);
	int rc = ledger_set(jobs->ledger, "quarantined-damaged", text, e);
	return rc ? rc : ledger_set(jobs->ledger, note, empty, e);
}

int trust_open(struct jobs *jobs, struct error *e)
{
	char *text;
	int rc = ledger_note(jobs->ledger, note, &text, e);
	if (rc == -EBADMSG) {
		log_event(LOG_SPOOL_FAULT, "text=%s action=\"its workers are no longer quarantined\"",
			  log_quote(e->text).text);
		return ledger_set(jobs->ledger, note, empty, e);
	}
	if (rc == -ENOENT)
		tell_unforgiven(jobs, NULL);
	if (rc)
		return rc == -ENOENT ? 0 : rc;
	json_t *o = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
	const json_t *list = json_object_get(o, "workers");
	if (!json_is_array(list))
		rc = keep_damaged_note(jobs, text, e);
	for (size_t i = 0; i < json_array_size(list); i++)
		tell_core(jobs, json_array_get(list, i));
	if (!rc)
		tell_unforgiven(jobs, list);
	json_decref(o);
	mem_free(text);
	if (!rc && jobs->config.forgive)
		write_quarantined(jobs);
	return rc;
}

double trust_share(const struct jobs *jobs, const Farm__Submit *m)
{
	return m->mixed ? 0 : m->verify > jobs->config.verify ? m->verify : jobs->config.verify;
}

void trust_merged(struct live_job *job, const struct action *a)
{
	if (a->verified)
		return;
	for (size_t i = 0; i < job->credit_count; i++)
		if (job->credits[i].who == a->who) {
			job->credits[i].leases++;
			return;
		}
	struct live_job_credit *more = list_room(job->credits, job->credit_count, sizeof *more);
	if (!more) {
		live_job_log(job, LOG_SPOOL_FAULT, "text=\"no memory to count the unverified results of a worker\"");
		return;
	}
	job->credits = more;
	job->credits[job->credit_count++] = (struct live_job_credit){a->who, 1};
}

void trust_taken_back(struct live_job *job, uint64_t who)
{
	for (size_t i = 0; i < job->credit_count; i++)
		if (job->credits[i].who == who && job->credits[i].leases > 0)
			job->credits[i].leases--;
}

static const char *name_of(const struct jobs *jobs, uint64_t who, char name[JOIN_NAME])
{
	struct worker_status w;
	text_copy(name, JOIN_NAME, farm_worker(jobs->farm, who, &w) ? w.name : "?");
	return name;
}

void trust_wrong(struct jobs *jobs, const struct action *a)
{
	char name[JOIN_NAME];
	struct live_job *job = jobs_find(jobs, a->job);
	if (job)
		live_job_log(job, LOG_WORKER_WRONG, "worker=%s text=%s", log_quote(name_of(jobs, a->who, name)).text,
			     log_quote(a->text).text);
}

static void append_note(struct live_job *job, const char *text)
{
	live_job_log(job, LOG_JOB_NOTE, "text=%s", log_quote(text).text);
	size_t used = strlen(job->doubts);
	text_print(job->doubts + used, sizeof job->doubts - used, "%s%s", used ? "; " : "", text);
}

static void note_credit(struct live_job *job, const char *name, const char *why, uint64_t leases)
{
	char text[256];
	text_print(text, sizeof text, "worker %s is quarantined (%s); %llu of its leases were merged unverified", name,
		   why, (unsigned long long)leases);
	append_note(job, text);
}

void trust_anew(struct jobs *jobs, const struct action *a)
{
	struct live_job *job = jobs_find(jobs, a->job);
	if (job)
		append_note(job, a->text);
}

void trust_quarantined(struct jobs *jobs, const struct action *a)
{
	char name[JOIN_NAME];
	name_of(jobs, a->who, name);
	log_event(LOG_WORKER_QUARANTINED, "name=%s why=%s", log_quote(name).text, log_quote(a->text).text);
	write_quarantined(jobs);
	for (struct live_job *job = jobs->live; job; job = job->next)
		for (size_t i = 0; i < job->credit_count; i++)
			if (job->credits[i].who == a->who && job->credits[i].leases > 0)
				note_credit(job, name, a->text, job->credits[i].leases);
}
