/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/proof.h"

#include "common/base/text.h"

#include <string.h>

static uint64_t splitmix64(uint64_t x)
{
	x += UINT64_C(0x9e3779b97f4a7c15);
	x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
	x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
	return x ^ (x >> 31);
}

bool proof_is_required(const struct job *j, const struct lease_key *k)
{
	if (!j->proofs)
		return false;
	uint64_t h = splitmix64(j->verify_seed ^ splitmix64(j->id));
	h = splitmix64(h ^ (uint64_t)k->kind << 56 ^ (uint64_t)k->group << 28 ^ k->part);
	h = splitmix64(h ^ k->epoch);
	return (double)(h >> 11) * 0x1p-53 < j->verify_fraction;
}

struct proof *proof_for_slot(const struct job *j, const struct slot *s)
{
	return &j->proofs[s - j->slots];
}

static bool is_verified(const struct job *j, const struct slot *s)
{
	const struct lease_key k = slot_lease_key(j, s);
	return proof_is_required(j, &k);
}

uint32_t proof_max_holders(const struct job *j, const struct slot *s)
{
	return is_verified(j, s) && proof_for_slot(j, s)->count == 0 ? 2 : 1;
}

static bool has_answered(const struct proof *p, const struct identity *identity)
{
	for (uint32_t i = 0; i < p->count; i++)
		if (p->workers[i] == identity)
			return true;
	return false;
}

bool proof_bars_worker(const struct job *j, const struct slot *s, const struct peer *p)
{
	if (!is_verified(j, s))
		return false;
	for (const struct lease *l = s->leases; l; l = l->next)
		if (!l->is_overdue && l->peer != p && l->peer->identity == p->identity)
			return true;
	return has_answered(proof_for_slot(j, s), p->identity);
}

bool proof_is_pending(const struct job *j, const struct slot *s)
{
	return is_verified(j, s) && s->holder_count + proof_for_slot(j, s)->count > 0;
}

enum verify_outcome proof_add_answer(struct job *j, struct slot *s, struct identity *identity,
				     const struct batch_digest *d)
{
	struct proof *p = proof_for_slot(j, s);
	bool agrees = false;
	for (uint32_t i = 0; i < p->count; i++) {
		bool equal = memcmp(&p->digests[i], d, sizeof *d) == 0;
		if (p->workers[i] == identity)
			return equal ? VERIFY_REPEATED : VERIFY_CONTRADICTS;
		agrees = agrees || equal;
	}
	if (agrees)
		return VERIFY_AGREES;
	j->noted_slot_count += p->count == 0;
	j->counts.mismatched += p->count == 1;
	p->workers[p->count] = identity;
	p->digests[p->count] = *d;
	p->count++;
	identity->reference_count++;
	return p->count == VERIFY_ANSWERS_MAX ? VERIFY_HOPELESS : p->count > 1 ? VERIFY_DIFFERS : VERIFY_NOTED;
}

void proof_format_names(const struct job *j, const struct slot *s, char *text, size_t size)
{
	const struct proof *p = proof_for_slot(j, s);
	struct text t = {text, size};
	text[0] = 0;
	for (uint32_t i = 0; i < p->count; i++) {
		char name[40];
		text_copy(name, sizeof name, p->workers[i]->name);
		text_appendf(&t, "%s%s", i ? ", " : "", name);
	}
}
