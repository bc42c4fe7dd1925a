/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job as it is displayed on the wire (JobStatus) and on the status socket (JSON). Pure except for memory; the
 * loop's thread.
 */
#ifndef COORDINATOR_LIVE_JOB_VIEW_H
#define COORDINATOR_LIVE_JOB_VIEW_H

#include "common/wire/envelope.h"
#include "coordinator/core/farm.h"
#include "coordinator/store/record.h"

#include <jansson.h>

struct job_view {
	struct job_record record;
#define IN_RECORD(member)
#define IN_VIEW(member) member;
#define TEXT(member, size, in, by, key, shown, wire) in(char member[size])
#define NUMBER(kind, member, in, by, key, shown, wire) in(field_##kind member)
	JOB_FIELDS(TEXT, NUMBER, JOB_NO_FIELD, JOB_NO_FIELD)
#undef IN_RECORD
#undef IN_VIEW
#undef TEXT
#undef NUMBER
	struct forecast_range halving_cpu, halving_seconds; /* valid if there are estimates */
};

/* Starts a view with a job's record. */
void view_from_record(struct job_view *v, const struct job_record *r);
/* Adds the core's values of a live job to a view whose record has the job's names and times already. */
void view_add_status(struct job_view *v, const struct job_status *s);

/* Replaces the texts by those for the owner, who must not learn about other owners' jobs. */
void view_hide_other_owners(struct job_view *v);

void view_to_wire(const struct job_view *v, Farm__JobStatus *out); /* borrows v's texts */
struct view_looks {
	Farm__Look items[FORECAST_LOOKS_MAX], *pointers[FORECAST_LOOKS_MAX];
};
/* Borrows v's texts and `looks`. */
void view_looks_to_wire(const struct job_view *v, struct view_looks *looks, Farm__JobStatus *out);
/* details: include the long parts: effects, counters of strategies, classes of paths, estimates. */
json_t *view_to_json(const struct job_view *v, bool details);
json_t *view_peer_to_json(const struct peer_status *p, double now);
json_t *view_quarantined_to_json(const struct worker_status *w);
json_t *view_lease_to_json(const struct lease_status *l, const char *worker, double now);

#endif
