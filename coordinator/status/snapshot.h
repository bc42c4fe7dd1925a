/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A snapshot of the farm. It is copied on the loop's thread, which takes a few milliseconds for a thousand workers,
 * and made into JSON by any thread, which takes ten times as long.
 */
#ifndef COORDINATOR_STATUS_SNAPSHOT_H
#define COORDINATOR_STATUS_SNAPSHOT_H

#include "coordinator/peers/session.h"

#include <jansson.h>

struct snapshot;

struct snapshot *snapshot_new(const struct peers *s); /* NULL: out of memory */
void snapshot_free(struct snapshot *n);
/* Any thread, one at a time. NULL: out of memory. */
json_t *snapshot_to_json(const struct snapshot *n);
json_t *snapshot_workers_to_json(const struct snapshot *n); /* a line of type "workers" */

#endif
