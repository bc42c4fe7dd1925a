/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/doubt.h"

#include "common/base/text.h"
#include "coordinator/core/forecast.h"
#include "coordinator/core/identity_index.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/quarantine.h"

#include <assert.h>

static const char *worker_name(const struct farm *f, uint64_t worker_id)
{
	const struct identity *k = worker_id ? identity_index_find_by_id(&f->identity_index, worker_id) : NULL;
	return k ? k->name : worker_id ? "a worker no longer known" : "a worker of an earlier run";
}

const char *doubt_maker_name(const struct farm *f, const struct lease_key *k)
{
	const struct job *j = farm_find_job(f, k->job);
	bool known_slot =
		j && job_is_live(j) && k->kind == j->kind && k->group < j->plan.groups && k->part < j->plan.parts;
	const struct slot *s = known_slot ? job_get_slot(j, k->group, k->part) : NULL;
	/* Only the maker of the latest states is known. */
	return s && s->next_epoch == k->epoch && k->epoch > 0 ? worker_name(f, s->doubt.maker) : "?";
}

static bool is_party(const struct slot *s, uint64_t worker_id)
{
	const struct doubt *d = &s->doubt;
	return worker_id == d->barred_maker ||
	       (doubt_is_pending(s) && (worker_id == d->maker || worker_id == d->refuser));
}

/* Whether a connected worker is neither the maker nor a refuser of the states, so that it could be asked. */
static bool has_third_worker(const struct farm *f, const struct job *j, const struct slot *s)
{
	for (uint32_t i = 0; i < f->peer_count; i++) {
		const struct peer *p = f->peers[i];
		if (p->state == PEER_ACTIVE && job_accepts_class(j, p->class) && !is_party(s, p->identity->id))
			return true;
	}
	return false;
}

bool doubt_bars_worker(const struct farm *f, const struct job *j, const struct slot *s, const struct peer *p)
{
	return is_party(s, p->identity->id) && has_third_worker(f, j, s);
}

/* Takes the slot's last epoch back, so that it becomes the slot's next epoch again. If its round was complete, that
 * round and all later ones are open again, and leases more than one round ahead are revoked. */
static void reopen_epoch(struct farm *f, struct job *j, struct slot *s)
{
	assert(j->kind == LEASE_RENDER && s->next_epoch > 0);
	j->progress_floor = job_progress(j, f->now);
	lease_revoke_slot(f, s);
	s->next_epoch--;
	s->timeout_count = 0;
	s->failure_quorum.count = 0;
	s->lost_holders.count = 0;
	j->leases_merged--;
	if (s->next_epoch < j->rounds) {
		j->rounds = s->next_epoch;
		/* a pending estimate would be of rounds that are no longer complete; the update may contain other
		 * actions, too */
		j->is_estimating_error = false;
	}
	for (uint32_t i = 0; i < j->slot_count; i++)
		if (j->slots[i].next_epoch - j->rounds > 1)
			lease_revoke_slot(f, &j->slots[i]);
	job_place_all_slots(j);
}

/* Asks the shell to take the batch of the last epoch out of the films. The epoch's sums are not verified even if they
 * were before: its chain states may be wrong although the sums are right. */
static void roll_back_epoch(struct farm *f, struct job *j, struct slot *s, const char *refusers)
{
	struct doubt *d = &s->doubt;
	uint64_t maker = d->maker,
		 watermark = d->rollback_watermark > s->next_epoch ? d->rollback_watermark : s->next_epoch;
	reopen_epoch(f, j, s);
	*d = (struct doubt){.maker = d->previous_maker,
			    .barred_maker = maker,
			    .rollback_watermark = watermark,
			    .rollback_count = d->rollback_count + 1};
	struct action *a = update_add(f, ACTION_ROLL_BACK_EPOCH);
	a->worker_id = maker;
	a->job = j->id;
	a->key = slot_lease_key(j, s);
	text_print(f->answer_text, sizeof f->answer_text,
		   LEASE_POSITION_FORMAT " is computed again: its chain states, made by %s, were refused by %s",
		   LEASE_POSITION_VALUES(&a->key), worker_name(f, maker), refusers);
	a->text = f->answer_text;
}

static void restart_chains(struct farm *f, struct job *j, struct slot *s, const char *refusers)
{
	const struct lease_key k = slot_lease_key(j, s);
	lease_revoke_slot(f, s); /* some workers may still hold the refused states */
	s->doubt.starts_from_seeds = true;
	text_print(f->answer_text, sizeof f->answer_text,
		   "the chains of group %u part %u start epoch %llu from their seeds: their states, made by %s, were "
		   "refused by %s",
		   k.group, k.part, (unsigned long long)k.epoch, worker_name(f, s->doubt.maker), refusers);
	struct action *a = update_add(f, ACTION_RESTART_CHAINS);
	a->job = j->id;
	a->key = k;
	a->text = f->answer_text;
}

void doubt_handle_refusal(struct farm *f, struct job *j, struct slot *s, const struct peer *p, bool can_roll_back,
			  const char *text)
{
	struct doubt *d = &s->doubt;
	uint64_t worker_id = p->identity->id;
	bool is_second_refusal = d->refuser && d->refuser != worker_id && d->maker != worker_id;
	if (!d->refuser)
		d->refuser = worker_id;
	text_print(j->explanation, sizeof j->explanation, "%s: %s (made by %s)", p->name, text,
		   worker_name(f, d->maker));
	if (!is_second_refusal && has_third_worker(f, j, s)) {
		job_place_slot(j, s);
		return;
	}
	struct lease_key made_by_lease = slot_lease_key(j, s);
	made_by_lease.epoch--;
	char refusers[2 * JOIN_NAME_SIZE];
	if (d->refuser == worker_id)
		text_copy(refusers, sizeof refusers, p->name);
	else
		text_print(refusers, sizeof refusers, "%s and %s", worker_name(f, d->refuser), p->name);
	struct identity *maker = is_second_refusal && !j->is_mixed && d->maker != d->refuser
					 ? identity_index_find_by_id(&f->identity_index, d->maker)
					 : NULL;
	if (can_roll_back && d->rollback_count < DOUBT_ROLLBACKS_MAX)
		roll_back_epoch(f, j, s, refusers);
	else
		restart_chains(f, j, s, refusers);
	if (maker)
		quarantine_note_wrong_result(f, maker, "wrong chain states", &made_by_lease);
	job_place_slot(j, s);
}

void doubt_settle(struct farm *f, const struct job *j, struct slot *s, const struct identity *identity,
		  const struct lease_key *k)
{
	struct doubt *d = &s->doubt;
	bool contradicts_refusal = doubt_is_pending(s) && !is_party(s, identity->id) && !j->is_mixed;
	struct identity *refuser =
		contradicts_refusal ? identity_index_find_by_id(&f->identity_index, d->refuser) : NULL;
	bool is_behind_watermark = s->next_epoch < d->rollback_watermark;
	*d = (struct doubt){.maker = identity->id,
			    .previous_maker = d->starts_from_seeds ? 0 : d->maker,
			    .rollback_watermark = is_behind_watermark ? d->rollback_watermark : 0,
			    .rollback_count = is_behind_watermark ? d->rollback_count : 0};
	if (refuser)
		quarantine_note_wrong_result(f, refuser, "refused good chain states", k);
}

bool doubt_describe_wait(const struct farm *f, const struct job *j, char *text, size_t size)
{
	for (uint32_t i = 0; i < j->slot_count; i++) {
		const struct slot *s = &j->slots[i];
		if (!doubt_is_pending(s) || s->holder_count)
			continue;
		const struct lease_key k = slot_lease_key(j, s);
		text_print(text, size,
			   "a third worker will decide whether the chain states of " LEASE_POSITION_FORMAT
			   " are wrong: "
			   "%s made them, %s refused them",
			   LEASE_POSITION_VALUES(&k), worker_name(f, s->doubt.maker), worker_name(f, s->doubt.refuser));
		return true;
	}
	return false;
}
