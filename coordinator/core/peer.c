/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/peer.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/core/state.h"

#include <math.h>
#include <string.h>

enum { PAUSE_DOUBLINGS = 6 };

struct peer_class *peer_class_use(struct farm *f, const char *fingerprint)
{
	for (struct link *l = f->classes.next; l != &f->classes; l = l->next) {
		struct peer_class *c = list_entry(l, struct peer_class, link);
		if (strcmp(c->fingerprint, fingerprint) == 0) {
			c->uses++;
			return c;
		}
	}
	struct peer_class *c = mem_alloc(1, sizeof *c);
	if (!c)
		return NULL;
	text_copy(c->fingerprint, sizeof c->fingerprint, fingerprint);
	c->uses = 1;
	list_init(&c->waiting);
	list_append(&f->classes, &c->link);
	return c;
}

void peer_class_drop(struct peer_class *c)
{
	if (--c->uses)
		return;
	list_remove(&c->link);
	mem_free(c);
}

static struct peer *make(struct farm *f, const struct event_join *e, uint32_t limit)
{
	if (update_reserve(f, limit) < 0)
		return NULL;
	struct peer *p = mem_alloc(1, sizeof *p + limit * sizeof *p->leases);
	if (!p)
		return NULL;
	p->class = peer_class_use(f, e->fingerprint);
	if (!p->class) {
		mem_free(p);
		return NULL;
	}
	p->lease_limit = limit;
	return p;
}

struct peer *peer_join(struct farm *f, const struct event_join *e, const char **refused)
{
	if (f->peer_count == f->config.max_peers) {
		*refused = "the farm has as many workers as it takes";
		return NULL;
	}
	if (!*e->name || strlen(e->name) >= PEER_NAME) {
		*refused = "a worker must have a name, and a short one";
		return NULL;
	}
	if (e->threads == 0 || strlen(e->fingerprint) >= FINGERPRINT_SIZE) {
		*refused = e->threads ? "the fingerprint is too long" : "a worker without threads";
		return NULL;
	}
	/* Room for a lease and a half per thread and some that are overdue. */
	uint32_t limit = f->config.max_peer_leases;
	if (e->threads < limit / 2)
		limit = 2 * e->threads < 4 ? (limit < 4 ? limit : 4) : 2 * e->threads;
	struct identity *who = worker_registry_use(f, e, refused);
	if (!who)
		return NULL;
	struct peer *p = make(f, e, limit);
	if (!p) {
		worker_registry_drop(f, who);
		*refused = "the coordinator has no memory for another worker";
		return NULL;
	}
	p->id = e->peer;
	p->who = who;
	text_copy(p->home, sizeof p->home, e->home);
	p->restarts = e->restarts;
	text_copy(p->name, sizeof p->name, e->name);
	p->threads = e->threads;
	p->joined = p->heard = f->now;
	p->state = who->aside ? PEER_ASIDE : PEER_ACTIVE;
	if (who->aside)
		memcpy(p->text, who->text, sizeof p->text);
	p->class->active += p->state == PEER_ACTIVE;
	list_init(&p->waiting);
	f->lease_limit += limit;
	if (f->now + f->config.silent_after < f->check_at)
		f->check_at = f->now + f->config.silent_after;
	uint32_t i = f->peer_count++;
	for (; i > 0 && f->peers[i - 1]->id > p->id; i--)
		f->peers[i] = f->peers[i - 1];
	f->peers[i] = p;
	return p;
}

void peer_leave(struct farm *f, struct peer *p)
{
	p->want = 0;
	peer_requeue(f, p);
	peer_drop_leases(f, p, false);
	if (p->state == PEER_ACTIVE)
		p->class->active--;
	peer_class_drop(p->class);
	worker_registry_drop(f, p->who);
	f->lease_limit -= p->lease_limit;
	uint32_t i = 0;
	while (f->peers[i] != p)
		i++;
	f->peer_count--;
	memmove(&f->peers[i], &f->peers[i + 1], (f->peer_count - i) * sizeof *f->peers);
	mem_free(p);
}

void peer_lose_leases(struct farm *f, struct peer *p)
{
	for (uint32_t i = 0; i < p->lease_limit; i++)
		if (p->leases[i].used)
			lost_lease(f, &p->leases[i]);
}

void peer_lose(struct farm *f, struct peer *p)
{
	p->want = 0;
	peer_requeue(f, p);
	peer_lose_leases(f, p);
	peer_leave(f, p);
}

void peer_set_state(struct farm *f, struct peer *p, enum peer_state s)
{
	if (p->state == PEER_ACTIVE && s != PEER_ACTIVE)
		p->class->active--;
	if (p->state != PEER_ACTIVE && s == PEER_ACTIVE)
		p->class->active++;
	p->state = s;
	peer_requeue(f, p);
}

void peer_heard(struct farm *f, struct peer *p)
{
	p->heard = f->now;
	p->who->calls += p->state == PEER_SILENT;
	if (p->state == PEER_SILENT)
		peer_set_state(f, p, p->who->aside ? PEER_ASIDE : PEER_ACTIVE);
}

void peer_drop_leases(struct farm *f, struct peer *p, bool revoke)
{
	for (uint32_t i = 0; i < p->lease_limit; i++) {
		struct lease *l = &p->leases[i];
		if (!l->used)
			continue;
		if (revoke)
			lease_revoke(f, l);
		else
			lease_drop(f, l);
	}
}

bool peer_has_wish(const struct peer *p)
{
	return p->state == PEER_ACTIVE && p->held < p->want && p->held < p->who->window &&
	       p->held + p->delivered < p->lease_limit;
}

void peer_requeue(struct farm *f, struct peer *p)
{
	if (!list_is_empty(&p->waiting)) {
		list_remove(&p->waiting);
		f->waiting--;
	}
	if (peer_has_wish(p)) {
		list_append(&p->class->waiting, &p->waiting);
		p->queued = f->queued++;
		f->waiting++;
	}
}

void peer_fault(struct farm *f, struct peer *p, const char *text)
{
	p->faults++;
	p->who->faults_in_row++;
	text_copy(p->text, sizeof p->text, text);
	memcpy(p->who->text, p->text, sizeof p->text);
	if (p->who->faults_in_row >= f->config.max_faults)
		worker_registry_quarantine(f, p->who);
}

static struct avoid *avoid_of(const struct peer *p, uint64_t job)
{
	for (int i = 0; i < IDENTITY_AVOIDED; i++)
		if (p->who->avoid[i].job == job)
			return &p->who->avoid[i];
	return NULL;
}

/* Where there is room, where a job is over, or instead of the one that ends first. */
static struct avoid *room_to_avoid(const struct farm *f, struct identity *who)
{
	struct avoid *first = &who->avoid[0];
	for (int i = 0; i < IDENTITY_AVOIDED; i++) {
		struct avoid *a = &who->avoid[i];
		const struct job *j = a->job ? farm_find_job(f, a->job) : NULL;
		if (!j || !job_is_live(j))
			return a;
		if (a->until < first->until)
			first = a;
	}
	return first;
}

void peer_failed(const struct farm *f, struct peer *p, uint64_t job, bool own)
{
	struct avoid *a = avoid_of(p, job);
	p->failures++;
	if (a && a->until > f->now) {
		a->own = a->own && own;
		return;
	}
	if (!a) {
		a = room_to_avoid(f, p->who);
		*a = (struct avoid){.job = job};
	}
	uint32_t doublings = a->failures < PAUSE_DOUBLINGS ? a->failures : PAUSE_DOUBLINGS;
	a->failures++;
	a->own = own;
	a->until = f->now + ldexp(f->config.first_pause, (int)doublings);
}

/* What it may hold grows with what it gives: who takes what he can get and gives nothing holds up little. */
static void set_window(struct farm *f, struct peer *p, uint32_t window)
{
	struct peer **all =
		p->who->uses > 1 ? f->peers : &p; /* an old connection of the same worker may still be here */
	uint32_t count = p->who->uses > 1 ? f->peer_count : 1;
	p->who->window = window;
	for (uint32_t i = 0; i < count; i++)
		if (all[i]->who == p->who && peer_has_wish(all[i]) == list_is_empty(&all[i]->waiting))
			peer_requeue(f, all[i]);
}

void peer_was_late(struct farm *f, struct peer *p)
{
	set_window(f, p, p->who->window > 1 ? p->who->window / 2 : 1);
}

void peer_succeeded(struct farm *f, struct peer *p, uint64_t job)
{
	struct avoid *a = avoid_of(p, job);
	p->merged++;
	p->who->faults_in_row = 0;
	if (a)
		*a = (struct avoid){0};
	if (p->who->window < f->config.max_peer_leases)
		set_window(f, p, 2 * p->who->window);
}

double peer_avoids_until(const struct peer *p, uint64_t job)
{
	const struct avoid *a = avoid_of(p, job);
	return a ? a->until : -INFINITY;
}

bool peer_lacks(const struct peer *p, uint64_t job)
{
	const struct avoid *a = avoid_of(p, job);
	return a && a->own;
}
