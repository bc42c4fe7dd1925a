/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/verify.h"

#include "common/base/text.h"
#include "coordinator/core/job.h"
#include "coordinator/core/lease.h"

#include <stdio.h>

void verify_forget(struct farm *f, struct job *j, const struct slot *s)
{
	struct proof *p = proof_of(j, s);
	j->noted -= p->count > 0;
	for (uint32_t i = 0; i < p->count; i++)
		worker_registry_drop(f, p->who[i]);
	p->count = 0;
}

void verify_forget_job(struct farm *f, struct job *j)
{
	for (uint32_t i = 0; j->proofs && i < j->slot_count; i++)
		verify_forget(f, j, &j->slots[i]);
}

static void forget_answers(struct farm *f, struct job *j, const struct identity *who)
{
	for (uint32_t i = 0; i < j->slot_count; i++) {
		struct proof *p = &j->proofs[i];
		for (uint32_t k = 0; k < p->count; k++) {
			if (p->who[k] != who)
				continue;
			worker_registry_drop(f, p->who[k]);
			p->count--;
			p->who[k] = p->who[p->count];
			p->digest[k] = p->digest[p->count];
			j->noted -= p->count == 0;
			job_place(j, &j->slots[i]);
			break;
		}
	}
}

void verify_forget_worker(struct farm *f, const struct identity *who)
{
	for (uint32_t i = 0; i < f->live_count; i++)
		if (f->live[i]->noted)
			forget_answers(f, f->live[i], who);
}

/* Whether a class other than `than` has more than this many active workers. */
static bool more_elsewhere(const struct farm *f, const struct peer_class *than, uint32_t workers)
{
	for (struct link *k = f->classes.next; k != &f->classes; k = k->next) {
		const struct peer_class *c = list_entry(k, struct peer_class, link);
		if (c != than && c->active > workers)
			return true;
	}
	return false;
}

void verify_change_class(struct farm *f)
{
	for (uint32_t i = 0; i < f->live_count; i++) {
		struct job *j = f->live[i];
		if (!j->noted || j->leases_out || j->bootstrap_merged || j->leases_merged || !j->class)
			continue;
		if (j->class->active > 1 || !more_elsewhere(f, j->class, j->class->active))
			continue;
		verify_forget_job(f, j);
		for (uint32_t s = 0; s < j->slot_count; s++)
			job_place(j, &j->slots[s]);
		job_unpin_if_untouched(j);
	}
}

bool verify_may_begin(const struct farm *f, const struct job *j, const struct peer_class *c)
{
	return !j->proofs || c->active > 1 || !more_elsewhere(f, c, 1);
}

/* Returns the first slot in need of another worker whose lease no connected worker may get; NULL: none. */
static const struct slot *find_stranded_slot(const struct farm *f, const struct job *j)
{
	for (int i = 0; i < 2; i++) {
		for (struct link *k = j->second[i].next; k != &j->second[i]; k = k->next) {
			const struct slot *s = list_entry(k, struct slot, link);
			bool somebody = false;
			for (uint32_t n = 0; n < f->peer_count && !somebody; n++) {
				const struct peer *p = f->peers[n];
				somebody = p->state == PEER_ACTIVE && job_takes(j, p->class) && !lease_of(s, p) &&
					   !proof_bars(j, s, p);
			}
			if (!somebody)
				return s;
		}
	}
	return NULL;
}

bool verify_why(const struct farm *f, const struct job *j, char *text, size_t size)
{
	const struct slot *s = j->proofs ? find_stranded_slot(f, j) : NULL;
	if (!s)
		return false;
	const struct lease_key k = slot_key(j, s);
	char names[160];
	proof_names(j, s, names, sizeof names);
	if (proof_of(j, s)->count < 2)
		snprintf(text, size, "verification waits for a second worker (%u leases have one answer)", j->noted);
	else
		text_print(text, size, "verification waits for another worker: %s differ on " LEASE_WORDS, names,
			   LEASE_PLACE(&k));
	return true;
}
