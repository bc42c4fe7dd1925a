/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/failure_quorum.h"

#include "coordinator/core/state.h"

static uint32_t certificates(const struct failure_quorum *l)
{
	uint32_t n = 0;
	for (uint32_t i = 0; i < l->count; i++) {
		uint32_t k = 0;
		while (l->of[k].certificate != l->of[i].certificate)
			k++;
		n += k == i;
	}
	return n;
}

static void add_worker(struct failure_quorum *l, const struct identity *who)
{
	uint32_t place = l->count;
	for (uint32_t i = 0; i < l->count; i++) {
		if (l->of[i].who == who->id)
			return;
		for (uint32_t k = 0; k < i && place == FAILURE_QUORUM_FATAL; k++)
			if (l->of[k].certificate == l->of[i].certificate)
				place = i; /* replaces one of several entries with the same certificate */
	}
	if (place == FAILURE_QUORUM_FATAL)
		return;
	l->count += place == l->count;
	l->of[place].who = who->id;
	l->of[place].certificate = who->certificate_id;
}

/* Counts only as far as FAILURE_QUORUM_FATAL, since more makes no difference. */
uint32_t failure_quorum_certificates(const struct farm *f)
{
	struct failure_quorum known = {.count = 0};
	for (uint32_t i = 0; i < f->known_count && certificates(&known) < FAILURE_QUORUM_FATAL; i++)
		if (!f->known[i]->quarantined)
			add_worker(&known, f->known[i]);
	return certificates(&known);
}

bool failure_quorum_add(struct failure_quorum *l, const struct farm *f, const struct identity *who)
{
	add_worker(l, who);
	return l->count == FAILURE_QUORUM_FATAL && certificates(l) >= failure_quorum_certificates(f);
}
