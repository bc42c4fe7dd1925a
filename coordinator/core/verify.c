/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/verify.h"

#include "common/base/text.h"
#include "coordinator/core/state.h"

#include <stdio.h>
#include <string.h>

static uint64_t mix(uint64_t x)
{
	x += UINT64_C(0x9e3779b97f4a7c15);
	x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
	x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
	return x ^ (x >> 31);
}

bool verify_chosen(const struct job *j, const struct lease_key *k)
{
	if (!j->proofs)
		return false;
	uint64_t h = mix(j->verify_seed ^ mix(j->id));
	h = mix(h ^ (uint64_t)k->kind << 56 ^ (uint64_t)k->group << 28 ^ k->part);
	h = mix(h ^ k->epoch);
	return (double)(h >> 11) * 0x1p-53 < j->verify;
}

static struct lease_key key_of(const struct job *j, const struct slot *s)
{
	uint32_t index = (uint32_t)(s - j->slots);
	return (struct lease_key){.job = j->id,
				  .kind = j->kind,
				  .group = index / j->plan.parts,
				  .part = index % j->plan.parts,
				  .epoch = s->next};
}

static struct proof *proof_of(const struct job *j, const struct slot *s)
{
	return &j->proofs[s - j->slots];
}

static bool is_verified(const struct job *j, const struct slot *s)
{
	const struct lease_key k = key_of(j, s);
	return verify_chosen(j, &k);
}

uint32_t verify_copies(const struct job *j, const struct slot *s)
{
	return is_verified(j, s) && proof_of(j, s)->count == 0 ? 2 : 1;
}

static bool has_answered(const struct proof *p, const struct identity *who)
{
	for (uint32_t i = 0; i < p->count; i++)
		if (p->who[i] == who)
			return true;
	return false;
}

bool verify_bars(const struct job *j, const struct slot *s, const struct peer *p)
{
	if (!is_verified(j, s))
		return false;
	for (const struct lease *l = s->leases; l; l = l->next)
		if (!l->overdue && l->peer != p && l->peer->who == p->who)
			return true;
	return has_answered(proof_of(j, s), p->who);
}

bool verify_waits(const struct job *j, const struct slot *s)
{
	return is_verified(j, s) && s->holders + proof_of(j, s)->count > 0;
}

enum verify_answer verify_take(struct farm *f, struct job *j, struct slot *s, struct identity *who,
			       const struct batch_digest *d)
{
	struct proof *p = proof_of(j, s);
	bool agrees = false;
	(void)f;
	for (uint32_t i = 0; i < p->count; i++) {
		bool equal = memcmp(&p->digest[i], d, sizeof *d) == 0;
		if (p->who[i] == who)
			return equal ? VERIFY_REPEATED : VERIFY_CONTRADICTS;
		agrees = agrees || equal;
	}
	if (agrees)
		return VERIFY_AGREES;
	j->noted += p->count == 0;
	j->counts.mismatched += p->count == 1;
	p->who[p->count] = who;
	p->digest[p->count] = *d;
	p->count++;
	who->uses++;
	return p->count == VERIFY_MOST ? VERIFY_HOPELESS : p->count > 1 ? VERIFY_DIFFERS : VERIFY_NOTED;
}

static void forget(struct farm *f, struct job *j, struct proof *p)
{
	j->noted -= p->count > 0;
	for (uint32_t i = 0; i < p->count; i++)
		worker_registry_drop(f, p->who[i]);
	p->count = 0;
}

void verify_settle(struct farm *f, struct job *j, struct slot *s, const struct batch_digest *right)
{
	struct proof *p = proof_of(j, s);
	const struct proof said = *p;
	const struct lease_key k = key_of(j, s);
	forget(f, j, p);
	for (uint32_t i = 0; i < said.count; i++)
		if (memcmp(&said.digest[i], right, sizeof *right) != 0)
			worker_registry_wrong(f, said.who[i], "wrong result", &k);
}

void verify_names(const struct job *j, const struct slot *s, char *text, size_t size)
{
	const struct proof *p = proof_of(j, s);
	struct text t = {text, size};
	text[0] = 0;
	for (uint32_t i = 0; i < p->count; i++) {
		char name[40];
		text_copy(name, sizeof name, p->who[i]->name);
		text_put(&t, "%s%s", i ? ", " : "", name);
	}
}

void verify_forget_job(struct farm *f, struct job *j)
{
	for (uint32_t i = 0; j->proofs && i < j->slot_count; i++)
		forget(f, j, &j->proofs[i]);
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

/* Another class has more than so many. */
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

/* The first lease that no worker here may have. */
static const struct slot *stranded(const struct farm *f, const struct job *j)
{
	for (int i = 0; i < 2; i++) {
		for (struct link *k = j->second[i].next; k != &j->second[i]; k = k->next) {
			const struct slot *s = list_entry(k, struct slot, link);
			bool somebody = false;
			for (uint32_t n = 0; n < f->peer_count && !somebody; n++) {
				const struct peer *p = f->peers[n];
				somebody = p->state == PEER_ACTIVE && job_takes(j, p) && !lease_of(s, p) &&
					   !verify_bars(j, s, p);
			}
			if (!somebody)
				return s;
		}
	}
	return NULL;
}

bool verify_why(const struct farm *f, const struct job *j, char *text, size_t size)
{
	const struct slot *s = j->proofs ? stranded(f, j) : NULL;
	if (!s)
		return false;
	const struct lease_key k = key_of(j, s);
	char names[160];
	verify_names(j, s, names, sizeof names);
	if (proof_of(j, s)->count < 2)
		snprintf(text, size, "verification waits for a second worker (%u leases have one answer)", j->noted);
	else
		text_print(text, size,
			   "verification waits for another worker: %s differ on group %u part %u epoch %llu", names,
			   k.group, k.part, (unsigned long long)k.epoch);
	return true;
}
