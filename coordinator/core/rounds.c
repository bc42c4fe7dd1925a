/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The life of a job: submission, bootstrap, rounds, a bound, the end.
 *
 * Happy path: rounds_submit puts the job on the list of live jobs, ordered by priority. The first lease starts it
 * (rounds_start_job). When the bootstrap is merged, the shell prepares seeds and b (ACTION_BOOTSTRAP_DONE) and
 * rounds_handle_prepared opens the first round. After each complete round rounds_check_bounds checks the bounds; if the
 * error has to be estimated, the shell does that (ACTION_ESTIMATE_ERROR) and rounds_handle_error_estimated decides.
 * rounds_end_job revokes the leases that are out and has the image published.
 *
 * Failures: a submission is rejected with a sentence (priority, too many jobs, job_new's reasons). A job fails when
 * its bootstrap cannot be prepared or when another file of the core ends it. A black bootstrap ends the job as done.
 * The shell's answers about a job that has ended meanwhile are ignored.
 */
#include "coordinator/core/rounds.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/estimate/merge.h"
#include "coordinator/core/forecast.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/verify.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static struct action *add_job_action(struct farm *f, enum action_kind kind, const struct job *j)
{
	struct action *a = update_add(f, kind);
	a->job = j->id;
	a->rounds = j->kind == LEASE_RENDER ? j->rounds : 0;
	return a;
}

static void add_change_action(struct farm *f, const struct job *j)
{
	struct action *a = add_job_action(f, ACTION_JOB_CHANGED, j);
	a->state = j->state;
	a->end = j->end;
	a->text = j->explanation;
}

void rounds_reject_event(struct farm *f, const struct event *ev, const char *text)
{
	struct action *a = update_add(f, ACTION_REJECTED);
	a->tag = ev->tag;
	a->job = ev->job;
	a->text = text;
}

static bool precedes(const struct job *a, const struct job *b)
{
	return a->priority > b->priority || (a->priority == b->priority && a->id < b->id);
}

void rounds_insert_live(struct farm *f, struct job *j)
{
	uint32_t i = f->live_job_count++;
	for (; i > 0 && precedes(j, f->live_jobs[i - 1]); i--)
		f->live_jobs[i] = f->live_jobs[i - 1];
	f->live_jobs[i] = j;
}

void rounds_remove_live(struct farm *f, const struct job *j)
{
	uint32_t i = 0;
	while (f->live_jobs[i] != j)
		i++;
	f->live_job_count--;
	memmove(&f->live_jobs[i], &f->live_jobs[i + 1], (f->live_job_count - i) * sizeof *f->live_jobs);
}

void rounds_add_job(struct farm *f, struct job *j)
{
	uint32_t i = f->job_count++;
	for (; i > 0 && f->jobs[i - 1]->id > j->id; i--)
		f->jobs[i] = f->jobs[i - 1];
	f->jobs[i] = j;
	rounds_insert_live(f, j);
}

void rounds_forget_job(struct farm *f, struct job *j)
{
	assert(!job_is_live(j));
	uint32_t i = 0;
	while (f->jobs[i] != j)
		i++;
	f->job_count--;
	memmove(&f->jobs[i], &f->jobs[i + 1], (f->job_count - i) * sizeof *f->jobs);
	job_free(j);
}

void rounds_submit(struct farm *f, const struct event *ev)
{
	const struct event_submit *e = &ev->submit;
	if (e->priority < -PRIORITY_MAX || e->priority > PRIORITY_MAX) {
		rounds_reject_event(f, ev, "a priority is from -100 to 100");
		return;
	}
	if (f->live_job_count >= f->config.max_jobs) {
		rounds_reject_event(f, ev, "the coordinator has as many live jobs as it accepts");
		return;
	}
	const char *refusal = "";
	struct job *j = job_new(f, e, &refusal);
	if (!j) {
		rounds_reject_event(f, ev, refusal);
		return;
	}
	j->id = f->next_job_id++;
	rounds_add_job(f, j);
	struct action *a = add_job_action(f, ACTION_SUBMITTED, j);
	a->tag = ev->tag;
	add_change_action(f, j);
}

void rounds_start_job(struct farm *f, struct job *j)
{
	if (isnan(j->started_at))
		j->started_at = f->now;
	if (j->state == JOB_QUEUED) {
		j->state = JOB_BOOTSTRAP;
		add_change_action(f, j);
	}
}

/* Forgets the job that ended first if more than max_ended_jobs have ended, but never `latest`, which has just ended:
 * the update still refers to it. */
static void forget_oldest_ended(struct farm *f, const struct job *latest)
{
	if (f->job_count - f->live_job_count <= f->config.max_ended_jobs)
		return;
	uint32_t oldest = UINT32_MAX;
	for (uint32_t i = 0; i < f->job_count; i++) {
		const struct job *j = f->jobs[i];
		if (!job_is_live(j) && j != latest && (oldest == UINT32_MAX || j->ended_at < f->jobs[oldest]->ended_at))
			oldest = i;
	}
	assert(oldest != UINT32_MAX);
	struct job *j = f->jobs[oldest];
	add_job_action(f, ACTION_JOB_FORGOTTEN, j);
	rounds_forget_job(f, j);
}

static void revoke_job_leases(struct farm *f, struct job *j)
{
	for (uint32_t i = 0; i < j->slot_count; i++)
		lease_revoke_slot(f, &j->slots[i]);
}

void rounds_end_job(struct farm *f, struct job *j, enum job_end end, const char *text)
{
	revoke_job_leases(f, j);
	j->progress_floor = job_progress(j, f->now);
	j->state = end == END_CANCELLED ? JOB_CANCELLED : end == END_FAILED ? JOB_FAILED : JOB_DONE;
	j->end = end;
	j->ended_at = f->now;
	text_copy(j->explanation, sizeof j->explanation, text);
	verify_forget_job(f, j);
	if (j->class)
		peer_class_release(j->class);
	j->class = NULL;
	mem_free(j->slots);
	mem_free(j->proofs);
	j->slots = NULL;
	j->proofs = NULL;
	j->slot_count = 0;
	rounds_remove_live(f, j);
	if (j->state == JOB_DONE)
		add_job_action(f, ACTION_PUBLISH, j);
	add_change_action(f, j);
	forget_oldest_ended(f, j);
}

void rounds_cancel(struct farm *f, const struct event *ev)
{
	struct job *j = farm_find_job(f, ev->job);
	if (!j || !job_is_live(j)) {
		rounds_reject_event(f, ev, j ? "the job is over" : "no such job");
		return;
	}
	struct action *a = add_job_action(f, ACTION_CANCELLED, j);
	a->tag = ev->tag;
	rounds_end_job(f, j, END_CANCELLED, "cancelled");
}

static void request_error_estimate(struct farm *f, struct job *j)
{
	j->is_estimating_error = true;
	j->estimate_requested_at = f->now;
	add_job_action(f, ACTION_ESTIMATE_ERROR, j);
}

enum job_end rounds_met_bound(const struct job *j, double elapsed)
{
	if (j->rounds >= j->plan.rounds)
		return END_MUTATIONS;
	return j->plan.seconds > 0 && elapsed >= j->plan.seconds ? END_TIME : END_NONE;
}

void rounds_check_bounds(struct farm *f, struct job *j, double elapsed)
{
	enum job_end end = rounds_met_bound(j, elapsed);
	bool wants_error = j->plan.target_error > 0;
	if (end != END_NONE && !wants_error) {
		rounds_end_job(f, j, end, "");
	} else if (end != END_NONE) {
		j->pending_end = end;
		revoke_job_leases(f, j);
		request_error_estimate(f, j);
	} else if (merge_error_is_due(&j->plan, j->rounds)) {
		request_error_estimate(f, j);
	}
}

void rounds_handle_round_done(struct farm *f, struct job *j)
{
	if (j->kind == LEASE_RENDER) {
		add_job_action(f, ACTION_ROUND_DONE, j);
		rounds_check_bounds(f, j, job_elapsed(j, f->now));
		return;
	}
	j->is_preparing = true;
	add_job_action(f, ACTION_BOOTSTRAP_DONE, j);
}

void rounds_start_rendering(struct farm *f, struct job *j, bool black)
{
	if (black) {
		rounds_end_job(f, j, END_BLACK, "no bootstrap sample carried light");
		return;
	}
	j->state = JOB_RUNNING;
	add_change_action(f, j);
}

void rounds_handle_prepared(struct farm *f, const struct event *ev)
{
	struct job *j = farm_find_job(f, ev->prepared.job);
	if (!j || !job_is_live(j) || !j->is_preparing)
		return;
	j->is_preparing = false;
	if (!ev->prepared.ok) {
		rounds_end_job(f, j, END_FAILED, ev->text ? ev->text : "");
		return;
	}
	job_open_rounds(j, f->now);
	rounds_start_rendering(f, j, ev->prepared.black);
}

void rounds_handle_image_published(struct farm *f, const struct event *ev)
{
	struct job *j = farm_find_job(f, ev->image_published.job);
	if (j && j->state == JOB_DONE)
		j->chains_disagree = ev->image_published.chains_disagree;
}

void rounds_handle_error_estimated(struct farm *f, const struct event *ev)
{
	struct job *j = farm_find_job(f, ev->error_estimated.job);
	if (!j || !job_is_live(j) || !j->is_estimating_error || ev->error_estimated.rounds != j->rounds)
		return;
	j->is_estimating_error = false;
	j->progress_floor = job_progress(j, f->now);
	j->rel_error = ev->error_estimated.doubtful ? NAN : ev->error_estimated.rel_error;
	j->rel_error_rounds = j->rounds;
	job_note_look(j, ev->error_estimated.rel_error, ev->error_estimated.rel_mse, ev->error_estimated.degrees,
		      ev->error_estimated.doubtful, ev->error_estimated.cpu_seconds);
	/* An estimate that was made because another bound was met does not count if that bound was lifted meanwhile. */
	bool counts = j->pending_end != END_NONE || merge_error_is_due(&j->plan, j->rounds);
	if (counts && j->rel_error <= j->plan.target_error)
		rounds_end_job(f, j, END_ERROR, "");
	else if (j->pending_end != END_NONE)
		rounds_end_job(f, j, j->pending_end, "");
	else if (counts && merge_ends_black(&j->plan, j->rounds, ev->error_estimated.black))
		rounds_end_job(f, j, END_BLACK, "no sample carried light");
}
