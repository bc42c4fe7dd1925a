/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job of the core: its slots, the lists they are in, and the progress of rounds.
 *
 * A slot is in one list, depending on its next epoch (the first incomplete round, the one after it, or blocked behind
 * both) and on its holders: ready (nobody holds its lease), out (one worker does), or second (it waits for another
 * worker's answer). With two holders it is in no list. job_place moves it after each change. When all slots have
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

static void begin_kind(struct job *j, enum lease_kind kind, uint64_t limit, double now)
{
	j->kind = kind;
	j->limit = limit;
	j->rounds = 0;
	j->done = j->ahead = 0;
	j->spread = false;
	j->duration_count = 0;
	j->median = NAN;
	rate_init(&j->rate, now);
	for (uint32_t i = 0; i < j->slot_count; i++) {
		struct slot *s = &j->slots[i];
		assert(!s->leases);
		s->next = 0;
		s->doubt = (struct doubt){0};
		job_place(j, s);
	}
}

static void init(struct job *j, const struct event_submit *e, double now)
{
	text_copy(j->name, sizeof j->name, e->name);
	j->priority = e->priority;
	j->mixed = e->mixed;
	j->verify = e->verify;
	j->plan = *e->plan;
	j->submitted = now;
	j->started = j->ended = j->rel_error = j->opened = j->held_since = NAN;
	for (int i = 0; i < 2; i++) {
		list_init(&j->ready[i]);
		list_init(&j->out[i]);
		list_init(&j->second[i]);
	}
	list_init(&j->blocked);
	for (uint32_t i = 0; i < j->slot_count; i++)
		list_init(&j->slots[i].link);
	begin_kind(j, LEASE_BOOTSTRAP, 1, now);
}

struct job *job_new(struct farm *f, const struct event_submit *e, const char **refused)
{
	uint64_t slots = (uint64_t)e->plan->groups * e->plan->parts;
	if (slots == 0 || slots > f->config.max_slots) {
		*refused = "the plan has more leases in a round than the coordinator takes";
		return NULL;
	}
	struct job *j = mem_alloc(1, sizeof *j);
	if (j)
		j->slots = mem_alloc(slots, sizeof *j->slots);
	bool verified = e->verify > 0 && !e->mixed;
	if (j && j->slots && verified)
		j->proofs = mem_alloc(slots, sizeof *j->proofs);
	if (j && j->slots && (j->proofs || !verified))
		j->owner = owner_use(&f->owners, e->owner ? e->owner : "");
	if (!j || !j->owner) {
		job_free(j);
		*refused = "the coordinator has no memory for another job";
		return NULL;
	}
	j->slot_count = (uint32_t)slots;
	j->verify_seed = f->config.verify_seed;
	init(j, e, f->now);
	return j;
}

void job_free(struct job *j)
{
	if (!j)
		return;
	owner_drop(j->owner);
	mem_free(j->slots);
	mem_free(j->proofs);
	mem_free(j);
}

bool job_is_live(const struct job *j)
{
	return !job_state_is_end(j->state);
}

bool job_is_open(const struct job *j)
{
	return job_is_live(j) && !j->preparing && j->ending == END_NONE && !job_is_held(j);
}

bool job_is_proven(const struct job *j)
{
	return j->bootstrap_merged + j->leases_merged + j->noted > 0;
}

bool job_is_held(const struct job *j)
{
	for (int i = 0; i < JOB_HOLDS; i++)
		if (*j->held[i])
			return true;
	return false;
}

double job_elapsed(const struct job *j, double now)
{
	return (isnan(j->held_since) ? now : j->held_since) - j->started;
}

struct slot *job_slot(const struct job *j, uint32_t group, uint32_t part)
{
	return &j->slots[(size_t)group * j->plan.parts + part];
}

struct slot *job_ready(const struct job *j)
{
	for (int i = 0; i < 2; i++)
		if (!list_is_empty(&j->ready[i]))
			return list_entry(j->ready[i].next, struct slot, link);
	return NULL;
}

void job_place(struct job *j, struct slot *s)
{
	list_remove(&s->link);
	if (s->next >= j->limit || s->holders > 1)
		return;
	uint64_t ahead = s->next - j->rounds;
	if (ahead > 1)
		list_append(&j->blocked, &s->link);
	else if (s->holders >= proof_copies(j, s))
		list_append(&j->out[ahead], &s->link);
	else
		list_append(proof_waits(j, s) || doubt_waits(s) ? &j->second[ahead] : &j->ready[ahead], &s->link);
}

double job_lease_timeout(const struct farm_config *c, const struct job *j, const struct slot *s)
{
	double t = isnan(j->median) ? c->first_timeout : fmax(c->min_timeout, TIMEOUT_MEDIANS * j->median);
	return ldexp(t, s->timeouts < TIMEOUT_DOUBLINGS ? (int)s->timeouts : TIMEOUT_DOUBLINGS);
}

double job_idle_timeout(const struct farm_config *c, const struct slot *s)
{
	return ldexp(c->idle_timeout, s->timeouts < TIMEOUT_DOUBLINGS ? (int)s->timeouts : TIMEOUT_DOUBLINGS);
}

double job_straggles_at(const struct farm_config *c, const struct job *j, const struct slot *s)
{
	return s->since + (isnan(j->median) ? c->first_copy : straggler_medians * j->median);
}

static double job_lease_mutations(const struct job *j)
{
	uint64_t n = j->kind == LEASE_BOOTSTRAP ? j->plan.bootstrap : plan_round_mutations(&j->plan);
	return (double)n / j->slot_count;
}

static void add_duration(struct job *j, double duration)
{
	j->durations[j->duration_count++ % JOB_DURATIONS] = duration;
	uint32_t n = j->duration_count < JOB_DURATIONS ? j->duration_count : JOB_DURATIONS;
	double sorted[JOB_DURATIONS] = {0};
	for (uint32_t i = 0; i < n; i++) {
		uint32_t k = i;
		for (; k > 0 && sorted[k - 1] > j->durations[i]; k--)
			sorted[k] = sorted[k - 1];
		sorted[k] = j->durations[i];
	}
	j->median = sorted[n / 2];
}

void job_place_all(struct job *j)
{
	j->done = j->ahead = 0;
	j->spread = false;
	for (uint32_t i = 0; i < j->slot_count; i++) {
		uint64_t merged = j->slots[i].next - j->rounds;
		j->done += merged > 0;
		j->ahead += merged > 1;
		j->spread = j->spread || merged > 2;
		job_place(j, &j->slots[i]);
	}
}

bool job_merge(struct job *j, struct slot *s, double now, double duration)
{
	assert(!s->leases && s->next - j->rounds <= 1);
	if (s->next++ == j->rounds)
		j->done++;
	else
		j->ahead++;
	s->timeouts = 0;
	s->failure_quorum.count = 0;
	s->lost.count = 0;
	if (j->kind == LEASE_BOOTSTRAP)
		j->bootstrap_merged++;
	else
		j->leases_merged++;
	if (!isnan(duration))
		add_duration(j, duration);
	rate_add(&j->rate, now, job_lease_mutations(j));
	bool complete = j->done == j->slot_count;
	if (complete && j->spread) {
		j->rounds++;
		job_place_all(j);
	} else if (complete) {
		j->rounds++;
		j->done = j->ahead;
		j->ahead = 0;
		list_remove(&s->link);
		assert(list_is_empty(&j->ready[0]) && list_is_empty(&j->out[0]) && list_is_empty(&j->second[0]));
		list_join(&j->ready[0], &j->ready[1]);
		list_join(&j->out[0], &j->out[1]);
		list_join(&j->second[0], &j->second[1]);
		list_join(&j->ready[1], &j->blocked);
	}
	job_place(j, s);
	return complete;
}

void job_raise_limit(struct job *j)
{
	uint64_t before = j->limit;
	j->limit = j->plan.rounds;
	for (uint32_t i = 0; i < j->slot_count; i++)
		if (j->slots[i].next >= before)
			job_place(j, &j->slots[i]);
}

void job_open_rounds(struct job *j, double now)
{
	j->opened = now;
	begin_kind(j, LEASE_RENDER, j->plan.rounds, now);
}

void job_restore(struct job *j, enum lease_kind kind, const uint64_t *next, double now)
{
	uint64_t rounds = UINT64_MAX, merged = 0;
	if (kind == LEASE_RENDER) {
		j->bootstrap_merged = j->slot_count;
		job_open_rounds(j, now);
	}
	for (uint32_t i = 0; i < j->slot_count; i++)
		rounds = next[i] < rounds ? next[i] : rounds;
	j->rounds = rounds;
	for (uint32_t i = 0; i < j->slot_count; i++) {
		assert(next[i] <= j->limit);
		j->slots[i].next = next[i];
		merged += next[i];
	}
	job_place_all(j);
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
	c->uses++;
	memcpy(j->fingerprint, c->fingerprint, sizeof j->fingerprint);
}

void job_unpin_if_untouched(struct job *j)
{
	if (!j->class || j->leases_out || j->noted || j->bootstrap_merged || j->leases_merged)
		return;
	peer_class_drop(j->class);
	j->class = NULL;
	j->fingerprint[0] = 0;
}

bool job_takes(const struct job *j, const struct peer_class *c)
{
	return j->mixed || !j->class || j->class == c;
}
