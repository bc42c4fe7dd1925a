/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Answers questions about the farm without changing it: jobs, workers, leases, and why a job is waiting.
 *
 * farm_job_status fills all figures of a job. describe_wait finds the first reason why nothing is being done for it, in
 * this order: held, being evaluated, no worker, no worker of its fingerprint, verification, doubted states, a limited
 * owner, workers that failed, and last other jobs. Sentences for a job's owner do not name other owners' jobs.
 *
 * An unknown id makes a function return false, 0 or NAN. Pointers in the results are valid until the farm's next step.
 */
#include "coordinator/core/status.h"

#include "common/base/text.h"
#include "coordinator/core/answer.h"
#include "coordinator/core/doubt.h"
#include "coordinator/core/forecast.h"
#include "coordinator/core/identity_index.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/peer.h"
#include "coordinator/core/share.h"
#include "coordinator/core/verify.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *peer_state_name(enum peer_state s)
{
	static const char *const names[] = {
		[PEER_ACTIVE] = "active", [PEER_SILENT] = "silent", [PEER_QUARANTINED] = "quarantined"};
	return names[s];
}

const char *job_state_name(enum job_state s)
{
	static const char *const names[] = {
		[JOB_QUEUED] = "queued",      [JOB_BOOTSTRAP] = "bootstrap", [JOB_RUNNING] = "running",
		[JOB_HELD] = "held",	      [JOB_DONE] = "done",	     [JOB_FAILED] = "failed",
		[JOB_CANCELLED] = "cancelled"};
	return names[s];
}

const char *job_end_name(enum job_end e)
{
	static const char *const names[] = {
		[END_NONE] = "none",   [END_MUTATIONS] = "mutations", [END_TIME] = "time",    [END_ERROR] = "error",
		[END_BLACK] = "black", [END_CANCELLED] = "cancelled", [END_FAILED] = "failed"};
	return names[e];
}

int job_exit_code(const struct job_status *s)
{
	if (s->state != JOB_DONE)
		return 3;
	if (s->chains_disagree)
		return 5;
	bool missed = s->plan->target_error > 0 && s->end != END_ERROR && s->end != END_BLACK;
	return missed ? 4 : 0;
}

/* Returns the job that keeps workers busy that j could use: the first of higher priority, otherwise the one with the
 * most leases out. NULL: none. */
static const struct job *find_blocking_job(const struct farm *f, const struct job *j)
{
	const struct job *busiest = NULL;
	for (uint32_t i = 0; i < f->live_job_count; i++) {
		const struct job *o = f->live_jobs[i];
		if (o == j || !o->outstanding_lease_count || !share_jobs_compete(o, j))
			continue;
		if (o->priority > j->priority)
			return o;
		if (!busiest || o->outstanding_lease_count > busiest->outstanding_lease_count)
			busiest = o;
	}
	return busiest;
}

static uint32_t count_active_workers(const struct farm *f)
{
	uint32_t n = 0;
	for (struct link *k = f->classes.next; k != &f->classes; k = k->next)
		n += list_entry(k, struct peer_class, link)->active_peer_count;
	return n;
}

static bool has_paused_worker(const struct farm *f, const struct job *j)
{
	for (uint32_t i = 0; i < f->peer_count; i++)
		if (job_accepts_class(j, f->peers[i]->class) && peer_backoff_end(f->peers[i], j->id) > f->now &&
		    !peer_waits_for_memory(f->peers[i], j->id))
			return true;
	return false;
}

static bool put_memory_wait(const struct farm *f, const struct job *j, char *text, size_t size)
{
	for (uint32_t i = 0; i < f->peer_count; i++) {
		const struct peer *p = f->peers[i];
		if (p->state != PEER_ACTIVE || !job_accepts_class(j, p->class) || !peer_waits_for_memory(p, j->id))
			continue;
		text_print(text, size, "worker %s has no room for its scene now: %s", p->name, p->last_fault);
		return true;
	}
	return false;
}

/* j->last_fault has the form "worker: why". */
static void put_last_failure(const struct job *j, char *text, size_t size)
{
	const char *colon = strstr(j->explanation, ": ");
	if (colon)
		text_print(text, size, "no worker can compute it; worker %.*s failed last%s",
			   (int)(colon - j->explanation), j->explanation, colon);
	else
		text_print(text, size, "no worker can compute it: %s", j->explanation);
}

/* Names the workers whose own machines are at fault, because somebody has to repair those machines. */
static void put_failing_workers(const struct farm *f, const struct job *j, char *text, size_t size)
{
	char names[100] = "";
	struct text t = {names, sizeof names};
	for (uint32_t i = 0; i < f->peer_count; i++)
		if (f->peers[i]->state == PEER_ACTIVE && job_accepts_class(j, f->peers[i]->class) &&
		    peer_is_at_fault(f->peers[i], j->id))
			text_appendf(&t, "%s%s", *names ? ", " : "", f->peers[i]->name);
	if (*names)
		text_print(text, size,
			   "no worker can compute it, because of a problem on the machines of %s; the last one: %s",
			   names, j->explanation);
	else
		put_last_failure(j, text, size);
}

/* name_all: other owners' jobs may be named. */
static void put_blocking_job(char *text, size_t size, const struct job *j, const struct job *other, bool name_all)
{
	bool higher = other->priority > j->priority;
	if (!name_all && other->owner != j->owner)
		text_copy(text, size,
			  higher ? "waits for a job of higher priority of another owner"
				 : "workers busy with a job of another owner");
	else
		text_print(text, size,
			   higher ? "waits for j%llu of higher priority (%d)" : "workers busy with j%llu (priority %d)",
			   (unsigned long long)other->id, other->priority);
}

static void put_hold_reasons(const struct job *j, char *text, size_t size)
{
	struct text t = {text, size};
	const char *between = "";
	for (int i = JOB_HOLD_COUNT; i-- > 0;)
		if (*j->hold_reasons[i]) {
			text_appendf(&t, "%s%s", between, j->hold_reasons[i]);
			between = "; ";
		}
}

/* If all leases that are out are late and none of them has been answered, writes which worker holds the oldest lease.
 * Returns false if no lease is out or one of them is not late. */
static bool put_late_leases(const struct farm *f, const struct job *j, char *text, size_t size)
{
	const struct lease *oldest = NULL;
	uint32_t count = 0;
	for (uint32_t i = 0; i < j->slot_count; i++) {
		const struct slot *s = &j->slots[i];
		for (const struct lease *l = s->leases; l; l = l->next) {
			if (l->is_overdue)
				continue;
			if (l->is_delivered || job_copy_due_time(&f->config, j, s) > f->now)
				return false;
			count++;
			if (!oldest || l->sent_at < oldest->sent_at)
				oldest = l;
		}
	}
	if (oldest)
		text_print(text, size, "no answer to its leases (%u are out): %s has had the oldest one for %.0f s",
			   count, oldest->peer->name, f->now - oldest->sent_at);
	return oldest != NULL;
}

/* Writes the first reason why no worker computes the job; "" if one does. Returns the job that the text names if
 * another job keeps the workers busy, otherwise NULL. */
static const struct job *describe_wait(const struct farm *f, const struct job *j, char *text, size_t size)
{
	text[0] = 0;
	if (!job_is_live(j) || (j->outstanding_lease_count && !job_is_held(j) && !put_late_leases(f, j, text, size)) ||
	    *text)
		return NULL;
	uint32_t active = count_active_workers(f);
	const struct job *other = find_blocking_job(f, j);
	if (job_is_held(j))
		put_hold_reasons(j, text, size);
	else if (j->is_preparing)
		snprintf(text, size, "the bootstrap is being evaluated");
	else if (j->is_estimating_error && (j->pending_end != END_NONE || !job_find_ready_slot(j)))
		snprintf(text, size, "its error is being estimated");
	else if (f->peer_count == 0)
		snprintf(text, size, "no worker is connected");
	else if (active == 0)
		snprintf(text, size, "no worker responds and is not quarantined (%u connected)", f->peer_count);
	else if (j->class && !j->is_mixed && j->class->active_peer_count == 0)
		snprintf(text, size, "no connected worker has fingerprint %s (%u have others)", j->fingerprint, active);
	else if (verify_describe_wait(f, j, text, size) || doubt_describe_wait(f, j, text, size))
		return NULL;
	else if (share_is_limited(f, j) && share_count_unanswered_leases(f, j->owner))
		snprintf(text, size,
			 "a job of its owner crashed workers: one lease at a time until a result arrives (for %.0f s)",
			 j->owner->limited_until - f->now);
	else if (answer_have_all_workers_failed(f, j))
		put_failing_workers(f, j, text, size);
	else if (put_memory_wait(f, j, text, size))
		return NULL;
	else if (has_paused_worker(f, j))
		text_print(text, size, "its workers failed and pause before they try again; the last one: %s",
			   j->explanation);
	else if (!other)
		snprintf(text, size, "no worker asks for work");
	else {
		put_blocking_job(text, size, j, other, true);
		return other;
	}
	return NULL;
}

static void fill_waiting(const struct farm *f, const struct job *j, struct job_status *s)
{
	const struct job *other = describe_wait(f, j, s->waiting, sizeof s->waiting);
	memcpy(s->owners_waiting, s->waiting, sizeof s->waiting);
	if (other)
		put_blocking_job(s->owners_waiting, sizeof s->owners_waiting, j, other, false);
}

/* Needs the result of fill_waiting. */
static void fill_eta(const struct job *j, double now, struct job_status *s)
{
	bool idle = *s->waiting && !j->is_preparing && !j->is_estimating_error;
	struct forecast_range eta = job_eta(j, idle, now);
	s->eta = eta.middle;
	s->eta_low = eta.low;
	s->eta_high = eta.high;
}

static void fill_counts(const struct job *j, struct job_status *s)
{
	s->rounds = j->kind == LEASE_RENDER ? j->rounds : 0;
	s->bootstrap_merged = j->bootstrap_merged;
	s->leases_merged = j->leases_merged;
	double slots = (double)j->plan.groups * j->plan.parts;
	s->mutations = (uint64_t)((double)j->leases_merged * ((double)plan_round_mutations(&j->plan) / slots));
	s->leases = j->outstanding_lease_count;
	s->counts = j->counts;
}

static void fill_share(const struct farm *f, const struct job *j, struct job_status *s)
{
	struct share share;
	share_compute(f, j, &share);
	s->workers = share.workers;
	s->machines = share.machines;
	s->share = share.machines_due;
	memcpy(s->place, share.place, sizeof s->place);
	memcpy(s->owners_place, share.owners_place, sizeof s->owners_place);
}

bool farm_job_status(const struct farm *f, uint64_t id, double now, struct job_status *s)
{
	const struct job *j = farm_find_job(f, id);
	if (!j)
		return false;
	*s = (struct job_status){
		.id = j->id,
		.owner = j->owner->name,
		.priority = j->priority,
		.verify = j->verify_fraction,
		.plan = &j->plan,
		.state = job_is_held(j) && job_is_live(j) ? JOB_HELD : j->state,
		.end = j->end,
		.fingerprint = j->fingerprint,
		.submitted_at = j->submitted_at,
		.started_at = j->started_at,
		.ended_at = j->ended_at,
		.progress = job_progress(j, now),
		.rate = job_is_live(j) ? rate_value(&j->rate, now) : 0,
		.chains_disagree = j->chains_disagree,
		.rel_error = j->rel_error,
		.bootstrap_seconds = j->first_round_at - j->started_at,
		.looks = &j->looks,
		.halving_cpu = j->halving_cost.cpu_seconds,
		.halving_seconds = job_halving_seconds(j, now),
	};
	fill_counts(j, s);
	fill_share(f, j, s);
	memcpy(s->why, j->explanation, sizeof s->why);
	fill_waiting(f, j, s);
	fill_eta(j, now, s);
	return true;
}

bool farm_job_counts(const struct farm *f, uint64_t id, struct job_counts *c)
{
	const struct job *j = farm_find_job(f, id);
	if (!j)
		return false;
	*c = j->counts;
	return true;
}

double farm_job_elapsed(const struct farm *f, uint64_t id, double now)
{
	const struct job *j = farm_find_job(f, id);
	return j ? job_elapsed(j, now) : NAN;
}

bool farm_job_expects_results(const struct farm *f, uint64_t id, int *priority)
{
	const struct job *j = farm_find_job(f, id);
	*priority = j ? j->priority : 0;
	return j && job_is_live(j) && !*j->hold_reasons[HOLD_FILES] && !*j->hold_reasons[HOLD_USER] &&
	       (j->outstanding_lease_count || *j->hold_reasons[HOLD_STORAGE]);
}

bool farm_peer_status(const struct farm *f, uint64_t id, struct peer_status *s)
{
	const struct peer *p = farm_find_peer(f, id);
	if (!p)
		return false;
	*s = (struct peer_status){
		.id = p->id,
		.worker_id = p->identity->id,
		.restarts = p->restarts,
		.name = p->name,
		.fingerprint = p->class->fingerprint,
		.threads = p->threads,
		.wanted_leases = p->wanted_lease_count,
		.held_leases = p->held_lease_count,
		.state = p->state,
		.joined_at = p->joined_at,
		.last_seen = p->last_seen,
		.merged = p->merged,
		.repeats = p->repeats,
		.refused = p->refused,
		.faults = p->faults,
		.failures = p->failures,
	};
	memcpy(s->last_fault, p->last_fault, sizeof s->last_fault);
	return true;
}

bool farm_lease_is_verified(const struct farm *f, const struct lease_key *k)
{
	const struct job *j = farm_find_job(f, k->job);
	return j && proof_is_required(j, k);
}

uint64_t farm_next_quarantined(const struct farm *f, uint64_t after)
{
	uint64_t next = 0;
	for (uint32_t i = 0; i < f->registry_count; i++) {
		const struct identity *k = f->registry[i];
		if (k->is_quarantined && k->id > after && (next == 0 || k->id < next))
			next = k->id;
	}
	return next;
}

bool farm_worker_status(const struct farm *f, uint64_t worker_id, struct worker_status *s)
{
	const struct identity *k = identity_index_find_by_id(&f->identity_index, worker_id);
	if (!k)
		return false;
	*s = (struct worker_status){.worker_id = k->id,
				    .restarts = k->restarts,
				    .certificate = k->certificate,
				    .name = k->name,
				    .home = k->home,
				    .last_fault = k->last_fault,
				    .wrong_results = k->wrong_results,
				    .is_quarantined = k->is_quarantined};
	return true;
}

bool farm_lease_status(const struct farm *f, uint64_t peer, uint32_t i, struct lease_status *s)
{
	const struct peer *p = farm_find_peer(f, peer);
	for (uint32_t k = 0; p && k < p->lease_capacity; k++) {
		const struct lease *l = &p->leases[k];
		if (!l->is_in_use || i-- > 0)
			continue;
		*s = (struct lease_status){
			.key = lease_get_key(l),
			.sent_at = l->sent_at,
			.is_overdue = l->is_overdue,
		};
		return true;
	}
	return false;
}

uint64_t farm_next_peer(const struct farm *f, uint64_t after)
{
	uint32_t i = after == UINT64_MAX ? f->peer_count : farm_peer_lower_bound(f, after + 1);
	return i < f->peer_count ? f->peers[i]->id : 0;
}
