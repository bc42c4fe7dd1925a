/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job as it is shown: on the wire (JobStatus), on the status socket (JSON), in the spool (its record). Pure but for
 * memory; the loop's thread.
 */
#ifndef COORDINATOR_JOB_VIEW_H
#define COORDINATOR_JOB_VIEW_H

#include "common/wire/envelope.h"
#include "coordinator/core/farm.h"
#include "coordinator/store/record.h"

#include <jansson.h>

/* A record, and what only a living job has. */
struct job_view {
	struct job_record record;
	double rate, eta;				    /* eta negative: not known */
	double eta_low, eta_high;			    /* where eta is known */
	struct forecast_range halving_cpu, halving_seconds; /* where there are looks */
	uint32_t leases;				    /* out at workers */
	uint32_t workers, machines;			    /* that hold them, that might */
	double share;	   /* machines that it would have by its priority; negative: not known */
	char place[160];   /* in words */
	double reading;	   /* share of what was stored of it that has been read; negative: it is not being read */
	char waiting[256]; /* why nothing is being done for it */
	char owners_place[160], owners_waiting[256]; /* the same for its owner */
};

void view_of_record(struct job_view *v, const struct job_record *r);
/* Puts the core's view of a living job into v, whose record has the job's names and times already. */
void view_add_status(struct job_view *v, const struct job_status *s);

/* For its owner, who is to know nothing of other owners' jobs. */
void view_hide_others(struct job_view *v);

void view_to_wire(const struct job_view *v, Farm__JobStatus *out); /* borrows v's texts */
struct view_looks {
	Farm__Look look[FORECAST_LOOKS], *at[FORECAST_LOOKS];
};
void view_looks_to_wire(const struct job_view *v, struct view_looks *looks, Farm__JobStatus *out); /* borrows both */
json_t *view_to_json(const struct job_view *v);
json_t *view_peer_to_json(const struct peer_status *p, double now);
json_t *view_aside_to_json(const struct worker_status *w);
json_t *view_lease_to_json(const struct lease_status *l, const char *worker, double now);

#endif
