/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Hash table of the identities of workers (worker_registry.h). Finds one by its number, by certificate and home, or
 * by certificate and name, in a time that does not depend on how many there are: a lookup happens for each result of
 * a worker and, after a restart, for each group and part of a job. The entries belong to the caller. The members that
 * serve as keys must not change while an entry is in the index.
 */
#ifndef COORDINATOR_CORE_IDENTITY_INDEX_H
#define COORDINATOR_CORE_IDENTITY_INDEX_H

#include "coordinator/core/identity.h"

/* bucket_count: as many as entries are expected. Returns -ENOMEM if out of memory. */
int identity_index_init(struct identity_index *x, uint32_t bucket_count);
void identity_index_fini(struct identity_index *x);
void identity_index_add(struct identity_index *x, struct identity *k);
void identity_index_remove(struct identity_index *x, struct identity *k);

/* Each returns NULL if there is none. Of several identities with the same name, the one whose place is the highest is
 * returned. */
struct identity *identity_index_find_by_id(const struct identity_index *x, uint64_t id);
struct identity *identity_index_find_by_home(const struct identity_index *x, const char *certificate, const char *home);
struct identity *identity_index_find_by_name(const struct identity_index *x, const char *certificate, const char *name);

#endif
