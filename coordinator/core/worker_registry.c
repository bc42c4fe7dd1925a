/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/worker_registry.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/core/state.h"

#include <stdio.h>
#include <string.h>

/* By its home, else by its name. */
static struct identity *find(const struct farm *f, const struct event_join *e)
{
	struct identity *named = NULL;
	for (uint32_t i = 0; i < f->known_count; i++) {
		struct identity *k = f->known[i];
		if (strcmp(k->certificate, e->certificate) != 0)
			continue;
		if (*e->home && strcmp(k->home, e->home) == 0)
			return k;
		if (strcmp(k->name, e->name) == 0)
			named = k;
	}
	return named;
}

/* Whom to forget for one with this certificate: its own names first, whoever was set aside last. */
static bool goes_before(const struct identity *a, const struct identity *b, const char *certificate)
{
	bool a_own = strcmp(a->certificate, certificate) == 0, b_own = strcmp(b->certificate, certificate) == 0;
	return a->aside != b->aside ? b->aside : a_own != b_own ? a_own : a->seen < b->seen;
}

/* NULL: all of them are needed. */
static struct identity *room_for_one(struct farm *f, const char *certificate)
{
	struct identity *oldest = NULL;
	if (f->known_count < f->known_limit) {
		struct identity *k = mem_alloc(1, sizeof *k);
		if (k)
			f->known[f->known_count++] = k;
		return k;
	}
	for (uint32_t i = 0; i < f->known_count; i++)
		if (f->known[i]->uses == 0 && (!oldest || goes_before(f->known[i], oldest, certificate)))
			oldest = f->known[i];
	return oldest;
}

/* That of those who have the same, else a new one. */
static uint64_t certificate_id(const struct farm *f, const char *certificate, uint64_t otherwise)
{
	for (uint32_t i = 0; i < f->known_count; i++)
		if (f->known[i]->certificate_id && strcmp(f->known[i]->certificate, certificate) == 0)
			return f->known[i]->certificate_id;
	return otherwise;
}

struct identity *worker_registry_use(struct farm *f, const struct event_join *e, const char **refused)
{
	struct identity *k = find(f, e);
	if (!k) {
		k = room_for_one(f, e->certificate);
		if (!k) {
			*refused = "the coordinator has no room to remember another worker";
			return NULL;
		}
		*k = (struct identity){.id = ++f->identities, .window = PEER_WINDOW};
		k->certificate_id = certificate_id(f, e->certificate, k->id);
		text_copy(k->certificate, sizeof k->certificate, e->certificate);
	}
	/* One that is set aside stays known by what it was. */
	if (!k->aside || strcmp(k->home, e->home) == 0)
		k->restarts = e->restarts;
	if (!k->aside) {
		text_copy(k->name, sizeof k->name, e->name);
		text_copy(k->home, sizeof k->home, e->home);
	}
	k->seen = f->now;
	k->calls++;
	k->uses++;
	return k;
}

void worker_registry_drop(struct farm *f, struct identity *who)
{
	who->uses--;
	who->seen = f->now;
}

void worker_registry_free(struct farm *f)
{
	for (uint32_t i = 0; i < f->known_count; i++)
		mem_free(f->known[i]);
	mem_free(f->known);
}

static bool is_at(const struct peer *p, const struct event_join *e)
{
	return strcmp(p->home, e->home) == 0 && strcmp(p->who->certificate, e->certificate) == 0;
}

bool worker_registry_replace(struct farm *f, const struct event_join *e, const char **refused)
{
	if (!*e->home)
		return true;
	const struct identity *k = find(f, e);
	uint64_t last = k && strcmp(k->home, e->home) == 0 ? k->restarts : 0;
	for (uint32_t i = 0; i < f->peer_count; i++)
		if (is_at(f->peers[i], e) && f->peers[i]->restarts > last)
			last = f->peers[i]->restarts;
	if (last > e->restarts) {
		text_print(f->text, sizeof f->text,
			   "this is start %llu of %s, and start %llu of it has been here before",
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
		a->text = "the same worker has called again";
		p->returns = true;
		peer_lose(f, p);
	}
	return true;
}

/* Names cost nothing: of one certificate so many are remembered as set aside, and the one that has been away longest
 * makes room. */
static void set_aside(struct farm *f, struct identity *who)
{
	struct identity *oldest = NULL;
	uint32_t count = 0;
	for (uint32_t i = 0; i < f->known_count; i++) {
		struct identity *k = f->known[i];
		if (!k->aside || k == who || k->certificate_id != who->certificate_id)
			continue;
		count++;
		if (k->uses == 0 && (!oldest || k->seen < oldest->seen))
			oldest = k;
	}
	if (count >= IDENTITY_QUARANTINED && oldest)
		oldest->aside = false;
	who->aside = true;
}

void worker_registry_quarantine(struct farm *f, struct identity *who)
{
	if (who->aside)
		return;
	set_aside(f, who);
	struct action *a = update_add(f, ACTION_ASIDE);
	a->who = who->id;
	a->text = who->text;
	for (uint32_t i = 0; i < f->peer_count; i++) {
		struct peer *p = f->peers[i];
		if (p->who != who)
			continue;
		peer_set_state(f, p, PEER_ASIDE);
		peer_drop_leases(f, p, true);
	}
	verify_forget_worker(f, who);
}

void worker_registry_wrong(struct farm *f, struct identity *who, const char *what, const struct lease_key *k)
{
	snprintf(who->text, sizeof who->text, "%s: j%llu %s group %u part %u epoch %llu", what,
		 (unsigned long long)k->job, k->kind == LEASE_BOOTSTRAP ? "bootstrap" : "render", k->group, k->part,
		 (unsigned long long)k->epoch);
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
		worker_registry_quarantine(f, who);
}

void worker_registry_restore_quarantined(struct farm *f, const struct event_join *e, const char *text)
{
	const char *refused;
	struct identity *k = worker_registry_use(f, e, &refused);
	if (!k)
		return;
	text_copy(k->text, sizeof k->text, text);
	set_aside(f, k);
	worker_registry_drop(f, k);
}
