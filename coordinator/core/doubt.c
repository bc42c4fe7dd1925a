/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/doubt.h"

#include "common/base/text.h"
#include "coordinator/core/forecast.h"
#include "coordinator/core/identity_index.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/quarantine.h"

#include <assert.h>

static const char *name_of(const struct farm *f, uint64_t who)
{
	const struct identity *k = who ? identity_index_id(&f->index, who) : NULL;
	return k ? k->name : who ? "a worker no longer known" : "a worker of an earlier run";
}

const char *doubt_maker(const struct farm *f, const struct lease_key *k)
{
	const struct job *j = farm_find_job(f, k->job);
	bool known_slot =
		j && job_is_live(j) && k->kind == j->kind && k->group < j->plan.groups && k->part < j->plan.parts;
	const struct slot *s = known_slot ? job_slot(j, k->group, k->part) : NULL;
	return s && s->next == k->epoch && k->epoch > 0 ? name_of(f, s->doubt.maker)
							: "?"; /* only the maker of the latest states is known */
}

static bool is_party(const struct slot *s, uint64_t who)
{
	const struct doubt *d = &s->doubt;
	return who == d->barred || (doubt_waits(s) && (who == d->maker || who == d->refuser));
}

/* Whether a connected worker is neither the maker nor a refuser of the states, so that it could be asked. */
static bool third_is_here(const struct farm *f, const struct job *j, const struct slot *s)
{
	for (uint32_t i = 0; i < f->peer_count; i++) {
		const struct peer *p = f->peers[i];
		if (p->state == PEER_ACTIVE && job_takes(j, p->class) && !is_party(s, p->who->id))
			return true;
	}
	return false;
}

bool doubt_bars(const struct farm *f, const struct job *j, const struct slot *s, const struct peer *p)
{
	return is_party(s, p->who->id) && third_is_here(f, j, s);
}

/* Takes the slot's last epoch back, so that it becomes the slot's next epoch again. If its round was complete, that
 * round and all later ones are open again, and leases more than one round ahead are revoked. */
static void open_again(struct farm *f, struct job *j, struct slot *s)
{
	assert(j->kind == LEASE_RENDER && s->next > 0);
	j->progress_floor = job_progress(j, f->now);
	lease_revoke_slot(f, s);
	s->next--;
	s->timeouts = 0;
	s->failure_quorum.count = 0;
	s->lost.count = 0;
	j->leases_merged--;
	if (s->next < j->rounds) {
		j->rounds = s->next;
		/* a pending estimate would be of rounds that are no longer complete; the update may contain other
		 * actions, too */
		j->evaluating = false;
	}
	for (uint32_t i = 0; i < j->slot_count; i++)
		if (j->slots[i].next - j->rounds > 1)
			lease_revoke_slot(f, &j->slots[i]);
	job_place_all(j);
}

/* Asks the shell to take the batch of the last epoch out of the films. The epoch's sums are not verified even if they
 * were before: its chain states may be wrong although the sums are right. */
static void take_back(struct farm *f, struct job *j, struct slot *s, const char *refusers)
{
	struct doubt *d = &s->doubt;
	uint64_t maker = d->maker, reach = d->reach > s->next ? d->reach : s->next;
	open_again(f, j, s);
	*d = (struct doubt){.maker = d->before, .barred = maker, .reach = reach, .again = d->again + 1};
	struct action *a = update_add(f, ACTION_TAKE_BACK);
	a->who = maker;
	a->job = j->id;
	a->key = slot_key(j, s);
	text_print(f->text, sizeof f->text,
		   LEASE_WORDS " is computed again: its chain states, made by %s, were refused by %s",
		   LEASE_PLACE(&a->key), name_of(f, maker), refusers);
	a->text = f->text;
}

static void begin_anew(struct farm *f, struct job *j, struct slot *s, const char *refusers)
{
	const struct lease_key k = slot_key(j, s);
	lease_revoke_slot(f, s); /* some workers may still hold the refused states */
	s->doubt.anew = true;
	text_print(f->text, sizeof f->text,
		   "the chains of group %u part %u start epoch %llu from their seeds: their states, made by %s, were "
		   "refused by %s",
		   k.group, k.part, (unsigned long long)k.epoch, name_of(f, s->doubt.maker), refusers);
	struct action *a = update_add(f, ACTION_CHAINS_ANEW);
	a->job = j->id;
	a->key = k;
	a->text = f->text;
}

void doubt_refused(struct farm *f, struct job *j, struct slot *s, const struct peer *p, bool can, const char *text)
{
	struct doubt *d = &s->doubt;
	uint64_t who = p->who->id;
	bool second = d->refuser && d->refuser != who && d->maker != who;
	if (!d->refuser)
		d->refuser = who;
	text_print(j->text, sizeof j->text, "%s: %s (made by %s)", p->name, text, name_of(f, d->maker));
	if (!second && third_is_here(f, j, s)) {
		job_place(j, s);
		return;
	}
	struct lease_key made = slot_key(j, s);
	made.epoch--;
	char refusers[2 * JOIN_NAME];
	if (d->refuser == who)
		text_copy(refusers, sizeof refusers, p->name);
	else
		text_print(refusers, sizeof refusers, "%s and %s", name_of(f, d->refuser), p->name);
	struct identity *maker =
		second && !j->mixed && d->maker != d->refuser ? identity_index_id(&f->index, d->maker) : NULL;
	if (can && d->again < AGAIN_MOST)
		take_back(f, j, s, refusers);
	else
		begin_anew(f, j, s, refusers);
	if (maker)
		quarantine_wrong(f, maker, "wrong chain states", &made);
	job_place(j, s);
}

void doubt_settle(struct farm *f, const struct job *j, struct slot *s, const struct identity *who,
		  const struct lease_key *k)
{
	struct doubt *d = &s->doubt;
	bool went_on = doubt_waits(s) && !is_party(s, who->id) && !j->mixed;
	struct identity *refuser = went_on ? identity_index_id(&f->index, d->refuser) : NULL;
	bool behind = s->next < d->reach;
	*d = (struct doubt){.maker = who->id,
			    .before = d->anew ? 0 : d->maker,
			    .reach = behind ? d->reach : 0,
			    .again = behind ? d->again : 0};
	if (refuser)
		quarantine_wrong(f, refuser, "refused good chain states", k);
}

bool doubt_why(const struct farm *f, const struct job *j, char *text, size_t size)
{
	for (uint32_t i = 0; i < j->slot_count; i++) {
		const struct slot *s = &j->slots[i];
		if (!doubt_waits(s) || s->holders)
			continue;
		const struct lease_key k = slot_key(j, s);
		text_print(text, size,
			   "a third worker will decide whether the chain states of " LEASE_WORDS " are wrong: "
			   "%s made them, %s refused them",
			   LEASE_PLACE(&k), name_of(f, s->doubt.maker), name_of(f, s->doubt.refuser));
		return true;
	}
	return false;
}
