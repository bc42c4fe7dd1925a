/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The record of a job, which the ledger keeps as JSON: enough to list the job and to fetch its result after a
 * restart. Pure except for memory.
 */
#ifndef COORDINATOR_STORE_RECORD_H
#define COORDINATOR_STORE_RECORD_H

#include "common/base/error.h"
#include "common/estimate/convergence.h"
#include "common/estimate/forecast.h"
#include "common/estimate/stated_error.h"
#include "common/estimate/strategy.h"
#include "common/exr/header.h"
#include "coordinator/core/job_fields.h"
#include "coordinator/store/job_field.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { RECORD_EFFECTS_MAX = 12288 };

struct job_record {
#define IN_RECORD(member) member;
#define IN_VIEW(member)
#define TEXT(member, size, in, by, key, shown, wire) in(char member[size])
#define NUMBER(kind, member, in, by, key, shown, wire) in(field_##kind member)
#define COUNT(member, by, key, shown, wire) uint64_t member;
	JOB_FIELDS(TEXT, NUMBER, COUNT, JOB_NO_FIELD)
#undef IN_RECORD
#undef IN_VIEW
#undef TEXT
#undef NUMBER
#undef COUNT
	struct job_counts counts;
	struct forecast_history looks;
	/* A JSON array of the effects that the scene needs, with reasons; "": not known, or too long. */
	char effects[RECORD_EFFECTS_MAX];
	uint64_t strategies[BATCH_STRATEGIES][STRATEGY_COUNTERS]; /* counters of the strategies in `mixture` */
	struct convergence convergence;				  /* statistics of the last image */
	struct path_class_energy classes[PATH_CLASSES];
};

/* Takes the counters of the merged batches, and notes about them. */
void record_set_counters(struct job_record *r, const struct plan *p, const struct canvas_counts *n, bool black,
			 double beyond_share);
void record_add_note(struct job_record *r, const char *text); /* appends to `note`; "": nothing to add */
void record_add_doubt(struct job_record *r); /* notes why the interval of the error is unknown, if it is */
void record_set_convergence(struct job_record *r, const struct canvas_image *img, const struct convergence *a);
/* Clears the record except for these three. */
void record_init(struct job_record *r, uint64_t id, const char *name, const char *owner);
/* Takes the error of an image; img must contain an estimate of it. */
void record_set_error(struct job_record *r, const struct canvas_image *img);
void record_set_effects(struct job_record *r, json_t *list);   /* takes over the reference; NULL: not known */
json_t *record_effects_to_json(const struct job_record *r);    /* a new array */
json_t *record_counts_to_json(const struct job_record *r);     /* a new object "counts" */
json_t *record_strategies_to_json(const struct job_record *r); /* a new array, see strategy_to_json */
/* *out is mem_alloc'd. Returns -ENOMEM, or -EINVAL if a text is not UTF-8. */
int record_to_json(const struct job_record *r, char **out, struct error *e);
/* Returns -EBADMSG if the text is damaged or no record, -EPROTO if it is of another version. */
int record_from_json(const char *text, size_t size, struct job_record *r, struct error *e);
bool record_is_ended(const struct job_record *r);

#endif
