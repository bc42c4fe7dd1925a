/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job of the core: its slots, the lists they are in, and the progress of rounds.
 *
 * A slot is in one list, depending on its next epoch (the first incomplete round, the one after it, or blocked behind
 * both) and on its holders: ready (nobody holds its lease), out (one worker does), or second (it waits for another
 * worker's answer). With two holders it is in no list. job_place_slot moves it after each change. When all slots have
 * merged a round, the lists of the next round take its place as a whole; only after an epoch was taken back is each
 * slot placed individually.
 *
 * Memory is allocated when a job is made, which may be refused with a sentence. Nothing after that can fail.
 */
#include "coordinator/core/job.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/proof.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { TIMEOUT_MEDIANS = 10, TIMEOUT_DOUBLINGS = 16 };
static const double straggler_medians = 1.5;

static void begin_lease_kind(struct job *j, enum lease_kind kind, uint64_t limit, double now)
{
	j->kind = kind;
	j->round_limit = limit;
	j->rounds = 0;
	j->done_slot_count = j->ahead_slot_count = 0;
	j->has_far_ahead_slot = false;
	j->duration_count = 0;
	j->median_duration = NAN;
	rate_init(&j->rate, now);
	for (uint32_t i = 0; i < j->slot_count; i++) {
		struct slot *s = &j->slots[i];
		assert(!s->leases);
		s->next_epoch = 0;
		s->doubt = (struct doubt){0};
		job_place_slot(j, s);
	}
}

static void init_job(struct job *j, const struct event_submit *e, double now)
{
	text_copy(j->name, sizeof j->name, e->name);
	j->priority = e->priority;
	j->is_mixed = e->is_mixed;
	j->verify_fraction = e->verify_fraction;
	j->plan = *e->plan;
	j->submitted_at = now;
	j->started_at = j->ended_at = j->rel_error = j->first_round_at = j->held_since = NAN;
	for (int i = 0; i < 2; i++) {
		list_init(&j->ready_slots[i]);
		list_init(&j->leased_slots[i]);
		list_init(&j->awaiting_second_answer[i]);
	}
	list_init(&j->blocked_slots);
	for (uint32_t i = 0; i < j->slot_count; i++)
		list_init(&j->slots[i].link);
	begin_lease_kind(j, LEASE_BOOTSTRAP, 1, now);
}

struct job *job_new(struct farm *f, const struct event_submit *e, const char **refusal)
{
	uint64_t slots = (uint64_t)e->plan->groups * e->plan->parts;
	if (slots == 0 || slots > f->config.max_job_slots) {
		*refusal = "the plan has more leases in a round than the coordinator takes";
		return NULL;
	}
	struct job *j = mem_alloc(1, sizeof *j);
	if (j)
		j->slots = mem_alloc(slots, sizeof *j->slots);
	bool verified = e->verify_fraction > 0 && !e->is_mixed;
	if (j && j->slots && verified)
		j->proofs = mem_alloc(slots, sizeof *j->proofs);
	if (j && j->slots && (j->proofs || !verified))
		j->owner = owner_acquire(&f->owners, e->owner ? e->owner : "");
	if (!j || !j->owner) {
		job_free(j);
		*refusal = "the coordinator has no memory for another job";
		return NULL;
	}
	j->slot_count = (uint32_t)slots;
	j->verify_seed = f->config.verify_seed;
	init_job(j, e, f->now);
	return j;
}

void job_free(struct job *j)
{
	if (!j)
		return;
	owner_release(j->owner);
	mem_free(j->slots);
	mem_free(j->proofs);
	mem_free(j);
}

bool job_is_live(const struct job *j)
{
	return !job_state_is_end(j->state);
}

bool job_is_schedulable(const struct job *j)
{
	return job_is_live(j) && !j->is_preparing && j->pending_end == END_NONE && !job_is_held(j);
}

bool job_has_answers(const struct job *j)
{
	return j->bootstrap_merged + j->leases_merged + j->noted_slot_count > 0;
}

bool job_is_held(const struct job *j)
{
	for (int i = 0; i < JOB_HOLD_COUNT; i++)
		if (*j->hold_reasons[i])
			return true;
	return false;
}

double job_elapsed(const struct job *j, double now)
{
	return (isnan(j->held_since) ? now : j->held_since) - j->started_at;
}

struct slot *job_get_slot(const struct job *j, uint32_t group, uint32_t part)
{
	return &j->slots[(size_t)group * j->plan.parts + part];
}

struct slot *job_find_ready_slot(const struct job *j)
{
	for (int i = 0; i < 2; i++)
		if (!list_is_empty(&j->ready_slots[i]))
			return list_entry(j->ready_slots[i].next, struct slot, link);
	return NULL;
}

void job_place_slot(struct job *j, struct slot *s)
{
	list_remove(&s->link);
	if (s->next_epoch >= j->round_limit || s->holder_count > 1)
		return;
	uint64_t ahead = s->next_epoch - j->rounds;
	if (ahead > 1)
		list_append(&j->blocked_slots, &s->link);
	else if (s->holder_count >= proof_max_holders(j, s))
		list_append(&j->leased_slots[ahead], &s->link);
	else
		list_append(proof_is_pending(j, s) || doubt_is_pending(s) ? &j->awaiting_second_answer[ahead]
									  : &j->ready_slots[ahead],
			    &s->link);
}

double job_lease_timeout(const struct farm_config *c, const struct job *j, const struct slot *s)
{
	double t = isnan(j->median_duration) ? c->default_lease_timeout
					     : fmax(c->min_lease_timeout, TIMEOUT_MEDIANS * j->median_duration);
	return ldexp(t, s->timeout_count < TIMEOUT_DOUBLINGS ? (int)s->timeout_count : TIMEOUT_DOUBLINGS);
}

double job_copy_timeout(const struct farm_config *c, const struct slot *s)
{
	return ldexp(c->copy_timeout, s->timeout_count < TIMEOUT_DOUBLINGS ? (int)s->timeout_count : TIMEOUT_DOUBLINGS);
}

double job_copy_due_time(const struct farm_config *c, const struct job *j, const struct slot *s)
{
	return s->last_holder_sent_at +
	       (isnan(j->median_duration) ? c->default_copy_delay : straggler_medians * j->median_duration);
}

static double lease_work(const struct job *j)
{
	uint64_t n = j->kind == LEASE_BOOTSTRAP ? j->plan.bootstrap : plan_round_mutations(&j->plan);
	return (double)n / j->slot_count;
}

static void add_duration(struct job *j, double duration)
{
	j->durations[j->duration_count++ % JOB_DURATION_WINDOW] = duration;
	uint32_t n = j->duration_count < JOB_DURATION_WINDOW ? j->duration_count : JOB_DURATION_WINDOW;
	double sorted[JOB_DURATION_WINDOW] = {0};
	for (uint32_t i = 0; i < n; i++) {
		uint32_t k = i;
		for (; k > 0 && sorted[k - 1] > j->durations[i]; k--)
			sorted[k] = sorted[k - 1];
		sorted[k] = j->durations[i];
	}
	j->median_duration = sorted[n / 2];
}

void job_place_all_slots(struct job *j)
{
	j->done_slot_count = j->ahead_slot_count = 0;
	j->has_far_ahead_slot = false;
	for (uint32_t i = 0; i < j->slot_count; i++) {
		uint64_t merged = j->slots[i].next_epoch - j->rounds;
		j->done_slot_count += merged > 0;
		j->ahead_slot_count += merged > 1;
		j->has_far_ahead_slot = j->has_far_ahead_slot || merged > 2;
		job_place_slot(j, &j->slots[i]);
	}
}

bool job_merge_epoch(struct job *j, struct slot *s, double now, double duration)
{
	assert(!s->leases && s->next_epoch - j->rounds <= 1);
	if (s->next_epoch++ == j->rounds)
		j->done_slot_count++;
	else
		j->ahead_slot_count++;
	s->timeout_count = 0;
	s->failure_quorum.count = 0;
	s->lost_holders.count = 0;
	if (j->kind == LEASE_BOOTSTRAP)
		j->bootstrap_merged++;
	else
		j->leases_merged++;
	if (!isnan(duration))
		add_duration(j, duration);
	rate_add(&j->rate, now, lease_work(j));
	bool complete = j->done_slot_count == j->slot_count;
	if (complete && j->has_far_ahead_slot) {
		j->rounds++;
		job_place_all_slots(j);
	} else if (complete) {
		j->rounds++;
		j->done_slot_count = j->ahead_slot_count;
		j->ahead_slot_count = 0;
		list_remove(&s->link);
		assert(list_is_empty(&j->ready_slots[0]) && list_is_empty(&j->leased_slots[0]) &&
		       list_is_empty(&j->awaiting_second_answer[0]));
		list_join(&j->ready_slots[0], &j->ready_slots[1]);
		list_join(&j->leased_slots[0], &j->leased_slots[1]);
		list_join(&j->awaiting_second_answer[0], &j->awaiting_second_answer[1]);
		list_join(&j->ready_slots[1], &j->blocked_slots);
	}
	job_place_slot(j, s);
	return complete;
}

void job_raise_round_limit(struct job *j)
{
	uint64_t old_limit = j->round_limit;
	j->round_limit = j->plan.rounds;
	for (uint32_t i = 0; i < j->slot_count; i++)
		if (j->slots[i].next_epoch >= old_limit)
			job_place_slot(j, &j->slots[i]);
}

void job_open_rounds(struct job *j, double now)
{
	j->first_round_at = now;
	begin_lease_kind(j, LEASE_RENDER, j->plan.rounds, now);
}

void job_restore(struct job *j, enum lease_kind kind, const uint64_t *next_epochs, double now)
{
	uint64_t rounds = UINT64_MAX, merged = 0;
	if (kind == LEASE_RENDER) {
		j->bootstrap_merged = j->slot_count;
		job_open_rounds(j, now);
	}
	for (uint32_t i = 0; i < j->slot_count; i++)
		rounds = next_epochs[i] < rounds ? next_epochs[i] : rounds;
	j->rounds = rounds;
	for (uint32_t i = 0; i < j->slot_count; i++) {
		assert(next_epochs[i] <= j->round_limit);
		j->slots[i].next_epoch = next_epochs[i];
		merged += next_epochs[i];
	}
	job_place_all_slots(j);
	if (kind == LEASE_RENDER)
		j->leases_merged = merged;
	else
		j->bootstrap_merged = merged;
}

void job_pin(struct job *j, struct peer_class *c)
{
	if (j->class)
		return;
	j->class = c;
	c->reference_count++;
	memcpy(j->fingerprint, c->fingerprint, sizeof j->fingerprint);
}

void job_unpin_if_untouched(struct job *j)
{
	if (!j->class || j->outstanding_lease_count || j->noted_slot_count || j->bootstrap_merged || j->leases_merged)
		return;
	peer_class_release(j->class);
	j->class = NULL;
	j->fingerprint[0] = 0;
}

bool job_accepts_class(const struct job *j, const struct peer_class *c)
{
	return j->is_mixed || !j->class || j->class == c;
}
