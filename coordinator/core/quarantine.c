/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/quarantine.h"

#include "common/base/text.h"
#include "coordinator/core/connection.h"
#include "coordinator/core/verify.h"

#include <stdio.h>
#include <string.h>

/* Quarantines a worker permanently: it gets no leases, and nothing that it sends counts. */
static void quarantine_worker(struct farm *f, struct identity *who)
{
	if (who->quarantined)
		return;
	worker_registry_quarantine(f, who);
	struct action *a = update_add(f, ACTION_QUARANTINE);
	a->who = who->id;
	a->text = who->text;
	for (uint32_t i = 0; i < f->peer_count; i++) {
		struct peer *p = f->peers[i];
		if (p->who != who)
			continue;
		peer_set_state(f, p, PEER_QUARANTINED);
		connection_drop_leases(f, p, true);
	}
	verify_forget_worker(f, who);
}

void quarantine_wrong(struct farm *f, struct identity *who, const char *what, const struct lease_key *k)
{
	snprintf(who->text, sizeof who->text, "%s: j%llu %s " LEASE_WORDS, what, (unsigned long long)k->job,
		 LEASE_VALUES(k));
	who->wrong++;
	struct action *a = update_add(f, ACTION_WRONG);
	a->who = who->id;
	a->job = k->job;
	a->key = *k;
	a->text = who->text;
	for (uint32_t i = 0; i < f->peer_count; i++) {
		struct peer *p = f->peers[i];
		if (p->who != who)
			continue;
		p->faults++;
		memcpy(p->text, who->text, sizeof p->text);
	}
	if (who->wrong >= f->config.max_faults)
		quarantine_worker(f, who);
}

void quarantine_fault(struct farm *f, struct peer *p, const char *text)
{
	p->faults++;
	p->who->faults_in_row++;
	text_copy(p->text, sizeof p->text, text);
	memcpy(p->who->text, p->text, sizeof p->text);
	if (p->who->faults_in_row >= f->config.max_faults)
		quarantine_worker(f, p->who);
}

void quarantine_settle(struct farm *f, struct job *j, struct slot *s, const struct batch_digest *right)
{
	struct proof *p = proof_of(j, s);
	const struct proof said = *p;
	const struct lease_key k = slot_key(j, s);
	verify_forget(f, j, s);
	for (uint32_t i = 0; i < said.count; i++)
		if (memcmp(&said.digest[i], right, sizeof *right) != 0)
			quarantine_wrong(f, said.who[i], "wrong result", &k);
}
