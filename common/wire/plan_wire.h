/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Converts plans, plan requests and lease keys to messages and back. The ..._from_wire functions return 0, or -EBADMSG
 * for values that do not fit into the structure; plan_from_wire also applies plan_check. Requests are checked further
 * by plan_make, and lease keys by their users. Any thread.
 */
#ifndef COMMON_WIRE_PLAN_WIRE_H
#define COMMON_WIRE_PLAN_WIRE_H

#include "common/film/batch.h"
#include "common/plan/plan.h"
#include "common/wire/envelope.h"

/* The ..._to_wire functions fill in a message that points to the texts of the structure. */
void plan_to_wire(const struct plan *p, Farm__Plan *out);
int plan_from_wire(const Farm__Plan *m, struct plan *p, struct error *e); /* ends with plan_check */

void plan_request_to_wire(const struct plan_request *r, Farm__PlanRequest *out);
int plan_request_from_wire(const Farm__PlanRequest *m, struct plan_request *r, struct error *e);

void lease_key_to_wire(const struct lease_key *k, Farm__LeaseKey *out);
int lease_key_from_wire(const Farm__LeaseKey *m, struct lease_key *k, struct error *e);

#endif
