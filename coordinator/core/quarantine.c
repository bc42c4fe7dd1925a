/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/quarantine.h"

#include "common/base/text.h"
#include "coordinator/core/connection.h"
#include "coordinator/core/verify.h"

#include <stdio.h>
#include <string.h>

/* Quarantines a worker permanently: it gets no leases, and nothing that it sends counts. */
static void quarantine_worker(struct farm *f, struct identity *identity)
{
	if (identity->is_quarantined)
		return;
	worker_registry_quarantine(f, identity);
	struct action *a = update_add(f, ACTION_QUARANTINE);
	a->worker_id = identity->id;
	a->text = identity->last_fault;
	for (uint32_t i = 0; i < f->peer_count; i++) {
		struct peer *p = f->peers[i];
		if (p->identity != identity)
			continue;
		peer_set_state(f, p, PEER_QUARANTINED);
		connection_drop_leases(f, p, true);
	}
	verify_forget_worker(f, identity);
}

void quarantine_note_wrong_result(struct farm *f, struct identity *identity, const char *description,
				  const struct lease_key *k)
{
	snprintf(identity->last_fault, sizeof identity->last_fault, "%s: j%llu %s " LEASE_POSITION_FORMAT, description,
		 (unsigned long long)k->job, LEASE_VALUES(k));
	identity->wrong_results++;
	struct action *a = update_add(f, ACTION_WRONG_RESULT);
	a->worker_id = identity->id;
	a->job = k->job;
	a->key = *k;
	a->text = identity->last_fault;
	for (uint32_t i = 0; i < f->peer_count; i++) {
		struct peer *p = f->peers[i];
		if (p->identity != identity)
			continue;
		p->faults++;
		memcpy(p->last_fault, identity->last_fault, sizeof p->last_fault);
	}
	if (identity->wrong_results >= f->config.max_faults)
		quarantine_worker(f, identity);
}

void quarantine_note_fault(struct farm *f, struct peer *p, const char *text)
{
	p->faults++;
	p->identity->consecutive_faults++;
	text_copy(p->last_fault, sizeof p->last_fault, text);
	memcpy(p->identity->last_fault, p->last_fault, sizeof p->last_fault);
	if (p->identity->consecutive_faults >= f->config.max_faults)
		quarantine_worker(f, p->identity);
}

void quarantine_judge_answers(struct farm *f, struct job *j, struct slot *s, const struct batch_digest *correct)
{
	struct proof *p = proof_for_slot(j, s);
	const struct proof answers = *p;
	const struct lease_key k = slot_lease_key(j, s);
	verify_forget_slot(f, j, s);
	for (uint32_t i = 0; i < answers.count; i++)
		if (memcmp(&answers.digests[i], correct, sizeof *correct) != 0)
			quarantine_note_wrong_result(f, answers.workers[i], "wrong result", &k);
}
