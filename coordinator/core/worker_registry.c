/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/worker_registry.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/core/identity_index.h"

#include <string.h>

struct identity *worker_registry_find(const struct farm *f, const struct event_join *e)
{
	struct identity *k = *e->home ? identity_index_home(&f->index, e->certificate, e->home) : NULL;
	return k ? k : identity_index_name(&f->index, e->certificate, e->name);
}

/* Whether a is to be forgotten before b to make room for a newcomer with this certificate: entries with the same
 * certificate go first, quarantined ones last. */
static bool goes_before(const struct identity *a, const struct identity *b, const char *certificate)
{
	bool a_own = strcmp(a->certificate, certificate) == 0, b_own = strcmp(b->certificate, certificate) == 0;
	return a->quarantined != b->quarantined ? b->quarantined : a_own != b_own ? a_own : a->seen < b->seen;
}

/* Returns an entry for a newcomer that is not in the index, either new or of a worker that is forgotten for it. NULL:
 * all entries are in use, or out of memory. */
static struct identity *room_for_one(struct farm *f, const char *certificate)
{
	struct identity *oldest = NULL;
	if (f->known_count < f->known_limit) {
		struct identity *k = mem_alloc(1, sizeof *k);
		if (k) {
			k->place = f->known_count++;
			f->known[k->place] = k;
		}
		return k;
	}
	for (uint32_t i = 0; i < f->known_count; i++)
		if (f->known[i]->uses == 0 && (!oldest || goes_before(f->known[i], oldest, certificate)))
			oldest = f->known[i];
	if (oldest)
		identity_index_remove(&f->index, oldest);
	return oldest;
}

/* Returns the number of this certificate if an entry has it, `otherwise` if not. */
static uint64_t certificate_id(const struct farm *f, const char *certificate, uint64_t otherwise)
{
	for (uint32_t i = 0; i < f->known_count; i++)
		if (f->known[i]->certificate_id && strcmp(f->known[i]->certificate, certificate) == 0)
			return f->known[i]->certificate_id;
	return otherwise;
}

/* Returns the existing entry, or a new one; NULL: no room. */
static struct identity *find_or_add(struct farm *f, const struct event_join *e)
{
	struct identity *k = worker_registry_find(f, e);
	if (k || !(k = room_for_one(f, e->certificate)))
		return k;
	*k = (struct identity){.place = k->place,
			       .id = ++f->identities,
			       .window = PEER_WINDOW,
			       .restarts = e->restarts,
			       .seen = f->now};
	k->certificate_id = certificate_id(f, e->certificate, k->id);
	text_copy(k->certificate, sizeof k->certificate, e->certificate);
	text_copy(k->name, sizeof k->name, e->name);
	text_copy(k->home, sizeof k->home, e->home);
	identity_index_add(&f->index, k);
	return k;
}

uint64_t worker_registry_recall(struct farm *f, const struct event_join *e)
{
	struct identity *k = find_or_add(f, e);
	/* Results may be of different starts of the worker; the latest start counts. */
	if (k && !k->calls && strcmp(k->home, e->home) == 0 && k->restarts < e->restarts)
		k->restarts = e->restarts;
	return k ? k->id : 0;
}

struct identity *worker_registry_use(struct farm *f, const struct event_join *e, const char **refused)
{
	struct identity *k = find_or_add(f, e);
	if (!k) {
		*refused = "the coordinator has no room for another worker";
		return NULL;
	}
	/* A quarantined worker stays known by the name and home it had. */
	if (!k->quarantined || strcmp(k->home, e->home) == 0)
		k->restarts = e->restarts;
	if (!k->quarantined) {
		identity_index_remove(&f->index, k);
		text_copy(k->name, sizeof k->name, e->name);
		text_copy(k->home, sizeof k->home, e->home);
		identity_index_add(&f->index, k);
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
	identity_index_fini(&f->index);
}

/* New names cost nothing, so at most IDENTITY_QUARANTINED quarantined entries are kept per certificate; beyond that
 * the one that has been away longest is released. */
void worker_registry_quarantine(struct farm *f, struct identity *who)
{
	struct identity *oldest = NULL;
	uint32_t count = 0;
	for (uint32_t i = 0; i < f->known_count; i++) {
		struct identity *k = f->known[i];
		if (!k->quarantined || k == who || k->certificate_id != who->certificate_id)
			continue;
		count++;
		if (k->uses == 0 && (!oldest || k->seen < oldest->seen))
			oldest = k;
	}
	if (count >= IDENTITY_QUARANTINED && oldest)
		oldest->quarantined = false;
	who->quarantined = true;
}

void worker_registry_restore_quarantined(struct farm *f, const struct event_join *e, const char *text)
{
	const char *refused;
	struct identity *k = worker_registry_use(f, e, &refused);
	if (!k)
		return;
	text_copy(k->text, sizeof k->text, text);
	worker_registry_quarantine(f, k);
	worker_registry_drop(f, k);
}
