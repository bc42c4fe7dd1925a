/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/verify.h"

#include "common/base/text.h"
#include "coordinator/core/job.h"
#include "coordinator/core/lease.h"

#include <stdio.h>

void verify_forget_slot(struct farm *f, struct job *j, const struct slot *s)
{
	struct proof *p = proof_for_slot(j, s);
	j->noted_slot_count -= p->count > 0;
	for (uint32_t i = 0; i < p->count; i++)
		worker_registry_release(f, p->workers[i]);
	p->count = 0;
}

void verify_forget_job(struct farm *f, struct job *j)
{
	for (uint32_t i = 0; j->proofs && i < j->slot_count; i++)
		verify_forget_slot(f, j, &j->slots[i]);
}

static void forget_answers(struct farm *f, struct job *j, const struct identity *identity)
{
	for (uint32_t i = 0; i < j->slot_count; i++) {
		struct proof *p = &j->proofs[i];
		for (uint32_t k = 0; k < p->count; k++) {
			if (p->workers[k] != identity)
				continue;
			worker_registry_release(f, p->workers[k]);
			p->count--;
			p->workers[k] = p->workers[p->count];
			p->digests[k] = p->digests[p->count];
			j->noted_slot_count -= p->count == 0;
			job_place_slot(j, &j->slots[i]);
			break;
		}
	}
}

void verify_forget_worker(struct farm *f, const struct identity *identity)
{
	for (uint32_t i = 0; i < f->live_job_count; i++)
		if (f->live_jobs[i]->noted_slot_count)
			forget_answers(f, f->live_jobs[i], identity);
}

/* Whether a class other than `excluded` has more than this many active workers. */
static bool has_larger_class(const struct farm *f, const struct peer_class *excluded, uint32_t active_count)
{
	for (struct link *k = f->classes.next; k != &f->classes; k = k->next) {
		const struct peer_class *c = list_entry(k, struct peer_class, link);
		if (c != excluded && c->active_peer_count > active_count)
			return true;
	}
	return false;
}

void verify_unpin_stranded_jobs(struct farm *f)
{
	for (uint32_t i = 0; i < f->live_job_count; i++) {
		struct job *j = f->live_jobs[i];
		if (!j->noted_slot_count || j->outstanding_lease_count || j->bootstrap_merged || j->leases_merged ||
		    !j->class)
			continue;
		if (j->class->active_peer_count > 1 || !has_larger_class(f, j->class, j->class->active_peer_count))
			continue;
		verify_forget_job(f, j);
		for (uint32_t s = 0; s < j->slot_count; s++)
			job_place_slot(j, &j->slots[s]);
		job_unpin_if_untouched(j);
	}
}

bool verify_class_can_begin(const struct farm *f, const struct job *j, const struct peer_class *c)
{
	return !j->proofs || c->active_peer_count > 1 || !has_larger_class(f, c, 1);
}

/* Returns the first slot in need of another worker whose lease no connected worker may get; NULL: none. */
static const struct slot *find_stranded_slot(const struct farm *f, const struct job *j)
{
	for (int i = 0; i < 2; i++) {
		for (struct link *k = j->awaiting_second_answer[i].next; k != &j->awaiting_second_answer[i];
		     k = k->next) {
			const struct slot *s = list_entry(k, struct slot, link);
			bool has_candidate = false;
			for (uint32_t n = 0; n < f->peer_count && !has_candidate; n++) {
				const struct peer *p = f->peers[n];
				has_candidate = p->state == PEER_ACTIVE && job_accepts_class(j, p->class) &&
						!lease_find(s, p) && !proof_bars_worker(j, s, p);
			}
			if (!has_candidate)
				return s;
		}
	}
	return NULL;
}

bool verify_describe_wait(const struct farm *f, const struct job *j, char *text, size_t size)
{
	const struct slot *s = j->proofs ? find_stranded_slot(f, j) : NULL;
	if (!s)
		return false;
	const struct lease_key k = slot_lease_key(j, s);
	char names[160];
	proof_format_names(j, s, names, sizeof names);
	if (proof_for_slot(j, s)->count < 2)
		snprintf(text, size, "verification waits for a second worker (%u leases have one answer)",
			 j->noted_slot_count);
	else
		text_print(text, size, "verification waits for another worker: %s differ on " LEASE_POSITION_FORMAT,
			   names, LEASE_POSITION_VALUES(&k));
	return true;
}
