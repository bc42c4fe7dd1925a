/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The steps of a job that the coordinator and hslt-render have in common: collecting the bootstrap in any order,
 * drawing the chains' seeds from it, and deciding after complete rounds whether the job is done. All results depend on
 * the plan and on batches only, so both programs give the same bits. One thread at a time.
 */
#ifndef COMMON_ESTIMATE_MERGE_H
#define COMMON_ESTIMATE_MERGE_H

#include "common/base/checked_file.h"
#include "common/estimate/canvas_image.h"

struct bootstrap;

int bootstrap_new(struct bootstrap **out, const struct plan *p, struct error *e);
void bootstrap_free(struct bootstrap *s);
/* Adds a batch of kind LEASE_BOOTSTRAP that has passed batch_check; the batch is not needed afterwards. Returns 0, or
 * -EEXIST if its lease has been added before. */
int bootstrap_add(struct bootstrap *s, const struct batch *b, struct error *e);
bool bootstrap_has_lease(const struct bootstrap *s, uint32_t group, uint32_t part); /* the lease has been added */
uint32_t bootstrap_missing_count(const struct bootstrap *s);			    /* number of leases not added yet */
uint32_t bootstrap_added_count(const struct bootstrap *s);			    /* number of leases added */
/*
 * bootstrap_save writes the leases that have been added to a file, and bootstrap_load reads them into an empty
 * bootstrap of the same plan; -EBADMSG if a lease of the file does not pass batch_check(). Format, little endian: the
 * number of leases, 4 bytes; then for each lease:
 *
 * offset  bytes  contents
 * 0       8      group, part
 * 8       128    counters, 8 bytes each (enum batch_counter)
 * 136     24     doubles: independent_sum, independent_square, overlong_sum of struct batch
 * 160     160    doubles by path class
 * 320            weights, floats: as many as the plan has for the lease
 */
int bootstrap_save(const struct bootstrap *s, struct checked_file *f, struct error *e);
int bootstrap_load(struct bootstrap *s, struct checked_file *f, struct error *e);
/* Computes b by group and pooled from a complete bootstrap. */
void bootstrap_compute_b(const struct bootstrap *s, struct bootstrap_result *r);
/* Draws the seeds of all chains of a group from a complete bootstrap: index[chains / groups], the k-th for chain
 * group + groups * k; plan_chain_range() tells which belong to a lease. If none of the group's bootstrap samples has
 * light, all seeds are UINT64_MAX: such chains search for light by independent proposals. */
void bootstrap_draw_seeds(const struct bootstrap *s, uint32_t group, uint64_t *index);
/* Adds the sums of a complete bootstrap to a new canvas, and the tail index of its samples, on which the error of b
 * depends. */
void bootstrap_add_to_canvas(struct bootstrap *s, struct canvas *c);

/* The bound that ended the job. Time and error are checked after complete rounds only. */
enum merge_end { MERGE_CONTINUES, MERGE_ROUNDS, MERGE_TIME, MERGE_ERROR, MERGE_BLACK };
/* Returns the name as in the header hslt:end, such as "target-error". black: the job ended with a black image. */
const char *merge_end_name(enum merge_end end, bool black);

/*
 * Returns whether the error is estimated after so many rounds: at a geometric schedule (1 2 3 4 5 6 7 8 10 12 15 ...)
 * times the number of rounds after which an estimate costs less than 1 % of the work since the last one. The schedule
 * depends on the plan's counts only, so bits do not depend on the machine. A single estimate below the target ends the
 * job. This is safe because the upper end of the interval is compared, and because successive estimates share most of
 * their samples and so are not independent chances to stop by luck (measured in tests/common/estimate/test_merge.c).
 */
bool merge_error_is_due(const struct plan *p, uint64_t rounds);
/* Returns the first number of rounds above this one at which the error is estimated. */
uint64_t merge_next_error_rounds(const struct plan *p, uint64_t rounds);
/*
 * Returns whether a render of samples ends because its image is black after so many rounds: a black image has no error,
 * so a target error would never end the render, if that is its only bound. It ends once it has as many samples as the
 * bootstrap of chains has by default.
 */
bool merge_ends_black(const struct plan *p, uint64_t rounds, bool black);
/* Returns the bound that is reached after `rounds` complete rounds and `seconds`. img: the image of these rounds, or
 * NULL if the error is not due. */
enum merge_end merge_find_end(const struct plan *p, uint64_t rounds, double seconds, const struct canvas_image *img);
/* Returns the seconds until the job ends by the plan's time, which is at the first complete round after it. seconds:
 * the job's time so far; rounds: rounds done, with the fraction of an incomplete one, negative during the bootstrap;
 * rounds_per_second: the speed. If the speed is 0, that is unknown, the result does not include the last round, and is
 * NAN when the time is over. */
double merge_seconds_remaining(const struct plan *p, double seconds, double rounds, double rounds_per_second);

#endif
