/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/lost_holders.h"

#include "common/base/text.h"
#include "coordinator/core/failure_quorum.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/rounds.h"

enum { LOST_TOLD = 2 };

static bool is_gone(const struct lost_worker *w)
{
	return w->who->id != w->id || w->who->calls == w->calls;
}

static uint32_t count_gone(const struct lost_holders *l, uint32_t *certificates)
{
	uint32_t n = 0;
	*certificates = 0;
	for (uint32_t i = 0; i < l->count; i++) {
		bool again = false;
		if (!is_gone(&l->of[i]))
			continue;
		for (uint32_t k = 0; k < i; k++)
			again |= is_gone(&l->of[k]) && l->of[k].certificate == l->of[i].certificate;
		n++;
		*certificates += !again;
	}
	return n;
}

/* Adds the worker in the first place that fits: its own entry, a free one, that of a worker that came back, or one of
 * several with the same certificate. */
static void add_worker(struct lost_holders *l, const struct identity *who)
{
	uint32_t place = l->count;
	for (uint32_t i = l->count; i-- > 0;)
		if (l->of[i].id == who->id)
			place = i;
	for (uint32_t i = 0; place == LOST_FATAL && i < l->count; i++)
		if (!is_gone(&l->of[i]) || l->of[i].certificate == who->certificate_id)
			place = i;
	if (place == LOST_FATAL)
		return;
	l->count += place == l->count;
	l->of[place] = (struct lost_worker){who, who->id, who->certificate_id, who->calls};
}

/* Returns the worker's index in the list; the list's length if it is not listed. */
static uint32_t place_of(const struct lost_holders *l, const struct identity *who)
{
	uint32_t i = 0;
	while (i < l->count && l->of[i].id != who->id)
		i++;
	return i;
}

bool lost_holders_have(const struct lost_holders *l, const struct identity *who)
{
	return place_of(l, who) < l->count;
}

bool lost_holders_remove(struct lost_holders *l, const struct identity *who)
{
	uint32_t place = place_of(l, who);
	if (place == l->count)
		return false;
	l->of[place] = l->of[--l->count];
	return true;
}

void lost_holders_add(struct farm *f, struct lease *l)
{
	struct job *j = l->job;
	struct slot *s = l->slot;
	const struct lease_key k = lease_key(l);
	const struct peer *p = l->peer;
	uint32_t certificates, n;
	bool counts = !l->overdue && !l->delivered;
	lease_drop(f, l);
	if (!counts)
		return;
	j->counts.lost++;
	add_worker(&s->lost, p->who);
	p->who->calls += p->returns;
	n = count_gone(&s->lost, &certificates);
	if (n < LOST_TOLD)
		return;
	text_print(f->text, sizeof f->text,
		   "%s: %u workers in a row were lost while they held %s " LEASE_WORDS
		   " (%d end the job); the last one: %s",
		   j->name, n, LEASE_VALUES(&k), LOST_FATAL, p->name);
	text_copy(j->text, sizeof j->text, f->text);
	if (n < LOST_FATAL || certificates < failure_quorum_certificates(f))
		return;
	owner_limit(j->owner, f->now);
	rounds_end(f, j, END_FAILED, f->text);
}
