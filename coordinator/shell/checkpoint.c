/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Checkpoints: the films, seeds, chain states and counters of a job in one file, so that its journal can begin anew.
 *
 * checkpoint_where_due starts one when a job's journal has grown beyond the last checkpoint or a minimum, one job at a
 * time. The thread pool writes the next journal (with the last results of each group and part, which may still be taken
 * back), then checkpoint.tmp, syncs it, renames it to checkpoint and syncs the folder. Results that arrive meanwhile
 * wait in memory. Then the new journal takes over and older ones are deleted.
 *
 * If writing fails, the old checkpoint and journal go on, and another attempt follows after a pause. If only the sync
 * of the folder fails it is unknown which of the two pairs a crash would leave; both hold everything acknowledged, and
 * the job is held until a checkpoint succeeds. A checkpoint that is damaged when it is read makes its job begin anew.
 */
#include "coordinator/shell/checkpoint.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/film/canvas_save.h"
#include "coordinator/shell/back.h"
#include "coordinator/shell/durable.h"
#include "coordinator/shell/jobs.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

static const double pause_seconds = 30; /* after one that could not be written */

/* As it lies in memory. Whoever changes it, or what follows it, counts the version up. */
struct head {
	char magic[8];
	uint32_t bytes, worker_count;
	uint64_t job, generation;
	double cpu_seconds, bootstrap_cpu_seconds, look_written;
	struct live_job_times times;
	struct bootstrap_result lit;
	struct forecast_history looks;
	struct job_counts counts;
	char fingerprint[256];
};

static const char magic[8] = "hsltC004";
_Static_assert(sizeof(struct head) == 4528, "another layout is another version");

struct writing {
	uv_work_t work;
	struct jobs *jobs;
	struct live_job *order;
	struct journal *journal; /* the one that follows */
	struct head head;
	uint64_t bytes, kept_most;
	struct merged_record *merged; /* in that one */
	size_t merged_count, merged_capacity;
	char folder[SPOOL_PATH_MAX];
	int rc;
	bool unsure; /* it has its name, but perhaps not for good */
	struct error error;
};

static uint32_t slots_of(const struct live_job *o)
{
	return o->plan.groups * o->plan.parts;
}

/* ---- writing */

static int write_states(const struct live_job *o, struct checked_file *out, struct error *e)
{
	int rc = 0;
	for (uint32_t i = 0; i < slots_of(o) && !rc; i++) {
		uint32_t there = o->states[i] != NULL;
		rc = checked_file_write(out, &there, sizeof there, e);
		for (uint32_t k = 0; there && k < o->chains_per_lease && !rc; k++) {
			rc = checked_file_write(out, &o->states[i][k].size, sizeof o->states[i][k].size, e);
			if (!rc)
				rc = checked_file_write(out, o->states[i][k].bytes, o->states[i][k].size, e);
		}
	}
	return rc;
}

static int write_all(struct writing *w, struct checked_file *out, struct error *e)
{
	const struct live_job *o = w->order;
	int rc = checked_file_write(out, &w->head, sizeof w->head, e);
	if (!rc && o->seeds)
		rc = checked_file_write(out, o->seeds, o->plan.chains * sizeof *o->seeds, e);
	if (!rc)
		rc = write_states(o, out, e);
	return rc ? rc : canvas_save(o->canvas, out, e);
}

static void run(uv_work_t *work)
{
	struct writing *w = work->data;
	struct checked_file out = {0};
	char name[SPOOL_PATH_MAX + 16], temporary[SPOOL_PATH_MAX + 16];
	snprintf(name, sizeof name, "%s/checkpoint", w->folder);
	snprintf(temporary, sizeof temporary, "%s/checkpoint.tmp", w->folder);
	w->rc = journal_create(&w->journal, w->folder, w->head.job, w->head.generation, &w->error);
	if (!w->rc)
		back_copy(w->order, w->journal, w->kept_most, &w->merged, &w->merged_count, &w->merged_capacity);
	if (!w->rc)
		w->rc = checked_file_create(&out, temporary, &w->error);
	if (!w->rc)
		w->rc = write_all(w, &out, &w->error);
	if (!w->rc)
		w->rc = checked_file_finish(&out, &w->error);
	checked_file_close(&out);
	w->bytes = out.bytes;
	if (!w->rc)
		w->rc = disk_rename(temporary, name) ? error_set(&w->error, errno, "%s: %s", name, strerror(errno)) : 0;
	if (!w->rc) {
		w->rc = disk_sync_folder(w->folder, &w->error);
		w->unsure = w->rc != 0;
	}
	if (w->rc) {
		if (!w->unsure)
			disk_unlink(temporary);
		journal_release(w->journal);
		w->journal = NULL;
	}
}

/* Closing and unlinking a journal of hundreds of megabytes takes as many milliseconds: the pool does it, too. */
struct tidying {
	uv_work_t work;
	struct jobs *jobs;
	struct journal *old;
	uint64_t keep;
	char folder[SPOOL_PATH_MAX];
};

static void run_tidy(uv_work_t *work)
{
	struct tidying *t = work->data;
	journal_release(t->old); /* what waits for its flush holds it, too */
	journal_clear(t->folder, t->keep);
}

static void tidied(uv_work_t *work, int status)
{
	struct tidying *t = work->data;
	(void)status;
	t->jobs->checkpointing = false; /* until now, so that no younger journal is in the way */
	mem_free(t);
}

/* The journals before `keep` go. */
static void tidy(struct jobs *s, struct journal *old, const char *folder, uint64_t keep)
{
	struct tidying *t = mem_alloc(1, sizeof *t);
	if (!t) {
		journal_release(old);
		journal_clear(folder, keep);
		s->checkpointing = false;
		return;
	}
	*t = (struct tidying){.jobs = s, .old = old, .keep = keep};
	snprintf(t->folder, sizeof t->folder, "%s", folder);
	t->work.data = t;
	int rc = uv_queue_work(s->loop, &t->work, run_tidy, tidied);
	assert(rc == 0);
	(void)rc;
}

static void done(uv_work_t *work, int status)
{
	struct writing *w = work->data;
	struct jobs *s = w->jobs;
	struct live_job *o = w->order;
	uint64_t id = o->id;
	assert(status == 0);
	(void)status;
	if (w->rc && (w->unsure ||
		      o->unsure)) { /* this one and its journal, or the old ones: both hold all that was acknowledged */
		o->unsure = true;
		o->generation_least = w->head.generation + 1;
		o->checkpoint_after = jobs_now(s) + s->config.retry_seconds;
	} else if (w->rc) { /* the old ones go on */
		live_job_log(o, LOG_SPOOL_FAULT, "text=%s", log_quote(w->error.text).text);
		o->checkpoint_after = jobs_now(s) + pause_seconds;
		journal_clear(w->folder, journal_generation(o->journal));
	} else {
		o->unsure = false;
		journal_settle(o->journal);
		log_event(LOG_CHECKPOINT, "job=j%llu rounds=%llu bytes=%llu journal=%llu", (unsigned long long)id,
			  (unsigned long long)canvas_rounds(o->canvas), (unsigned long long)w->bytes,
			  (unsigned long long)journal_bytes(o->journal));
		tidy(s, o->journal, w->folder, w->head.generation);
		o->journal = w->journal;
		o->checkpoint_bytes = w->bytes;
		mem_free(o->merged);
		o->merged = w->merged;
		o->merged_count = w->merged_count;
		o->kept_bytes = journal_bytes(o->journal);
		o->merged_capacity = w->merged ? w->merged_capacity : 0;
		w->merged = NULL;
	}
	mem_free(w->merged);
	o->busy = false;
	s->checkpointing = s->checkpointing && !w->rc;
	if (!s->stopping && o->unsure)
		durable_hold(s, o, "its results cannot be stored",
			     w->error.text); /* which is the end of it, if it was cancelled */
	if (!s->stopping) {
		jobs_films_free(s);
		s->peers.films_free(s->peers.user, id);
	}
	mem_free(w);
}

/* Of a journal. */
static uint64_t limit_of(const struct jobs *s, const struct live_job *o)
{
	return o->checkpoint_bytes > s->config.journal_bytes ? o->checkpoint_bytes : s->config.journal_bytes;
}

static void start(struct jobs *s, struct live_job *o)
{
	struct job_status status;
	struct writing *w = mem_alloc(1, sizeof *w);
	if (!w || !farm_job(s->farm, o->id, jobs_now(s), &status)) {
		mem_free(w);
		o->checkpoint_after = jobs_now(s) + pause_seconds;
		return;
	}
	w->jobs = s;
	w->order = o;
	w->work.data = w;
	w->kept_most = limit_of(s, o);
	spool_job_path(s->spool, o->id, NULL, w->folder);
	w->head = (struct head){.bytes = sizeof w->head,
				.worker_count = o->worker_count,
				.job = o->id,
				.generation = journal_generation(o->journal) < o->generation_least
						      ? o->generation_least
						      : journal_generation(o->journal) + 1,
				.cpu_seconds = o->cpu_seconds,
				.bootstrap_cpu_seconds = o->record.bootstrap_cpu_seconds,
				.look_written = o->look_written,
				.times = o->times,
				.lit = o->lit,
				.counts = o->counts,
				.looks = *status.looks};
	memcpy(w->head.magic, magic, sizeof magic);
	snprintf(w->head.fingerprint, sizeof w->head.fingerprint, "%s", status.fingerprint);
	o->busy = s->checkpointing = true;
	int rc = uv_queue_work(s->loop, &w->work, run, done);
	assert(rc == 0);
	(void)rc;
}

void checkpoint_where_due(struct jobs *s)
{
	if (s->stepping || s->stopping ||
	    s->checkpointing) /* one at a time: meanwhile results of its job wait in memory */
		return;
	for (struct live_job *o = s->orders; o; o = o->next) {
		if (!o->canvas || o->busy || o->ended || o->late_count) /* what waits is in the journal alone */
			continue;
		if (canvas_missing(o->canvas)) /* what was taken back is computed at this time */
			continue;
		uint64_t limit = limit_of(s, o);
		if ((journal_bytes(o->journal) - o->kept_bytes > limit || o->unsure) &&
		    jobs_now(s) >= o->checkpoint_after)
			start(s, o);
		if (s->checkpointing)
			return;
	}
}

/* ---- reading */

static int read_states(struct live_job *o, struct checked_file *in, struct error *e)
{
	int rc = 0;
	for (uint32_t i = 0; i < slots_of(o) && !rc; i++) {
		uint32_t there;
		rc = checked_file_read(in, &there, sizeof there, e);
		if (rc || !there)
			continue;
		o->states[i] = mem_alloc(o->chains_per_lease, sizeof *o->states[i]);
		if (!o->states[i])
			return error_set(e, ENOMEM, "no memory for chains");
		for (uint32_t k = 0; k < o->chains_per_lease && !rc; k++) {
			struct chain_state *c = &o->states[i][k];
			uint32_t size;
			rc = checked_file_read(in, &size, sizeof size, e);
			if (!rc && (size == 0 || size > CHAIN_STATE_MAX))
				rc = error_set(e, EBADMSG, "the state of a chain has %u bytes", size);
			if (!rc && !(c->bytes = mem_alloc(size, 1)))
				rc = error_set(e, ENOMEM, "no memory for chains");
			if (!rc) {
				c->size = size;
				rc = checked_file_read(in, c->bytes, size, e);
			}
		}
	}
	return rc;
}

static void take_head(struct live_job *o, const struct head *h)
{
	o->worker_count = h->worker_count;
	o->cpu_seconds = o->record.cpu_seconds = h->cpu_seconds;
	o->record.bootstrap_cpu_seconds = h->bootstrap_cpu_seconds;
	o->look_written = h->look_written;
	o->times = h->times;
	o->lit = h->lit;
	o->record.looks.count = 0;
	for (uint32_t i = 0; i < h->looks.count && i < FORECAST_LOOKS; i++)
		forecast_add_look(&o->record.looks, &h->looks.looks[i]);
	o->counts = h->counts;
	snprintf(o->fingerprint, sizeof o->fingerprint, "%s", h->fingerprint);
}

static int read_all(struct live_job *o, struct checked_file *in, uint64_t *generation, struct error *e)
{
	struct head h;
	int rc = checked_file_read(in, &h, offsetof(struct head, worker_count),
				   e); /* another version's may be shorter */
	if (!rc)
		rc = spool_check_version(h.magic, magic, in->path, e);
	if (!rc && h.bytes != sizeof h)
		rc = error_set(e, EPROTO,
			       "%s: its head has %u bytes instead of %zu: a coordinator for another machine wrote it",
			       in->path, h.bytes, sizeof h);
	if (!rc)
		rc = checked_file_read(in, &h.worker_count, sizeof h - offsetof(struct head, worker_count), e);
	if (!rc && h.job != o->id)
		rc = error_set(e, EBADMSG, "%s: of j%llu", in->path, (unsigned long long)h.job);
	if (rc)
		return rc;
	h.fingerprint[sizeof h.fingerprint - 1] = 0;
	take_head(o, &h);
	*generation = h.generation;
	int exponent = canvas_grid_exponent(&o->plan, o->lit.b_pooled, live_job_submit(o)->brightest);
	rc = canvas_new(&o->canvas, &o->plan, exponent, o->film_folder, e);
	if (!rc && o->seeds)
		rc = checked_file_read(in, o->seeds, o->plan.chains * sizeof *o->seeds, e);
	if (!rc)
		rc = read_states(o, in, e);
	if (!rc)
		rc = canvas_load(o->canvas, in, e);
	bootstrap_free(o->bootstrap);
	o->bootstrap = NULL;
	o->checkpoint_bytes = in->bytes;
	return rc;
}

int checkpoint_load(const struct spool *spool, struct live_job *o, uint64_t *generation, checked_file_heard *heard,
		    void *user, struct error *e)
{
	char name[SPOOL_PATH_MAX];
	struct checked_file in;
	spool_job_path(spool, o->id, "checkpoint.tmp", name);
	disk_unlink(name); /* of a life that ended before it was whole */
	spool_job_path(spool, o->id, "checkpoint", name);
	int rc = checked_file_open_heard(&in, name, heard, user, e);
	if (rc)
		return rc;
	in.bytes = in.left;
	rc = read_all(o, &in, generation, e);
	checked_file_close(&in);
	return rc;
}
