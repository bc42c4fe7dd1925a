/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a snapshot of the farm says: copied on the loop's thread, which takes a few milliseconds for a thousand workers,
 * and made into JSON by any thread, which takes ten times as long.
 */
#ifndef COORDINATOR_STATUS_SNAPSHOT_H
#define COORDINATOR_STATUS_SNAPSHOT_H

#include "coordinator/peers/session.h"

#include <jansson.h>

struct snapshot;

struct snapshot *snapshot_take(const struct peers *s); /* NULL: no memory */
void snapshot_free(struct snapshot *n);
/* The loop's thread or another one; one at a time. NULL: no memory. */
json_t *snapshot_to_json(const struct snapshot *n);
json_t *snapshot_workers_to_json(const struct snapshot *n); /* a line of type "workers" */

#endif
