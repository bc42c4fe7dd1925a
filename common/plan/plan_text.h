/* SPDX-License-Identifier: Apache-2.0 */
/* A plan as text: what was chosen and why, the options that reproduce the same bits, and texts inside a plan. */
#ifndef COMMON_PLAN_PLAN_TEXT_H
#define COMMON_PLAN_PLAN_TEXT_H

#include "common/plan/plan.h"

/* "1024 chains in 16 groups ..., 8 rounds ...": what was chosen, and by which rule; for logs. */
void plan_describe(const struct plan *p, char *text, size_t size);
/* What plan_make changed in the request ("chains 100 -> 128: ..."); empty: nothing. */
void plan_describe_changes(const struct plan_request *r, const struct plan *p, char *text, size_t size);
/* The options that reproduce the same bits after `rounds` rounds, whatever bound ended this job. */
void plan_options(const struct plan *p, uint64_t rounds, char *text, size_t size);

#endif
