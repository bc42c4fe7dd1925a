/* SPDX-License-Identifier: Apache-2.0 */
/* Lists of job ids. Any thread. */
#ifndef COORDINATOR_STORE_IDS_H
#define COORDINATOR_STORE_IDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Appends to a list of `count` that only this made larger; NULL is an empty one. mem_alloc'd. false: no memory. */
bool ids_add(uint64_t **ids, size_t *count, uint64_t id);

#endif
