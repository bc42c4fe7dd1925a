/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/connection.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/core/lease.h"
#include "coordinator/core/lost_holders.h"
#include "coordinator/core/worker_registry.h"

#include <string.h>

static struct peer *peer_new(struct farm *f, const struct event_join *e, uint32_t limit)
{
	if (update_reserve(f, limit) < 0)
		return NULL;
	struct peer *p = mem_alloc(1, sizeof *p + limit * sizeof *p->leases);
	if (!p)
		return NULL;
	p->class = peer_class_acquire(&f->classes, e->fingerprint);
	if (!p->class) {
		mem_free(p);
		return NULL;
	}
	p->lease_capacity = limit;
	return p;
}

struct peer *connection_join(struct farm *f, const struct event_join *e, const char **refusal)
{
	if (f->peer_count == f->config.max_peers) {
		*refusal = "the farm has as many workers as it accepts";
		return NULL;
	}
	if (!*e->name || strlen(e->name) >= PEER_NAME_SIZE) {
		*refusal = "a worker needs a name, of at most 127 bytes";
		return NULL;
	}
	if (e->threads == 0 || strlen(e->fingerprint) >= FINGERPRINT_SIZE) {
		*refusal = e->threads ? "the fingerprint is too long" : "a worker without threads";
		return NULL;
	}
	/* Room for 1.5 leases per thread and for some overdue leases. */
	uint32_t limit = f->config.max_peer_leases;
	if (e->threads < limit / 2)
		limit = 2 * e->threads < 4 ? (limit < 4 ? limit : 4) : 2 * e->threads;
	struct identity *identity = worker_registry_acquire(f, e, refusal);
	if (!identity)
		return NULL;
	struct peer *p = peer_new(f, e, limit);
	if (!p) {
		worker_registry_release(f, identity);
		*refusal = "the coordinator has no memory for another worker";
		return NULL;
	}
	p->id = e->peer;
	p->identity = identity;
	text_copy(p->home, sizeof p->home, e->home);
	p->restarts = e->restarts;
	text_copy(p->name, sizeof p->name, e->name);
	p->threads = e->threads;
	p->joined_at = p->last_seen = f->now;
	p->state = identity->is_quarantined ? PEER_QUARANTINED : PEER_ACTIVE;
	if (identity->is_quarantined)
		memcpy(p->last_fault, identity->last_fault, sizeof p->last_fault);
	p->class->active_peer_count += p->state == PEER_ACTIVE;
	list_init(&p->waiting_link);
	f->lease_capacity += limit;
	if (f->now + f->config.silence_timeout < f->next_expiry_check_at)
		f->next_expiry_check_at = f->now + f->config.silence_timeout;
	uint32_t i = f->peer_count++;
	for (; i > 0 && f->peers[i - 1]->id > p->id; i--)
		f->peers[i] = f->peers[i - 1];
	f->peers[i] = p;
	return p;
}

void connection_drop_leases(struct farm *f, struct peer *p, bool revoke)
{
	for (uint32_t i = 0; i < p->lease_capacity; i++) {
		struct lease *l = &p->leases[i];
		if (!l->is_in_use)
			continue;
		if (revoke)
			lease_revoke(f, l);
		else
			lease_drop(f, l);
	}
}

void connection_leave(struct farm *f, struct peer *p)
{
	p->wanted_lease_count = 0;
	peer_requeue(f, p);
	connection_drop_leases(f, p, false);
	if (p->state == PEER_ACTIVE)
		p->class->active_peer_count--;
	peer_class_release(p->class);
	worker_registry_release(f, p->identity);
	f->lease_capacity -= p->lease_capacity;
	uint32_t i = 0;
	while (f->peers[i] != p)
		i++;
	f->peer_count--;
	memmove(&f->peers[i], &f->peers[i + 1], (f->peer_count - i) * sizeof *f->peers);
	mem_free(p);
}

void connection_lose_leases(struct farm *f, struct peer *p)
{
	for (uint32_t i = 0; i < p->lease_capacity; i++)
		if (p->leases[i].is_in_use)
			lost_holders_add(f, &p->leases[i]);
}

void connection_lose(struct farm *f, struct peer *p)
{
	p->wanted_lease_count = 0;
	peer_requeue(f, p);
	connection_lose_leases(f, p);
	connection_leave(f, p);
}

static bool is_same_home(const struct peer *p, const struct event_join *e)
{
	return strcmp(p->home, e->home) == 0 && strcmp(p->identity->certificate, e->certificate) == 0;
}

bool connection_supersede_earlier(struct farm *f, const struct event_join *e, const char **refusal)
{
	if (!*e->home)
		return true;
	const struct identity *k = worker_registry_find(f, e);
	uint64_t last_start = k && strcmp(k->home, e->home) == 0 ? k->restarts : 0;
	for (uint32_t i = 0; i < f->peer_count; i++)
		if (is_same_home(f->peers[i], e) && f->peers[i]->restarts > last_start)
			last_start = f->peers[i]->restarts;
	if (last_start > e->restarts) {
		text_print(f->answer_text, sizeof f->answer_text,
			   "this is start %llu of %s, and its start %llu has connected before",
			   (unsigned long long)e->restarts, e->name, (unsigned long long)last_start);
		*refusal = f->answer_text;
		return false;
	}
	for (uint32_t i = f->peer_count; i-- > 0;) {
		struct peer *p = f->peers[i];
		if (!is_same_home(p, e))
			continue;
		struct action *a = update_add(f, ACTION_CLOSE_PEER);
		a->peer = p->id;
		a->text = "the same worker has reconnected";
		p->is_superseded = true;
		connection_lose(f, p);
	}
	return true;
}
