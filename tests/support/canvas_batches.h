/* SPDX-License-Identifier: Apache-2.0 */
/* Plans and batches for tests of canvases, and the random numbers that fill them. One thread. */
#ifndef TESTS_SUPPORT_CANVAS_BATCHES_H
#define TESTS_SUPPORT_CANVAS_BATCHES_H

#include "common/film/batch.h"
#include "common/film/canvas.h"
#include "common/plan/plan.h"

extern uint64_t canvas_random_state; /* state of a xorshift generator; not 0 */
uint64_t canvas_random_next(void);
double canvas_random_uniform(void); /* in [0, 1) */
double canvas_random_normal(void);

/* Returns a plan with a crop of that size, at an offset. */
struct plan canvas_test_plan(enum plan_kind kind, uint32_t width, uint32_t height, uint32_t groups, uint32_t parts);
/* Returns the i-th tile of the film, with pixels from `value`. */
struct tile canvas_test_tile(const struct plan *p, uint32_t i, float (*value)(void));
/* Returns the batch of a render lease with the first `tiles` tiles of the film, with pixels from `value`; batch_fini
 * frees it. */
struct batch canvas_test_batch(const struct plan *p, uint64_t epoch, uint32_t group, uint32_t part, uint32_t tiles,
			       float (*value)(void));
float canvas_test_one(void);
uint64_t canvas_merged_leases(const struct canvas *c); /* number of render leases merged, including open rounds */

#endif
