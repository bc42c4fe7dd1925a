/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/lost_holders.h"

#include "common/base/text.h"
#include "coordinator/core/failure_quorum.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/owner.h"
#include "coordinator/core/rounds.h"

enum { LOST_HOLDERS_REPORTED = 2 };

static bool has_not_returned(const struct lost_worker *w)
{
	return w->identity->id != w->id || w->identity->contact_count == w->contact_count;
}

static uint32_t count_not_returned(const struct lost_holders *l, uint32_t *certificates)
{
	uint32_t n = 0;
	*certificates = 0;
	for (uint32_t i = 0; i < l->count; i++) {
		bool is_repeated = false;
		if (!has_not_returned(&l->workers[i]))
			continue;
		for (uint32_t k = 0; k < i; k++)
			is_repeated |= has_not_returned(&l->workers[k]) &&
				       l->workers[k].certificate_id == l->workers[i].certificate_id;
		n++;
		*certificates += !is_repeated;
	}
	return n;
}

/* Adds the worker in the first place that fits: its own entry, a free one, that of a worker that came back, or one of
 * several with the same certificate. */
static void add_worker(struct lost_holders *l, const struct identity *identity)
{
	uint32_t position = l->count;
	for (uint32_t i = l->count; i-- > 0;)
		if (l->workers[i].id == identity->id)
			position = i;
	for (uint32_t i = 0; position == LOST_HOLDERS_FATAL && i < l->count; i++)
		if (!has_not_returned(&l->workers[i]) || l->workers[i].certificate_id == identity->certificate_id)
			position = i;
	if (position == LOST_HOLDERS_FATAL)
		return;
	l->count += position == l->count;
	l->workers[position] =
		(struct lost_worker){identity, identity->id, identity->certificate_id, identity->contact_count};
}

/* Returns the worker's index in the list; the list's length if it is not listed. */
static uint32_t index_of(const struct lost_holders *l, const struct identity *identity)
{
	uint32_t i = 0;
	while (i < l->count && l->workers[i].id != identity->id)
		i++;
	return i;
}

bool lost_holders_contain(const struct lost_holders *l, const struct identity *identity)
{
	return index_of(l, identity) < l->count;
}

bool lost_holders_remove(struct lost_holders *l, const struct identity *identity)
{
	uint32_t position = index_of(l, identity);
	if (position == l->count)
		return false;
	l->workers[position] = l->workers[--l->count];
	return true;
}

void lost_holders_add(struct farm *f, struct lease *l)
{
	struct job *j = l->job;
	struct slot *s = l->slot;
	const struct lease_key k = lease_get_key(l);
	const struct peer *p = l->peer;
	uint32_t certificates, n;
	bool counts = !l->is_overdue && !l->is_delivered;
	lease_drop(f, l);
	if (!counts)
		return;
	j->counts.lost++;
	add_worker(&s->lost_holders, p->identity);
	p->identity->contact_count += p->is_superseded;
	n = count_not_returned(&s->lost_holders, &certificates);
	if (n < LOST_HOLDERS_REPORTED)
		return;
	text_print(f->answer_text, sizeof f->answer_text,
		   "%s: %u workers in a row were lost while they held %s " LEASE_POSITION_FORMAT
		   " (%d end the job); the last one: %s",
		   j->name, n, LEASE_VALUES(&k), LOST_HOLDERS_FATAL, p->name);
	text_copy(j->explanation, sizeof j->explanation, f->answer_text);
	if (n < LOST_HOLDERS_FATAL || certificates < failure_quorum_size_required(f))
		return;
	owner_limit(j->owner, f->now);
	rounds_end_job(f, j, END_FAILED, f->answer_text);
}
