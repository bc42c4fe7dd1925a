/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The list of jobs, and how it is opened and closed.
 *
 * jobs_open opens the spool and the ledger, lists the jobs that have ended, makes the core and begins to read those
 * that had not (recovery.c). jobs_view finds a job wherever it is: among those that run, those that are being read, the
 * last ENDED_MAX that ended, and then on the disk.
 *
 * A record that cannot be read is logged and left out. Any other error of the spool ends the start with a sentence;
 * jobs_close then gives back what was opened.
 */
#include "coordinator/shell/jobs.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/shell/ages.h"
#include "coordinator/shell/checkpoint.h"
#include "coordinator/shell/clear.h"
#include "coordinator/shell/durable.h"
#include "coordinator/shell/files.h"
#include "coordinator/shell/folder.h"
#include "coordinator/shell/keep.h"
#include "coordinator/shell/recovery.h"
#include "coordinator/shell/restore.h"
#include "coordinator/shell/trust.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

double jobs_now(const struct jobs *s)
{
	(void)s;
	return (double)uv_hrtime() * 1e-9;
}

const char *jobs_film_folder(const struct jobs *s, const struct plan *p)
{
	uint64_t bytes = canvas_bytes(p) + recovery_film_bytes(s) + (s->reading ? canvas_bytes(&s->reading->plan) : 0);
	for (const struct live_job *o = s->orders; o; o = o->next)
		if (o->canvas && !canvas_is_mapped(o->canvas))
			bytes += canvas_bytes(&o->plan);
	return bytes <= s->config.film_bytes ? NULL : spool_canvas(s->spool);
}

struct live_job *jobs_find(const struct jobs *s, uint64_t job)
{
	for (struct live_job *o = s->orders; o; o = o->next)
		if (o->id == job)
			return o;
	return NULL;
}

void jobs_remember(struct jobs *s, const struct job_record *r)
{
	if (s->ended_count == ENDED_MAX) {
		keep_drop(s, s->ended[0].id); /* nobody would count its films any more */
		memmove(s->ended, s->ended + 1, --s->ended_count * sizeof *s->ended);
	}
	s->ended[s->ended_count++] = *r;
}

int jobs_within_quota(const struct jobs *s, const char *owner, uint64_t job, uint64_t uploading,
		      const struct plan *plan, const Farm__Submit *m, struct error *e)
{
	struct quota_use has = {.asset_bytes = uploading};
	for (const struct live_job *o = s->orders; o; o = o->next) {
		if (o->ended || o->id == job || strcmp(o->record.owner, owner) != 0)
			continue;
		has.jobs++;
		has.asset_bytes += live_job_asset_bytes(live_job_submit(o));
	}
	return quota_check(&s->config.quota, &has, plan, live_job_asset_bytes(m), e);
}

/* ---- views ---- */

static void view_order(struct jobs *s, const struct live_job *o, struct job_view *v)
{
	struct job_status status;
	struct canvas_counts counted;
	view_of_record(v, &o->record);
	if (o->canvas) { /* in the end what the image holds, until then all that has come */
		canvas_counts(o->canvas, !o->ended, &counted);
		record_take_counted(&v->record, &o->plan, &counted, o->black, o->lit.beyond_share);
		record_add_note(&v->record, o->doubts);
	}
	if (o->ended)
		record_add_doubt(&v->record);
	if (!farm_job(s->farm, o->id, jobs_now(s), &status))
		return;
	view_add_status(v, &status);
	if (o->ended && (o->busy || o->unpublished || o->unrecorded)) { /* not before its image is there */
		text_copy(v->record.state, sizeof v->record.state, job_state_name(JOB_RUNNING));
		if (*o->record.why)
			text_print(v->waiting, sizeof v->waiting, "its %s cannot be written: %s",
				   o->unrecorded ? "record" : "image", o->record.why);
		else
			text_copy(v->waiting, sizeof v->waiting, "its image is being written");
		memcpy(v->owners_waiting, v->waiting, sizeof v->waiting);
		v->record.reason[0] = 0;
		v->record.exit_code = 0;
	}
}

bool jobs_view(struct jobs *s, uint64_t job, struct job_view *v)
{
	struct job_record r;
	struct live_job *o = jobs_find(s, job);
	if (o) {
		view_order(s, o, v);
		return true;
	}
	if (recovery_view(s, job, v))
		return true;
	for (size_t i = 0; i < s->ended_count; i++)
		if (s->ended[i].id == job) {
			view_of_record(v, &s->ended[i]);
			return true;
		}
	if (spool_read_record(s->spool, job, &r, NULL))
		return false;
	view_of_record(v, &r);
	return true;
}

static int by_id(const void *a, const void *b)
{
	const struct job_view *x = a, *y = b;
	return (x->record.id > y->record.id) - (x->record.id < y->record.id);
}

size_t jobs_views(struct jobs *s, struct job_view **views)
{
	size_t count = s->ended_count + recovery_views(s, NULL), n = 0;
	for (struct live_job *o = s->orders; o; o = o->next)
		count++;
	*views = mem_alloc(count, sizeof **views);
	if (!*views)
		return 0;
	for (size_t i = 0; i < s->ended_count; i++)
		view_of_record(&(*views)[n++], &s->ended[i]);
	for (struct live_job *o = s->orders; o; o = o->next)
		view_order(s, o, &(*views)[n++]);
	n += recovery_views(s, *views + n);
	qsort(*views, count, sizeof **views, by_id);
	return count;
}

/* ---- start and end ---- */

/* Jobs of an earlier life that have ended, and those that were never accepted: whoever submitted them has no answer. */
static int read_ended(struct jobs *s, struct error *e)
{
	uint64_t *ids;
	size_t count;
	int rc = spool_jobs(s->spool, &ids, &count, e);
	if (rc)
		return rc;
	s->ended = mem_alloc(ENDED_MAX, sizeof *s->ended);
	if (!s->ended) {
		mem_free(ids);
		return error_set(e, ENOMEM, "no memory for the list of jobs");
	}
	for (size_t i = count > ENDED_MAX ? count - ENDED_MAX : 0; i < count; i++) {
		struct job_record *r = &s->ended[s->ended_count];
		struct error fault;
		if (restore_lives(s, ids[i]))
			continue;
		rc = spool_read_record(s->spool, ids[i], r, &fault);
		if (rc == -ENOENT) /* the number of a job that did not get as far as a record */
			continue;
		if (rc) {
			log_event(LOG_SPOOL_FAULT, "job=j%llu text=%s", (unsigned long long)ids[i],
				  log_quote(fault.text).text);
			continue;
		}
		if (!record_is_ended(r)) {
			text_copy(r->state, sizeof r->state, "failed");
			text_copy(r->reason, sizeof r->reason, job_end_name(END_FAILED));
			text_copy(r->why, sizeof r->why, "the coordinator stopped before the job was accepted");
			r->exit_code = 3;
			r->ended = (double)time(NULL);
			r->ended_seen = ages_now(s);
			if (spool_write_record(s->spool, r, &fault))
				log_event(LOG_SPOOL_FAULT, "text=%s", log_quote(fault.text).text);
		}
		s->ended_count++;
	}
	mem_free(ids);
	log_event(LOG_SPOOL_READ, "path=%s jobs=%zu next=j%llu", log_quote(s->config.spool).text, s->ended_count,
		  (unsigned long long)spool_next_job(s->spool));
	return 0;
}

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
		rc = read_ended(s, e);
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
	while (s->orders) {
		struct live_job *next = s->orders->next;
		live_job_free(s->orders);
		s->orders = next;
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
