/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What is remembered of a job in its spool folder (jobs/jN/job.json): enough to list it and to fetch its result after a
 * restart. Pure but for memory.
 */
#ifndef COORDINATOR_STORE_RECORD_H
#define COORDINATOR_STORE_RECORD_H

#include "common/base/error.h"
#include "common/estimate/convergence.h"
#include "common/estimate/forecast.h"
#include "common/estimate/stated_error.h"
#include "common/estimate/strategy.h"
#include "coordinator/core/counts.h"

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { RECORD_EFFECTS = 12288 };

struct job_record {
	uint64_t id;
	char name[128];
	char integrator[16];
	char state[16];	   /* as in the status */
	char reason[16];   /* which bound ended it */
	char why[256];	   /* why it failed */
	char output[1024]; /* where the client wants it */
	char owner[72];	   /* the name in the certificate of who submitted it; "": there was none */
	int priority;
	uint32_t exit_code; /* of a program that waited */
	bool has_result;
	double cleared;		 /* its result was, s since 1970; 0: it was not */
	uint64_t extended;	 /* how often it went on after its end, as the ledger counts */
	double submitted, ended; /* seconds since 1970; 0: not yet */
	double ended_seen;	 /* s that had been seen to pass then (seen.h); negative: nobody knows */
	double progress;
	double rel_error;			   /* negative: not known */
	char rel_error_doubt[STATED_ERROR_TEXT];   /* why not, where an estimate was made; "" */
	double target_error;			   /* 0: none */
	double cpu_seconds, bootstrap_cpu_seconds; /* of all merged leases, of those of the bootstrap */
	double bootstrap_seconds;		   /* wall clock */
	struct forecast_history looks;
	uint64_t rounds, mutations, leases_merged;
	struct job_counts counts;
	double verify; /* share of its leases that two workers compute */
	uint64_t stuck,
		longest_stuck; /* times that a chain accepted nothing during an epoch; most rejections in a row */
	char mixture[PLAN_MUTATIONS_MAX];
	char note[STRATEGY_NOTE];
	char effects[RECORD_EFFECTS]; /* a JSON array: what the scene calls for, and why; "": not known, or too long */
	uint64_t strategy[BATCH_STRATEGIES][STRATEGY_COUNTERS]; /* of the mixture */
	struct convergence agreement;				/* of the last image that was made */
	double b;						/* of it, as the classes; 0: none was made */
	struct path_class_energy classes[PATH_CLASSES];
};

/* What the merged batches counted, and what is to be said about it. */
void record_take_counted(struct job_record *r, const struct plan *p, const struct canvas_counts *n, bool black,
			 double beyond_share);
void record_add_note(struct job_record *r, const char *text); /* "": nothing to say */
void record_add_doubt(struct job_record *r); /* once: why the interval of the error is not known, if so */
void record_take_convergence(struct job_record *r, const struct canvas_image *img, const struct convergence *a);
void record_begin_convergence(struct job_record *r);			      /* nothing is known */
void record_take_error(struct job_record *r, const struct canvas_image *img); /* of one that has an estimate */
void record_take_effects(struct job_record *r, json_t *list);		      /* takes the reference; NULL: none */
json_t *record_effects(const struct job_record *r);			      /* an array */
json_t *record_counts(const struct job_record *r);			      /* an object of its counts */
json_t *record_strategies(const struct job_record *r);			      /* an array: strategy_to_json */
int record_to_json(const struct job_record *r, char **text,
		   struct error *e); /* mem_alloc'd; -ENOMEM, -EINVAL: a text of it is not UTF-8 */
/* -EBADMSG when it is not a record, -EPROTO when it is one of another version. */
int record_from_json(const char *text, size_t size, struct job_record *r, struct error *e);
bool record_is_ended(const struct job_record *r);

#endif
