/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/failure_quorum.h"

#include "coordinator/core/state.h"

static uint32_t count_certificates(const struct failure_quorum *l)
{
	uint32_t n = 0;
	for (uint32_t i = 0; i < l->count; i++) {
		uint32_t k = 0;
		while (l->workers[k].certificate_id != l->workers[i].certificate_id)
			k++;
		n += k == i;
	}
	return n;
}

static void add_worker(struct failure_quorum *l, const struct identity *identity)
{
	uint32_t position = l->count;
	for (uint32_t i = 0; i < l->count; i++) {
		if (l->workers[i].identity_id == identity->id)
			return;
		for (uint32_t k = 0; k < i && position == FAILURE_QUORUM_SIZE; k++)
			if (l->workers[k].certificate_id == l->workers[i].certificate_id)
				position = i; /* replaces one of several entries with the same certificate */
	}
	if (position == FAILURE_QUORUM_SIZE)
		return;
	l->count += position == l->count;
	l->workers[position].identity_id = identity->id;
	l->workers[position].certificate_id = identity->certificate_id;
}

/* Counts only as far as FAILURE_QUORUM_SIZE, since more makes no difference. */
uint32_t failure_quorum_size_required(const struct farm *f)
{
	struct failure_quorum all_workers = {.count = 0};
	for (uint32_t i = 0; i < f->registry_count && count_certificates(&all_workers) < FAILURE_QUORUM_SIZE; i++)
		if (!f->registry[i]->is_quarantined)
			add_worker(&all_workers, f->registry[i]);
	return count_certificates(&all_workers);
}

bool failure_quorum_add(struct failure_quorum *l, const struct farm *f, const struct identity *identity)
{
	add_worker(l, identity);
	return l->count == FAILURE_QUORUM_SIZE && count_certificates(l) >= failure_quorum_size_required(f);
}
