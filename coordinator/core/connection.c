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
	p->class = peer_class_use(&f->classes, e->fingerprint);
	if (!p->class) {
		mem_free(p);
		return NULL;
	}
	p->lease_limit = limit;
	return p;
}

struct peer *connection_join(struct farm *f, const struct event_join *e, const char **refused)
{
	if (f->peer_count == f->config.max_peers) {
		*refused = "the farm has as many workers as it accepts";
		return NULL;
	}
	if (!*e->name || strlen(e->name) >= PEER_NAME) {
		*refused = "a worker needs a name, of at most 127 bytes";
		return NULL;
	}
	if (e->threads == 0 || strlen(e->fingerprint) >= FINGERPRINT_SIZE) {
		*refused = e->threads ? "the fingerprint is too long" : "a worker without threads";
		return NULL;
	}
	/* Room for 1.5 leases per thread and for some overdue leases. */
	uint32_t limit = f->config.max_peer_leases;
	if (e->threads < limit / 2)
		limit = 2 * e->threads < 4 ? (limit < 4 ? limit : 4) : 2 * e->threads;
	struct identity *who = worker_registry_use(f, e, refused);
	if (!who)
		return NULL;
	struct peer *p = peer_new(f, e, limit);
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
	p->joined = p->last_seen = f->now;
	p->state = who->quarantined ? PEER_QUARANTINED : PEER_ACTIVE;
	if (who->quarantined)
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

void connection_drop_leases(struct farm *f, struct peer *p, bool revoke)
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

void connection_leave(struct farm *f, struct peer *p)
{
	p->want = 0;
	peer_requeue(f, p);
	connection_drop_leases(f, p, false);
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

void connection_lose_leases(struct farm *f, struct peer *p)
{
	for (uint32_t i = 0; i < p->lease_limit; i++)
		if (p->leases[i].used)
			lost_holders_add(f, &p->leases[i]);
}

void connection_lose(struct farm *f, struct peer *p)
{
	p->want = 0;
	peer_requeue(f, p);
	connection_lose_leases(f, p);
	connection_leave(f, p);
}

static bool is_at(const struct peer *p, const struct event_join *e)
{
	return strcmp(p->home, e->home) == 0 && strcmp(p->who->certificate, e->certificate) == 0;
}

bool connection_replace(struct farm *f, const struct event_join *e, const char **refused)
{
	if (!*e->home)
		return true;
	const struct identity *k = worker_registry_find(f, e);
	uint64_t last = k && strcmp(k->home, e->home) == 0 ? k->restarts : 0;
	for (uint32_t i = 0; i < f->peer_count; i++)
		if (is_at(f->peers[i], e) && f->peers[i]->restarts > last)
			last = f->peers[i]->restarts;
	if (last > e->restarts) {
		text_print(f->text, sizeof f->text, "this is start %llu of %s, and its start %llu has connected before",
			   (unsigned long long)e->restarts, e->name, (unsigned long long)last);
		*refused = f->text;
		return false;
	}
	for (uint32_t i = f->peer_count; i-- > 0;) {
		struct peer *p = f->peers[i];
		if (!is_at(p, e))
			continue;
		struct action *a = update_add(f, ACTION_CLOSE_PEER);
		a->peer = p->id;
		a->text = "the same worker has reconnected";
		p->returns = true;
		connection_lose(f, p);
	}
	return true;
}
