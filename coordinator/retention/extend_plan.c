/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/extend_plan.h"

#include <math.h>
#include <string.h>

/* Returns the number of samples or mutations requested for the job so far, counted as by plan_make; or the number
 * done, if there was no bound on them or it came from a cancelled extension. */
static uint64_t total_of(const struct plan *p, const struct plan_request *asked, const struct extension_from *from)
{
	uint64_t pixels = (uint64_t)p->crop_width * p->crop_height, total = 0, rounds = from->rounds;
	if (p->rounds == UINT64_MAX || from->cut)
		return p->kind == PLAN_CHAINS ? rounds * plan_round_mutations(p)
					      : rounds * p->groups * p->epoch * pixels;
	if (asked->spp)
		total = asked->spp * pixels;
	return asked->mutations && (!total || asked->mutations < total) ? asked->mutations : total;
}

static int more_rounds(const struct plan *p, const struct extension *x, const struct extension_from *from,
		       struct plan_request *asked, struct error *e)
{
	uint64_t pixels = (uint64_t)p->crop_width * p->crop_height, more, total;
	if (p->rounds == UINT64_MAX && !from->ended)
		return error_set(e, EINVAL, "it has no bound on samples: give a time or an error");
	if (__builtin_mul_overflow(x->spp, pixels, &more) || __builtin_add_overflow(more, x->mutations, &more) ||
	    __builtin_add_overflow(more, total_of(p, asked, from), &total))
		return error_set(e, EINVAL, "more samples than can be counted");
	asked->mutations = total;
	return 0;
}

/* Keeps the counts that were chosen when the plan was made. */
static void keep_cut(const struct plan *p, struct plan_request *asked)
{
#define X(name) asked->name = p->name;
	PLAN_CHOSEN(X)
#undef X
}

static bool same_bits(const struct plan *a, const struct plan *b)
{
#define X(name) a->name == b->name &&
	return PLAN_BITS(X) a->kind == b->kind && memcmp(a->integrator, b->integrator, sizeof a->integrator) == 0 &&
	       memcmp(a->mutations, b->mutations, sizeof a->mutations) == 0 &&
	       memcmp(a->accuracy, b->accuracy, sizeof a->accuracy) == 0 &&
	       memcmp(a->effects, b->effects, sizeof a->effects) == 0;
#undef X
}

int extend_check(const struct extension *x, struct error *e)
{
	if (!isfinite(x->seconds) || !isfinite(x->target_error) || x->seconds < 0 || x->target_error < 0)
		return error_set(e, EINVAL, "an invalid time or error");
	if (!x->spp && !x->mutations && !(x->seconds > 0) && !(x->target_error > 0))
		return error_set(e, EINVAL, "a bound is missing: --spp, --mutations, --time or --target-error");
	return 0;
}

int extend_plan(const struct plan *p, const struct extension *x, const struct extension_from *from,
		struct plan_request *asked, struct plan *out, struct error *e)
{
	bool samples = x->spp || x->mutations, time = x->seconds > 0, error = x->target_error > 0;
	int rc = extend_check(x, e);
	if (rc)
		return rc;
	if (error && from->ended && from->error <= x->target_error)
		return error_set(e, EINVAL, "its error is already %.3g %%", 100 * from->error);
	uint64_t total = total_of(p, asked, from);
	bool bounded = p->rounds != UINT64_MAX && !from->cut;
	asked->spp = 0;
	asked->mutations = bounded ? total : 0;
	rc = samples ? more_rounds(p, x, from, asked, e) : 0;
	if (rc)
		return rc;
	if (!samples && from->ended && bounded && from->rounds >= p->rounds)
		asked->mutations = 0; /* this bound is met, and lifted */
	asked->seconds = p->seconds;
	if (time)
		asked->seconds = (p->seconds > 0 && !from->cut ? p->seconds : from->seconds) + x->seconds;
	else if (from->cut || (from->ended && p->seconds > 0 && from->seconds >= p->seconds))
		asked->seconds = 0;
	asked->target_error = p->target_error;
	if (error)
		asked->target_error = x->target_error;
	else if (from->cut || (from->ended && from->error <= p->target_error))
		asked->target_error = 0;
	keep_cut(p, asked);
	rc = plan_make(asked, out, e);
	if (!rc && !same_bits(p, out))
		rc = error_set(e, EINVAL, "its plan was made by a version with different rules: submit it again");
	if (!rc && out->rounds < p->rounds && !from->ended)
		rc = error_set(e, EINVAL, "it would end earlier than it does");
	if (!rc && out->rounds <= from->rounds)
		rc = error_set(e, EINVAL, "it already has as many samples");
	if (!rc && out->seconds > 0 && from->ended && from->seconds >= out->seconds)
		rc = error_set(e, EINVAL, "it has already taken %.3g s", from->seconds);
	return rc;
}
