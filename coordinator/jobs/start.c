/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How the jobs are opened and closed.
 *
 * jobs_open opens the spool and the ledger, lists the jobs that have ended, makes the core and begins to read those
 * that had not (recovery.c). An error of the spool ends the start with a sentence; jobs_close then gives back what was
 * opened.
 */
#include "coordinator/jobs/start.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/jobs/checkpoint.h"
#include "coordinator/jobs/durable.h"
#include "coordinator/jobs/ended_jobs.h"
#include "coordinator/jobs/files.h"
#include "coordinator/jobs/folder.h"
#include "coordinator/jobs/follow_up.h"
#include "coordinator/jobs/recovery.h"
#include "coordinator/jobs/restore.h"
#include "coordinator/jobs/retry.h"
#include "coordinator/jobs/trust.h"
#include "coordinator/retention/ages.h"
#include "coordinator/retention/clear.h"

#include <string.h>

int jobs_open(struct jobs *s, struct error *e)
{
	struct farm_config config;
	int rc = spool_open(&s->spool, s->config.spool, e);
	if (!rc)
		rc = blob_store_open(&s->blobs, spool_blobs(s->spool), s->config.blob_bytes, e);
	if (!rc)
		ages_open(s);
	if (!rc)
		rc = restore_open(s, e);
	if (!rc)
		rc = ended_jobs_open(s, e);
	if (rc)
		return rc;
	if (s->config.keep_partials && disk_mkdir(s->config.keep_partials, 0777) && errno != EEXIST)
		return error_set(e, errno, "%s: %s", s->config.keep_partials, strerror(errno));
	farm_config_init(&config);
	config.max_peers = s->config.max_connections;
	config.first_job = spool_next_job(s->spool);
	config.silent_after = 3 * s->config.heartbeat_seconds;
	config.max_faults = s->config.max_faults;
	config.first_pause = 2 * s->config.heartbeat_seconds;
	uv_random(NULL, NULL, &config.verify_seed, sizeof config.verify_seed, 0, NULL);
	config.forget_after = 6 * s->config.heartbeat_seconds;
	rc = farm_new(&s->farm, &config, e);
	if (!rc)
		rc = trust_open(s, e);
	if (!rc)
		rc = recovery_begin(s, e);
	return rc;
}

void jobs_init(struct jobs *s)
{
	s->follow_up = &follow_up;
	s->deferred_last = &s->deferred;
	s->acks_last = &s->acks;
	uv_timer_init(s->loop, &s->wake);
	uv_timer_init(s->loop, &s->drain);
	s->wake.data = s->drain.data = s;
	s->read = jobs_now(s);
}

void jobs_tick(struct jobs *s)
{
	if (recovery_is_on(s))
		s->changes++;
	durable_tick(s);
	retry_tick(s);
	files_tick(s);
	folder_tick(s);
	clear_tick(s);
	checkpoint_where_due(s);
}

void jobs_stop(struct jobs *s)
{
	s->stopping = true;
	uv_close((uv_handle_t *)&s->wake, NULL);
	uv_close((uv_handle_t *)&s->drain, NULL);
	recovery_stop(s);
}

void jobs_close(struct jobs *s)
{
	recovery_close(s);
	while (s->live) {
		struct live_job *next = s->live->next;
		live_job_free(s->live);
		s->live = next;
	}
	while (s->deferred) {
		struct deferred *next = s->deferred->next;
		mem_free(s->deferred);
		s->deferred = next;
	}
	durable_close(s);
	clear_close(s);
	if (s->seen.up > 0)
		ages_keep(s);
	if (s->farm)
		farm_free(s->farm);
	blob_store_close(s->blobs);
	spool_close(s->spool);
	mem_free(s->ended);
	mem_free(s->restored);
}
