/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Finds the identity of a worker (worker_registry.h) by its number, its home or its name, the last two together with
 * its certificate, in a time that does not depend on how many there are: each result of a worker is looked up, and each
 * group and part of a job after a restart. Chains of hashes; the entries belong to the caller, and what an entry is
 * found by must not change while it is in the index.
 */
#ifndef COORDINATOR_CORE_IDENTITY_INDEX_H
#define COORDINATOR_CORE_IDENTITY_INDEX_H

#include "coordinator/core/identity.h"

/* As many buckets as entries are expected. -ENOMEM. */
int identity_index_init(struct identity_index *x, uint32_t buckets);
void identity_index_fini(struct identity_index *x);
void identity_index_add(struct identity_index *x, struct identity *k);
void identity_index_remove(struct identity_index *x, struct identity *k);

/* NULL: none. Of several with that name the one whose place is the highest. */
struct identity *identity_index_id(const struct identity_index *x, uint64_t id);
struct identity *identity_index_home(const struct identity_index *x, const char *certificate, const char *home);
struct identity *identity_index_name(const struct identity_index *x, const char *certificate, const char *name);

#endif
