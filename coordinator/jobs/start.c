/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Opens and closes the jobs, and runs their periodic work.
 *
 * jobs_open opens the spool and the ledger, lists the jobs that have ended, makes the core and starts to read the
 * jobs that have not (recovery.c). After each step of the core: finishes jobs that have ended, merges results that
 * waited for others, and starts a checkpoint if one is due. When films are free again: the same without checkpoints;
 * then results that arrived while the films were read follow, one in each turn of the loop, by `drain`. An error of
 * the spool ends the start with a sentence; jobs_close then closes what was opened.
 */
#include "coordinator/jobs/start.h"

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
#include "coordinator/retention/ages.h"
#include "coordinator/retention/clear.h"
#include "coordinator/retention/keep.h"

/* Handles one waiting result per turn of the loop, so that nothing else has to wait for all of them. */
static void on_drain(uv_idle_t *h)
{
	struct jobs *jobs = h->data;
	struct live_job *job = jobs->live;
	while (job && (job->busy || STAILQ_EMPTY(&job->waiting) || files_are_read(jobs, job)))
		job = job->next;
	if (!job) {
		uv_idle_stop(h);
		return;
	}
	struct waiting_batch *w = live_job_take_waiting(job);
	results_take_waiting(jobs, w);
	waiting_batch_free(w);
}

static void on_step(struct jobs *jobs)
{
	finish_ended(jobs);
	late_feed(jobs);
	checkpoint_where_due(jobs);
}

static void films_free(struct jobs *jobs)
{
	if (!jobs->stopping)
		uv_idle_start(&jobs->drain, on_drain);
	finish_ended(jobs);
	late_feed(jobs);
}

static const struct follow_up follow_up = {.carry_out = dispatch_update, .stepped = on_step, .films_free = films_free};

static bool drop_films(void *jobs)
{
	return keep_drop_all(jobs);
}

int jobs_open(struct jobs *jobs, struct error *e)
{
	struct farm_config config;
	int rc = spool_open(&jobs->spool, jobs->config.spool, e);
	if (!rc)
		rc = blob_store_open(&jobs->blobs, spool_blobs(jobs->spool), jobs->config.blob_bytes, e);
	if (!rc) {
		blob_store_ask(jobs->blobs, drop_films, jobs);
		rc = reconcile(jobs, e);
	}
	if (!rc)
		ages_open(jobs);
	if (!rc)
		rc = ledger_ids(jobs->ledger, LEDGER_LIVE, &jobs->restored, &jobs->restored_count, e);
	if (!rc)
		rc = ended_jobs_open(jobs, e);
	if (rc)
		return rc;
	if (jobs->config.keep_partials && disk_mkdir(jobs->config.keep_partials, 0777) && errno != EEXIST)
		return error_file(e, errno, jobs->config.keep_partials);
	farm_config_init(&config);
	config.max_peers = jobs->config.max_connections;
	config.first_job = ledger_next_id(jobs->ledger);
	config.silent_after = 3 * jobs->config.heartbeat_seconds;
	config.max_faults = jobs->config.max_faults;
	config.first_pause = 2 * jobs->config.heartbeat_seconds;
	uv_random(NULL, NULL, &config.verify_seed, sizeof config.verify_seed, 0, NULL);
	config.forget_after = 6 * jobs->config.heartbeat_seconds;
	rc = farm_new(&jobs->farm, &config, e);
	if (!rc)
		rc = trust_open(jobs, e);
	if (!rc)
		rc = recovery_begin(jobs, e);
	return rc;
}

void jobs_init(struct jobs *jobs)
{
	jobs->follow_up = &follow_up;
	STAILQ_INIT(&jobs->deferred);
	STAILQ_INIT(&jobs->acks);
	STAILQ_INIT(&jobs->parked);
	STAILQ_INIT(&jobs->checks);
	uv_timer_init(jobs->loop, &jobs->wake);
	uv_idle_init(jobs->loop, &jobs->drain);
	uv_idle_init(jobs->loop, &jobs->trim);
	jobs->wake.data = jobs->drain.data = jobs->trim.data = jobs;
	jobs->read = jobs_now(jobs);
}

/* Retries, for each live job whose time has come, what the disk refused: image, record, films, or results. */
static void retry(struct jobs *jobs)
{
	for (struct live_job *job = jobs->live; job; job = job->next) {
		if (jobs_now(jobs) < job->try_again || job->busy)
			continue;
		if (job->unpublished) {
			job->unpublished = false;
			publish_start(jobs, job, PUBLISH_RESULT, job->unpublished_rounds);
		}
		if (job->unrecorded) {
			job->unrecorded = false;
			finish_ended(jobs);
			return; /* the list may have changed; continue next time */
		}
		if (job->unprepared && !job->ended) {
			struct event ev = {.kind = EVENT_TICK};
			dispatch_prepare(jobs, job);
			jobs_step(jobs, &ev);
			return;
		}
		if (job->held && !job->ended && durable_mend(jobs, job) == 0)
			return;
	}
}

void jobs_tick(struct jobs *jobs)
{
	if (recovery_is_on(jobs))
		jobs->changes++;
	durable_tick(jobs);
	retry(jobs);
	files_tick(jobs);
	folder_tick(jobs);
	clear_tick(jobs);
	checkpoint_where_due(jobs);
}

void jobs_stop(struct jobs *jobs)
{
	jobs->stopping = true;
	uv_close((uv_handle_t *)&jobs->wake, NULL);
	uv_close((uv_handle_t *)&jobs->drain, NULL);
	uv_close((uv_handle_t *)&jobs->trim, NULL);
	recovery_stop(jobs);
}

void jobs_close(struct jobs *jobs)
{
	recovery_close(jobs);
	while (jobs->live) {
		struct live_job *next = jobs->live->next;
		live_job_free(jobs->live);
		jobs->live = next;
	}
	for (struct deferred *d; (d = STAILQ_FIRST(&jobs->deferred));) {
		STAILQ_REMOVE_HEAD(&jobs->deferred, next);
		mem_free(d);
	}
	if (jobs->seen.up > 0)
		ages_keep(jobs);
	durable_close(jobs);
	clear_close(jobs);
	if (jobs->farm)
		farm_free(jobs->farm);
	blob_store_close(jobs->blobs);
	spool_close(jobs->spool);
	mem_free(jobs->ended);
	mem_free(jobs->restored);
}
