/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job as it is displayed: on the wire (JobStatus), on the status socket (JSON), in the spool (its record). Pure
 * except for memory; the loop's thread.
 */
#ifndef COORDINATOR_JOB_VIEW_H
#define COORDINATOR_JOB_VIEW_H

#include "common/wire/envelope.h"
#include "coordinator/core/farm.h"
#include "coordinator/store/record.h"

#include <jansson.h>

/* Fields that only a live job has, besides its record; the columns are those of record_fields.h. A share counts
 * machines by priority; `reading` is the fraction of its stored data that has been read after a restart. */
#define VIEW_FIELDS(TEXT, NUMBER)                                                                 \
	NUMBER(real, rate, NULL, "rate", AT(rate), LIVE)                                          \
	NUMBER(known, eta, NULL, "eta", AT(eta), LIVE)                                            \
	NUMBER(known, eta_low, NULL, NULL, AT(eta_low), LIVE) /* valid if eta is known */         \
	NUMBER(known, eta_high, NULL, NULL, AT(eta_high), LIVE)                                   \
	NUMBER(u32, leases, NULL, "leases", AT(leases), LIVE)	 /* leases at workers */          \
	NUMBER(u32, workers, NULL, "workers", AT(workers), LIVE) /* that hold them */             \
	NUMBER(u32, machines, NULL, "machines", NOWHERE, LIVE)	 /* that could */                 \
	NUMBER(known, share, NULL, NULL, AT(share), LIVE)                                         \
	TEXT(place, 160, NULL, "place", AT(place), LIVE) /* in words */                           \
	NUMBER(known, reading, NULL, "reading", NOWHERE, KEPT)                                    \
	TEXT(waiting, 256, NULL, "waiting", NOWHERE, LIVE) /* why nothing is being done for it */ \
	TEXT(owners_place, 160, NULL, NULL, NOWHERE, LIVE) /* the same text for its owner */      \
	TEXT(owners_waiting, 256, NULL, NULL, NOWHERE, LIVE)

struct job_view {
	struct job_record record;
#define TEXT(member, size, key, shown, wire, core) char member[size];
#define NUMBER(kind, member, key, shown, wire, core) field_##kind member;
	VIEW_FIELDS(TEXT, NUMBER)
#undef TEXT
#undef NUMBER
	struct forecast_range halving_cpu, halving_seconds; /* valid if there are estimates */
};

void view_of_record(struct job_view *v, const struct job_record *r);
/* Adds the core's view of a live job to v, whose record has the job's names and times already. */
void view_add_status(struct job_view *v, const struct job_status *s);

/* For its owner, who must not learn about other owners' jobs. */
void view_hide_others(struct job_view *v);

void view_to_wire(const struct job_view *v, Farm__JobStatus *out); /* borrows v's texts */
struct view_looks {
	Farm__Look look[FORECAST_LOOKS], *at[FORECAST_LOOKS];
};
void view_looks_to_wire(const struct job_view *v, struct view_looks *looks, Farm__JobStatus *out); /* borrows both */
/* details: also what is long: effects, counters of strategies, classes of paths, estimates. */
json_t *view_to_json(const struct job_view *v, bool details);
json_t *view_peer_to_json(const struct peer_status *p, double now);
json_t *view_quarantined_to_json(const struct worker_status *w);
json_t *view_lease_to_json(const struct lease_status *l, const char *worker, double now);

#endif
