/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Opens and closes the jobs, and runs their periodic work.
 *
 * jobs_open opens the spool and the ledger, lists the jobs that have ended, makes the core and starts to read the
 * jobs that have not (recovery.c). After each step of the core: finishes jobs that have ended, merges results that
 * waited for others, and starts a checkpoint if one is due. When films are free again: the same without checkpoints;
 * then results that arrived while the films were read follow, one in each turn of the loop, by `drain_idle`. An error
 * of the spool ends the start with a sentence; jobs_close then closes what was opened.
 */
#include "coordinator/jobs/lifecycle.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/jobs/checkpoint.h"
#include "coordinator/jobs/dispatch.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/files.h"
#include "coordinator/jobs/finish.h"
#include "coordinator/jobs/folder.h"
#include "coordinator/jobs/late_feed.h"
#include "coordinator/jobs/publish.h"
#include "coordinator/jobs/reconcile.h"
#include "coordinator/jobs/recovery.h"
#include "coordinator/jobs/results.h"
#include "coordinator/jobs/step.h"
#include "coordinator/jobs/trust.h"
#include "coordinator/retention/observed_time.h"
#include "coordinator/retention/clearing.h"
#include "coordinator/retention/kept_films.h"

/* Handles one waiting result per turn of the loop, so that nothing else has to wait for all of them. */
static void on_drain(uv_idle_t *h)
{
	struct jobs *jobs = h->data;
	struct live_job *job = jobs->live_jobs;
	while (job && (job->is_busy || STAILQ_EMPTY(&job->waiting_messages) || files_are_being_read(jobs, job)))
		job = job->next;
	if (!job) {
		uv_idle_stop(h);
		return;
	}
	struct waiting_message *w = live_job_pop_waiting(job);
	results_handle_waiting(jobs, w);
	waiting_message_free(w);
}

static void on_step(struct jobs *jobs)
{
	finish_ended(jobs);
	late_results_feed(jobs);
	checkpoint_start_due(jobs);
}

static void on_films_free(struct jobs *jobs)
{
	if (!jobs->is_stopping)
		uv_idle_start(&jobs->drain_idle, on_drain);
	finish_ended(jobs);
	late_results_feed(jobs);
}

static const struct step_handlers step_handlers = {
	.on_update = dispatch_update, .on_step_done = on_step, .on_films_free = on_films_free};

static bool drop_films(void *jobs)
{
	return kept_films_drop_all(jobs);
}

int jobs_open(struct jobs *jobs, struct error *e)
{
	struct farm_config config;
	int rc = spool_open(&jobs->spool, jobs->config.spool_folder, e);
	if (!rc)
		rc = blob_store_open(&jobs->blobs, spool_blob_folder(jobs->spool), jobs->config.max_blob_bytes, e);
	if (!rc) {
		blob_store_set_full_handler(jobs->blobs, drop_films, jobs);
		rc = reconcile_spool(jobs, e);
	}
	if (!rc)
		observed_time_open(jobs);
	if (!rc)
		rc = ledger_list_ids(jobs->ledger, LEDGER_LIVE, &jobs->restored_ids, &jobs->restored_count, e);
	if (!rc)
		rc = ended_jobs_open(jobs, e);
	if (rc)
		return rc;
	if (jobs->config.partials_folder && disk_mkdir(jobs->config.partials_folder, 0777) && errno != EEXIST)
		return error_file(e, errno, jobs->config.partials_folder);
	farm_config_init(&config);
	config.max_peers = jobs->config.max_connections;
	config.first_job_id = ledger_next_id(jobs->ledger);
	config.silence_timeout = 3 * jobs->config.heartbeat_seconds;
	config.max_faults = jobs->config.max_faults;
	config.initial_backoff = 2 * jobs->config.heartbeat_seconds;
	uv_random(NULL, NULL, &config.verify_seed, sizeof config.verify_seed, 0, NULL);
	config.disconnect_timeout = 6 * jobs->config.heartbeat_seconds;
	rc = farm_new(&jobs->farm, &config, e);
	if (!rc)
		rc = trust_open(jobs, e);
	if (!rc)
		rc = recovery_begin(jobs, e);
	return rc;
}

void jobs_init(struct jobs *jobs)
{
	jobs->step_handlers = &step_handlers;
	STAILQ_INIT(&jobs->deferred_events);
	STAILQ_INIT(&jobs->acks);
	STAILQ_INIT(&jobs->parked_acks);
	STAILQ_INIT(&jobs->file_checks);
	uv_timer_init(jobs->loop, &jobs->wake_timer);
	uv_idle_init(jobs->loop, &jobs->drain_idle);
	uv_idle_init(jobs->loop, &jobs->trim_idle);
	jobs->wake_timer.data = jobs->drain_idle.data = jobs->trim_idle.data = jobs;
	jobs->messages_read_until = jobs_now(jobs);
}

/* Retries, for each live job whose time has come, what the disk refused: image, record, films, or results. */
static void retry_writes(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live_jobs; job; job = job->next) {
		if (jobs_now(jobs) < job->retry_at || job->is_busy)
			continue;
		if (job->is_publish_pending) {
			job->is_publish_pending = false;
			publish_start(jobs, job, PUBLISH_RESULT, job->pending_publish_rounds);
		}
		if (job->is_record_pending) {
			job->is_record_pending = false;
			finish_ended(jobs);
			return; /* the list may have changed; continue next time */
		}
		if (job->is_prepare_pending && !job->has_ended) {
			struct event ev = {.kind = EVENT_TICK};
			dispatch_prepare(jobs, job);
			jobs_step(jobs, &ev);
			return;
		}
		if (job->is_held_for_storage && !job->has_ended && durable_retry_job(jobs, job) == 0)
			return;
	}
}

void jobs_tick(struct jobs *jobs)
{
	if (recovery_is_running(jobs))
		jobs->change_count++;
	durable_tick(jobs);
	retry_writes(jobs);
	files_tick(jobs);
	folder_tick(jobs);
	clearing_tick(jobs);
	checkpoint_start_due(jobs);
}

void jobs_stop(struct jobs *jobs)
{
	jobs->is_stopping = true;
	uv_close((uv_handle_t *)&jobs->wake_timer, NULL);
	uv_close((uv_handle_t *)&jobs->drain_idle, NULL);
	uv_close((uv_handle_t *)&jobs->trim_idle, NULL);
	recovery_stop(jobs);
}

void jobs_close(struct jobs *jobs)
{
	recovery_close(jobs);
	while (jobs->live_jobs) {
		struct live_job *next = jobs->live_jobs->next;
		live_job_free(jobs->live_jobs);
		jobs->live_jobs = next;
	}
	for (struct deferred_event *d; (d = STAILQ_FIRST(&jobs->deferred_events));) {
		STAILQ_REMOVE_HEAD(&jobs->deferred_events, next);
		mem_free(d);
	}
	if (jobs->observed_clock.uptime > 0)
		observed_time_store(jobs);
	durable_close(jobs);
	clearing_close(jobs);
	if (jobs->farm)
		farm_free(jobs->farm);
	blob_store_close(jobs->blobs);
	spool_close(jobs->spool);
	mem_free(jobs->ended_jobs);
	mem_free(jobs->restored_ids);
}
