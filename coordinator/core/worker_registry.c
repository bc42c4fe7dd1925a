/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/worker_registry.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/core/identity_index.h"

#include <string.h>

struct identity *worker_registry_find(const struct farm *f, const struct event_join *e)
{
	struct identity *k = *e->home ? identity_index_find_by_home(&f->identity_index, e->certificate, e->home) : NULL;
	return k ? k : identity_index_find_by_name(&f->identity_index, e->certificate, e->name);
}

/* Whether a is to be forgotten before b to make room for a newcomer with this certificate: entries with the same
 * certificate go first, quarantined ones last. */
static bool is_evicted_before(const struct identity *a, const struct identity *b, const char *certificate)
{
	bool a_own = strcmp(a->certificate, certificate) == 0, b_own = strcmp(b->certificate, certificate) == 0;
	return a->is_quarantined != b->is_quarantined ? b->is_quarantined
	       : a_own != b_own			      ? a_own
						      : a->last_seen < b->last_seen;
}

/* Returns an entry for a newcomer that is not in the index, either new or of a worker that is forgotten for it. NULL:
 * all entries are in use, or out of memory. */
static struct identity *allocate_entry(struct farm *f, const char *certificate)
{
	struct identity *oldest = NULL;
	if (f->registry_count < f->registry_capacity) {
		struct identity *k = mem_alloc(1, sizeof *k);
		if (k) {
			k->registry_index = f->registry_count++;
			f->registry[k->registry_index] = k;
		}
		return k;
	}
	for (uint32_t i = 0; i < f->registry_count; i++)
		if (f->registry[i]->reference_count == 0 &&
		    (!oldest || is_evicted_before(f->registry[i], oldest, certificate)))
			oldest = f->registry[i];
	if (oldest)
		identity_index_remove(&f->identity_index, oldest);
	return oldest;
}

/* Returns the number of this certificate if an entry has it, `default_id` if not. */
static uint64_t find_certificate_id(const struct farm *f, const char *certificate, uint64_t default_id)
{
	for (uint32_t i = 0; i < f->registry_count; i++)
		if (f->registry[i]->certificate_id && strcmp(f->registry[i]->certificate, certificate) == 0)
			return f->registry[i]->certificate_id;
	return default_id;
}

/* Returns the existing entry, or a new one; NULL: no room. */
static struct identity *find_or_add(struct farm *f, const struct event_join *e)
{
	struct identity *k = worker_registry_find(f, e);
	if (k || !(k = allocate_entry(f, e->certificate)))
		return k;
	*k = (struct identity){.registry_index = k->registry_index,
			       .id = ++f->last_identity_id,
			       .lease_window = PEER_INITIAL_WINDOW,
			       .restarts = e->restarts,
			       .last_seen = f->now};
	k->certificate_id = find_certificate_id(f, e->certificate, k->id);
	text_copy(k->certificate, sizeof k->certificate, e->certificate);
	text_copy(k->name, sizeof k->name, e->name);
	text_copy(k->home, sizeof k->home, e->home);
	identity_index_add(&f->identity_index, k);
	return k;
}

uint64_t worker_registry_recall(struct farm *f, const struct event_join *e)
{
	struct identity *k = find_or_add(f, e);
	/* Results may be of different starts of the worker; the latest start counts. */
	if (k && !k->contact_count && strcmp(k->home, e->home) == 0 && k->restarts < e->restarts)
		k->restarts = e->restarts;
	return k ? k->id : 0;
}

struct identity *worker_registry_acquire(struct farm *f, const struct event_join *e, const char **refusal)
{
	struct identity *k = find_or_add(f, e);
	if (!k) {
		*refusal = "the coordinator has no room for another worker";
		return NULL;
	}
	/* A quarantined worker stays known by the name and home it had. */
	if (!k->is_quarantined || strcmp(k->home, e->home) == 0)
		k->restarts = e->restarts;
	if (!k->is_quarantined) {
		identity_index_remove(&f->identity_index, k);
		text_copy(k->name, sizeof k->name, e->name);
		text_copy(k->home, sizeof k->home, e->home);
		identity_index_add(&f->identity_index, k);
	}
	k->last_seen = f->now;
	k->contact_count++;
	k->reference_count++;
	return k;
}

void worker_registry_release(struct farm *f, struct identity *identity)
{
	identity->reference_count--;
	identity->last_seen = f->now;
}

void worker_registry_free(struct farm *f)
{
	for (uint32_t i = 0; i < f->registry_count; i++)
		mem_free(f->registry[i]);
	mem_free(f->registry);
	identity_index_fini(&f->identity_index);
}

/* New names cost nothing, so at most IDENTITY_QUARANTINED_MAX quarantined entries are kept per certificate; beyond that
 * the one that has been away longest is released. */
void worker_registry_quarantine(struct farm *f, struct identity *identity)
{
	struct identity *oldest = NULL;
	uint32_t count = 0;
	for (uint32_t i = 0; i < f->registry_count; i++) {
		struct identity *k = f->registry[i];
		if (!k->is_quarantined || k == identity || k->certificate_id != identity->certificate_id)
			continue;
		count++;
		if (k->reference_count == 0 && (!oldest || k->last_seen < oldest->last_seen))
			oldest = k;
	}
	if (count >= IDENTITY_QUARANTINED_MAX && oldest)
		oldest->is_quarantined = false;
	identity->is_quarantined = true;
}

void worker_registry_restore(struct farm *f, const struct event_join *e, const char *text)
{
	const char *refusal;
	struct identity *k = worker_registry_acquire(f, e, &refusal);
	if (!k)
		return;
	text_copy(k->last_fault, sizeof k->last_fault, text);
	worker_registry_quarantine(f, k);
	worker_registry_release(f, k);
}
