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

static const char note_name[] = "quarantined"; /* name of the note in the ledger */

static int add_worker(json_t *list, const struct worker_status *w, struct error *e)
{
	json_error_t fault;
	json_t *o = json_pack_ex(&fault, 0, "{s:s s:s s:s s:I s:s}", "certificate", w->certificate, "name", w->name,
				 "home", w->home, "restarts", (json_int_t)w->restarts, "why", w->last_fault);
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
	for (uint64_t worker_id = 0; !rc && (worker_id = farm_next_quarantined(jobs->farm, worker_id)) &&
				     farm_worker_status(jobs->farm, worker_id, &w);)
		rc = add_worker(list, &w, &e);
	char *text = json_dumps(o, JSON_INDENT(1));
	json_decref(o);
	if (!rc && !text)
		rc = error_set(&e, ENOMEM, "no memory for the list of quarantined workers");
	if (!rc)
		rc = ledger_set_note(jobs->ledger, note_name, text, &e);
	if (rc)
		log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(e.text).text);
	free(text);
}

static const char *string_member(const json_t *o, const char *key)
{
	const char *text = json_string_value(json_object_get(o, key));
	return text ? text : "";
}

static void tell_core(struct jobs *jobs, const json_t *w)
{
	struct event ev = {.kind = EVENT_QUARANTINED,
			   .text = string_member(w, "why"),
			   .join = {.certificate = string_member(w, "certificate"),
				    .name = string_member(w, "name"),
				    .home = string_member(w, "home"),
				    .restarts = (uint64_t)json_integer_value(json_object_get(w, "restarts"))}};
	const char *forgiven = jobs->config.forgiven_worker;
	if (forgiven && strcmp(forgiven, ev.join.name) == 0) {
		log_event(LOG_WORKER_FORGIVEN, "name=%s why=%s", log_quote(ev.join.name).text, log_quote(ev.text).text);
		return;
	}
	log_event(LOG_WORKER_QUARANTINED, "name=%s why=%s", log_quote(ev.join.name).text, log_quote(ev.text).text);
	jobs_step(jobs, &ev);
}

/* Logs that --forgive names nobody in the list. This may be a start with the same option as before, which is no
 * mistake; but a typing error would leave the worker quarantined. */
static void log_unforgiven(const struct jobs *jobs, const json_t *list)
{
	const char *name = jobs->config.forgiven_worker;
	struct spelling suggestion = {.wanted_name = name ? name : ""};
	char hint[96], text[160];
	for (size_t i = 0; name && i < json_array_size(list); i++) {
		const char *other = string_member(json_array_get(list, i), "name");
		if (strcmp(other, name) == 0)
			return;
		spelling_offer(&suggestion, other);
	}
	if (!name)
		return;
	text_print(text, sizeof text, "nobody of that name is quarantined%s",
		   spelling_hint(&suggestion, hint, sizeof hint));
	log_event(LOG_NOT_FORGIVEN, "name=%s text=%s", log_quote(name).text, log_quote(text).text);
}

static const char empty_list[] = "{\"schema\": 1, \"workers\": []}";

/* Keeps a damaged note under another name. The farm need not stop for it: a worker that gives wrong results will do
 * so again, and be found again. */
static int keep_damaged_note(struct jobs *jobs, const char *text, struct error *e)
{
	log_event(LOG_SPOOL_FAULT,
		  "text=\"the note %s in jobs.db is no list of workers: it is kept as %s-damaged, and its workers "
		  "are no longer quarantined\"",
		  note_name, note_name);
	int rc = ledger_set_note(jobs->ledger, "quarantined-damaged", text, e);
	return rc ? rc : ledger_set_note(jobs->ledger, note_name, empty_list, e);
}

int trust_open(struct jobs *jobs, struct error *e)
{
	char *text;
	int rc = ledger_get_note(jobs->ledger, note_name, &text, e);
	if (rc == -EBADMSG) {
		log_event(LOG_SPOOL_FAULT, "text=%s action=\"its workers are no longer quarantined\"",
			  log_quote(e->text).text);
		return ledger_set_note(jobs->ledger, note_name, empty_list, e);
	}
	if (rc == -ENOENT)
		log_unforgiven(jobs, NULL);
	if (rc)
		return rc == -ENOENT ? 0 : rc;
	json_t *o = json_loads(text, JSON_REJECT_DUPLICATES, NULL);
	const json_t *list = json_object_get(o, "workers");
	if (!json_is_array(list))
		rc = keep_damaged_note(jobs, text, e);
	for (size_t i = 0; i < json_array_size(list); i++)
		tell_core(jobs, json_array_get(list, i));
	if (!rc)
		log_unforgiven(jobs, list);
	json_decref(o);
	mem_free(text);
	if (!rc && jobs->config.forgiven_worker)
		write_quarantined(jobs);
	return rc;
}

double trust_verify_fraction(const struct jobs *jobs, const Farm__Submit *m)
{
	return m->mixed					      ? 0
	       : m->verify > jobs->config.min_verify_fraction ? m->verify
							      : jobs->config.min_verify_fraction;
}

void trust_count_unverified(struct live_job *job, const struct action *a)
{
	if (a->is_verified)
		return;
	for (size_t i = 0; i < job->unverified_worker_count; i++)
		if (job->unverified_counts[i].worker_id == a->worker_id) {
			job->unverified_counts[i].lease_count++;
			return;
		}
	struct live_job_unverified_count *more =
		list_grow_array(job->unverified_counts, job->unverified_worker_count, sizeof *more);
	if (!more) {
		live_job_log(job, LOG_SPOOL_FAULT, "text=\"no memory to count the unverified results of a worker\"");
		return;
	}
	job->unverified_counts = more;
	job->unverified_counts[job->unverified_worker_count++] = (struct live_job_unverified_count){a->worker_id, 1};
}

void trust_discount_unverified(struct live_job *job, uint64_t worker_id)
{
	for (size_t i = 0; i < job->unverified_worker_count; i++)
		if (job->unverified_counts[i].worker_id == worker_id && job->unverified_counts[i].lease_count > 0)
			job->unverified_counts[i].lease_count--;
}

static const char *worker_name(const struct jobs *jobs, uint64_t worker_id, char name[JOIN_NAME_SIZE])
{
	struct worker_status w;
	text_copy(name, JOIN_NAME_SIZE, farm_worker_status(jobs->farm, worker_id, &w) ? w.name : "?");
	return name;
}

void trust_log_wrong_result(struct jobs *jobs, const struct action *a)
{
	char name[JOIN_NAME_SIZE];
	struct live_job *job = jobs_find_live(jobs, a->job);
	if (job)
		live_job_log(job, LOG_WORKER_WRONG, "worker=%s text=%s",
			     log_quote(worker_name(jobs, a->worker_id, name)).text, log_quote(a->text).text);
}

static void append_note(struct live_job *job, const char *text)
{
	live_job_log(job, LOG_JOB_NOTE, "text=%s", log_quote(text).text);
	size_t used = strlen(job->quarantine_notes);
	text_print(job->quarantine_notes + used, sizeof job->quarantine_notes - used, "%s%s", used ? "; " : "", text);
}

static void note_unverified_leases(struct live_job *job, const char *name, const char *reason, uint64_t leases)
{
	char text[256];
	text_print(text, sizeof text, "worker %s is quarantined (%s); %llu of its leases were merged unverified", name,
		   reason, (unsigned long long)leases);
	append_note(job, text);
}

void trust_note_chain_restart(struct jobs *jobs, const struct action *a)
{
	struct live_job *job = jobs_find_live(jobs, a->job);
	if (job)
		append_note(job, a->text);
}

void trust_record_quarantine(struct jobs *jobs, const struct action *a)
{
	char name[JOIN_NAME_SIZE];
	worker_name(jobs, a->worker_id, name);
	log_event(LOG_WORKER_QUARANTINED, "name=%s why=%s", log_quote(name).text, log_quote(a->text).text);
	write_quarantined(jobs);
	for (struct live_job *job = jobs->live_jobs; job; job = job->next)
		for (size_t i = 0; i < job->unverified_worker_count; i++)
			if (job->unverified_counts[i].worker_id == a->worker_id &&
			    job->unverified_counts[i].lease_count > 0)
				note_unverified_leases(job, name, a->text, job->unverified_counts[i].lease_count);
}
