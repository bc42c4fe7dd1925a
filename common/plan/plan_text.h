/* SPDX-License-Identifier: Apache-2.0 */
/* A plan as text: what was chosen and why, the options that make the same bits again, and texts that a plan holds. */
#ifndef COMMON_PLAN_PLAN_TEXT_H
#define COMMON_PLAN_PLAN_TEXT_H

#include "common/plan/plan.h"

/* "1024 chains in 16 groups ..., 8 rounds ...": what was chosen and by which rule; for logs. */
void plan_describe(const struct plan *p, char *text, size_t size);
/* What plan_make changed of the values asked for ("chains 100 -> 128: ..."); empty: nothing. */
void plan_describe_changes(const struct plan_request *r, const struct plan *p, char *text, size_t size);
/* The options that make the same bits again when `rounds` rounds are done, whatever bound ended this job. */
void plan_options(const struct plan *p, uint64_t rounds, char *text, size_t size);

#endif
