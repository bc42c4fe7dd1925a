/* SPDX-License-Identifier: Apache-2.0 */
/* Plans and batches for tests of canvases, and the random numbers that fill them. One thread. */
#ifndef TESTS_SUPPORT_CANVAS_BATCHES_H
#define TESTS_SUPPORT_CANVAS_BATCHES_H

#include "common/film/batch.h"
#include "common/film/canvas.h"
#include "common/plan/plan.h"

extern uint64_t canvas_state; /* of a xorshift generator; not 0 */
uint64_t canvas_next(void);
double canvas_uniform(void); /* in [0, 1) */
double canvas_normal(void);

/* A plan whose crop has that size, with an offset. */
struct plan canvas_plan(enum plan_kind kind, uint32_t width, uint32_t height, uint32_t groups, uint32_t parts);
/* The i-th tile of the film, filled by `value`. */
struct tile canvas_tile(const struct plan *p, uint32_t i, float (*value)(void));
/* A render lease's batch with the first so many tiles of the film, filled by `value`; batch_fini frees it. */
struct batch canvas_batch(const struct plan *p, uint64_t epoch, uint32_t group, uint32_t part, uint32_t tiles,
			  float (*value)(void));
float canvas_one(void);
uint64_t canvas_merged(const struct canvas *c); /* render leases merged, including open rounds */

#endif
