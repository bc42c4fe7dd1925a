/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/proof.h"

#include "common/base/text.h"

#include <string.h>

static uint64_t mix(uint64_t x)
{
	x += UINT64_C(0x9e3779b97f4a7c15);
	x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
	x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
	return x ^ (x >> 31);
}

bool proof_chosen(const struct job *j, const struct lease_key *k)
{
	if (!j->proofs)
		return false;
	uint64_t h = mix(j->verify_seed ^ mix(j->id));
	h = mix(h ^ (uint64_t)k->kind << 56 ^ (uint64_t)k->group << 28 ^ k->part);
	h = mix(h ^ k->epoch);
	return (double)(h >> 11) * 0x1p-53 < j->verify;
}

struct proof *proof_of(const struct job *j, const struct slot *s)
{
	return &j->proofs[s - j->slots];
}

static bool is_verified(const struct job *j, const struct slot *s)
{
	const struct lease_key k = slot_key(j, s);
	return proof_chosen(j, &k);
}

uint32_t proof_copies(const struct job *j, const struct slot *s)
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

bool proof_bars(const struct job *j, const struct slot *s, const struct peer *p)
{
	if (!is_verified(j, s))
		return false;
	for (const struct lease *l = s->leases; l; l = l->next)
		if (!l->overdue && l->peer != p && l->peer->who == p->who)
			return true;
	return has_answered(proof_of(j, s), p->who);
}

bool proof_waits(const struct job *j, const struct slot *s)
{
	return is_verified(j, s) && s->holders + proof_of(j, s)->count > 0;
}

enum verify_answer proof_take(struct job *j, struct slot *s, struct identity *who, const struct batch_digest *d)
{
	struct proof *p = proof_of(j, s);
	bool agrees = false;
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

void proof_names(const struct job *j, const struct slot *s, char *text, size_t size)
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
