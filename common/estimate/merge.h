/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The steps that the coordinator and hslt-render share: collect the bootstrap in any order, draw the chains' seeds from
 * it, and decide after complete rounds whether the job is done. All results depend on the plan and on batches only, so
 * both give the same bits. One thread at a time.
 */
#ifndef COMMON_ESTIMATE_MERGE_H
#define COMMON_ESTIMATE_MERGE_H

#include "common/base/checked_file.h"
#include "common/estimate/canvas_image.h"

struct bootstrap;

int bootstrap_new(struct bootstrap **s, const struct plan *p, struct error *e);
void bootstrap_free(struct bootstrap *s);
/* Adds a batch of kind LEASE_BOOTSTRAP that passed batch_check; copies what it needs. -EEXIST: added before. */
int bootstrap_add(struct bootstrap *s, const struct batch *b, struct error *e);
bool bootstrap_has(const struct bootstrap *s, uint32_t group, uint32_t part);
uint32_t bootstrap_missing(const struct bootstrap *s); /* leases */
uint32_t bootstrap_done(const struct bootstrap *s);
/*
 * Saves the leases that have been added to a file, and loads them into an empty bootstrap of the same plan. What the
 * file contains is checked by batch_check(); -EBADMSG. Little endian: the number of leases, 4 bytes; then each:
 *
 * offset  bytes  contents
 * 0       8      group, part
 * 8       128    counters, 8 bytes each (enum batch_counter)
 * 136     24     doubles: independent_sum, independent_square, beyond_sum of struct batch
 * 160     160    doubles by path class
 * 320            weights, floats: as many as the plan has for the lease
 */
int bootstrap_save(const struct bootstrap *s, struct checked_file *f, struct error *e);
int bootstrap_load(struct bootstrap *s, struct checked_file *f, struct error *e);
/* Once complete: b by group and pooled, from the weights in index order. */
void bootstrap_merge(const struct bootstrap *s, struct bootstrap_result *r);
/* Seeds of all chains of a group, chains / groups of them: the k-th belongs to chain group + groups * k, and those
 * of a lease are plan_chain_range(). If the group's bootstrap is black, all are UINT64_MAX: such a chain looks for
 * light by independent proposals. */
void bootstrap_seeds(const struct bootstrap *s, uint32_t group, uint64_t *index);
/* Adds to a new canvas the independent sums of all batches, and the tail index of the samples for b's error. */
void bootstrap_to_canvas(struct bootstrap *s, struct canvas *c);

/* The bound that ended the job. Time and error are checked after complete rounds only. */
enum merge_end { MERGE_GOES_ON, MERGE_ROUNDS, MERGE_TIME, MERGE_ERROR, MERGE_BLACK };
const char *merge_end_name(enum merge_end end, bool black); /* as in the header: "target-error" */

/*
 * The rounds at which the error is estimated: a geometric schedule (1 2 3 4 5 6 7 8 10 12 15 ...) times the number of
 * rounds after which an estimate costs less than 1 % of the work since the last one. It depends on the plan's counts
 * only, so bits do not depend on the machine. A single estimate below the target ends the job: the upper end of the
 * interval has to be below, and estimates that share most of their samples are not independent chances to stop by luck
 * (measured in tests/common/estimate/test_merge.c).
 */
bool merge_error_due(const struct plan *p, uint64_t rounds);
/* The first round after this one at which the error is estimated. */
uint64_t merge_error_next(const struct plan *p, uint64_t rounds);
/*
 * Whether a render ends because its image is black after these rounds: a black image has no error, so a target error
 * would never end it, and there is no other bound. Samples only, once they are as many as a bootstrap of chains has by
 * default to find light.
 */
bool merge_ends_black(const struct plan *p, uint64_t rounds, bool black);
/* img: the image of the complete rounds, or NULL if the error is not due. */
enum merge_end merge_end_of(const struct plan *p, uint64_t rounds, double seconds, const struct canvas_image *img);
/* Seconds until the plan's time ends the job, at the first complete round after it: after `seconds`, with this many
 * rounds done, parts of rounds included (negative during the bootstrap), at this speed. A speed of 0 is unknown; what
 * is returned then does not include the last round, or is NAN when the time is over. */
double merge_seconds_left(const struct plan *p, double seconds, double rounds, double rounds_per_second);

#endif
