/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the coordinator and hslt-render do alike: gather the bootstrap in any order, draw the chains' seeds from it, and
 * decide after complete rounds whether the job is done. Depends on the plan and on batches alone, so that both sides
 * give the same bits. One thread at a time.
 */
#ifndef COMMON_ESTIMATE_MERGE_H
#define COMMON_ESTIMATE_MERGE_H

#include "common/base/checked_file.h"
#include "common/estimate/canvas_image.h"

struct bootstrap;

int bootstrap_new(struct bootstrap **s, const struct plan *p, struct error *e);
void bootstrap_free(struct bootstrap *s);
/* A batch that passed batch_check, of kind LEASE_BOOTSTRAP; copies what it needs. -EEXIST: here already. */
int bootstrap_add(struct bootstrap *s, const struct batch *b, struct error *e);
bool bootstrap_has(const struct bootstrap *s, uint32_t group, uint32_t part);
uint32_t bootstrap_missing(const struct bootstrap *s); /* leases */
uint32_t bootstrap_done(const struct bootstrap *s);
/* The leases that are here, to a file, and from one into a bootstrap of the same plan that has none yet. What a file
 * says is believed as far as batch_check() goes; -EBADMSG. */
int bootstrap_save(const struct bootstrap *s, struct checked_file *f, struct error *e);
int bootstrap_load(struct bootstrap *s, struct checked_file *f, struct error *e);
/* When complete: b by group and pooled, from the weights in index order. */
void bootstrap_merge(const struct bootstrap *s, struct bootstrap_result *r);
/* Seeds of all chains of a group, chains / groups of them: the k-th belongs to chain group + groups * k, and a lease's
 * are those of plan_chain_range(). Where the group's bootstrap is black all are
 * UINT64_MAX: such a chain looks for light by independent proposals. */
void bootstrap_seeds(const struct bootstrap *s, uint32_t group, uint64_t *index);
/* Adds the independent sums of all batches, and what their largest samples say of b's error, to a new canvas. */
void bootstrap_to_canvas(struct bootstrap *s, struct canvas *c);

/* Which bound ended the job. Time and error are looked at after complete rounds only. */
enum merge_end { MERGE_GOES_ON, MERGE_ROUNDS, MERGE_TIME, MERGE_ERROR };
const char *merge_end_name(enum merge_end end, bool black); /* as in the header: "target-error" */

/*
 * Rounds at which the error is looked at: a geometric ladder (1 2 3 4 5 6 7 8 10 12 15 ...) of as many rounds as it
 * takes for a look to cost less than 1 % of the work since the last one. A function of the plan's counts alone, so that
 * bits do not depend on the machine. One look below the target ends the job: it is the upper end of the interval that
 * has to be below, and looks that share most of their samples are not many chances for luck (measured in
 * tests/common/estimate/test_merge.c).
 */
bool merge_error_due(const struct plan *p, uint64_t rounds);
/* The first round after this one at which the error would be looked at. */
uint64_t merge_error_next(const struct plan *p, uint64_t rounds);
/* img: of the complete rounds, or NULL when the error is not due. */
enum merge_end merge_end_of(const struct plan *p, uint64_t rounds, double seconds, const struct canvas_image *img);

#endif
