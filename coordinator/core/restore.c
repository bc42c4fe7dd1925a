/* SPDX-License-Identifier: Apache-2.0 */
/* Restores jobs of an earlier run, and jobs that have ended and are extended, from which of their leases are merged. */
#include "coordinator/core/restore.h"

#include "common/base/mem.h"
#include "coordinator/core/forecast.h"
#include "coordinator/core/rounds.h"
#include "coordinator/core/worker_registry.h"

#include <assert.h>
#include <math.h>

/* Pins the job to the fingerprint of its merged batches. If out of memory the job stays unpinned, and the first
 * worker that asks pins it. */
static void pin_job(struct farm *f, struct job *j, const char *fingerprint)
{
	struct peer_class *c = *fingerprint ? peer_class_acquire(&f->classes, fingerprint) : NULL;
	if (!c)
		return;
	job_pin(j, c);
	peer_class_release(c);
}

/* A maker may be a worker that is no longer known, which worker_registry_recall adds. */
static void restore_makers(struct farm *f, struct job *j, const struct event_join *makers)
{
	for (uint32_t i = 0; makers && i < j->slot_count; i++)
		if (makers[i].name)
			j->slots[i].doubt.maker = worker_registry_recall(f, &makers[i]);
}

static void restore_times(struct farm *f, struct job *j, const struct event_restore *r)
{
	if (isnan(r->elapsed))
		return;
	j->started_at = f->now - r->elapsed;
	j->state = JOB_BOOTSTRAP;
	if (j->kind == LEASE_RENDER)
		j->first_round_at = j->started_at + (isnan(r->first_round_at) ? r->elapsed : r->first_round_at);
}

static void restore_looks(struct job *j, const struct forecast_history *looks)
{
	j->looks = *looks;
	if (looks->count == 0)
		return;
	const struct forecast_look *last = &looks->looks[looks->count - 1];
	j->rel_error = last->is_doubtful ? NAN : sqrt(last->rel_mse_upper);
	j->rel_error_rounds = (uint64_t)(last->work / (double)plan_round_mutations(&j->plan));
	job_update_forecast(j);
}

/* Makes room for one more live job. max_jobs does not apply unless a client has asked, since nobody could be told
 * that a job of an earlier run is refused. */
static bool ensure_live_capacity(struct farm *f, bool by_client)
{
	uint32_t max_live = by_client ? f->config.max_jobs : f->live_job_capacity;
	if (by_client || f->live_job_count < max_live)
		return f->live_job_count < max_live;
	uint32_t before = f->live_job_capacity, capacity = before + f->config.max_jobs,
		 ended = f->config.max_ended_jobs + 1;
	void *live = mem_grow(f->live_jobs, before * sizeof *f->live_jobs, capacity * sizeof *f->live_jobs);
	if (live)
		f->live_jobs = live;
	void *jobs = live ? mem_grow(f->jobs, (before + ended) * sizeof *f->jobs, (capacity + ended) * sizeof *f->jobs)
			  : NULL;
	if (!jobs)
		return false;
	f->jobs = jobs;
	f->live_job_capacity = capacity;
	if (update_reserve(f, 0) == 0)
		return true;
	f->live_job_capacity = before;
	return false;
}

void restore_job(struct farm *f, const struct event *ev)
{
	const struct event_restore *r = &ev->restore;
	struct job *ended = farm_find_job(f, r->job);
	assert(!ended || !job_is_live(ended));
	const char *refusal = "the coordinator has as many live jobs as it accepts";
	struct job *j = ensure_live_capacity(f, ev->tag) ? job_new(f, &r->submit, &refusal) : NULL;
	if (!j) {
		struct action *a = update_add(f, ACTION_REJECTED);
		a->tag = ev->tag;
		a->job = r->job;
		a->text = refusal;
		return;
	}
	j->id = r->job;
	if (f->next_job_id <= j->id)
		f->next_job_id = j->id + 1;
	if (ended)
		rounds_forget_job(f, ended);
	rounds_add_job(f, j);
	j->counts = r->counts;
	job_restore(j, r->kind, r->next_epochs, f->now);
	restore_makers(f, j, r->makers);
	restore_times(f, j, r);
	restore_looks(j, r->looks);
	pin_job(f, j, r->fingerprint);
	j->progress_floor = job_progress(j, f->now);
	if (j->kind != LEASE_RENDER)
		return;
	rounds_start_rendering(f, j, r->is_black);
	/* A bound that the last complete round met still applies. An estimate of the error that was due is made
	 * again, with the same result. */
	if (job_is_live(j) && j->rounds > 0)
		rounds_check_bounds(f, j, isnan(r->last_round_end) ? r->elapsed : r->last_round_end);
}
