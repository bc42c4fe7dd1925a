/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/extend_plan.h"

#include <math.h>
#include <string.h>

/* Returns the number of samples or mutations requested for the job so far, counted as by plan_make; or the number
 * done, if there was no bound on them or it came from a cancelled extension. */
static uint64_t requested_total(const struct plan *p, const struct plan_request *request,
				const struct extension_basis *basis)
{
	uint64_t pixels = (uint64_t)p->crop_width * p->crop_height, total = 0, rounds = basis->rounds;
	if (p->rounds == UINT64_MAX || basis->was_extension_cancelled)
		return p->kind == PLAN_CHAINS ? rounds * plan_round_mutations(p)
					      : rounds * p->groups * p->epoch * pixels;
	if (request->spp)
		total = request->spp * pixels;
	return request->mutations && (!total || request->mutations < total) ? request->mutations : total;
}

static int add_samples(const struct plan *p, const struct extension *x, const struct extension_basis *basis,
		       struct plan_request *request, struct error *e)
{
	uint64_t pixels = (uint64_t)p->crop_width * p->crop_height, added, total;
	if (p->rounds == UINT64_MAX && !basis->has_ended)
		return error_set(e, EINVAL, "it has no bound on samples: give a time or an error");
	if (__builtin_mul_overflow(x->spp, pixels, &added) || __builtin_add_overflow(added, x->mutations, &added) ||
	    __builtin_add_overflow(added, requested_total(p, request, basis), &total))
		return error_set(e, EINVAL, "more samples than can be counted");
	request->mutations = total;
	return 0;
}

/* Keeps the counts that were chosen when the plan was made. */
static void keep_chosen_counts(const struct plan *p, struct plan_request *request)
{
#define X(name) request->name = p->name;
	PLAN_CHOSEN_NUMBERS(X)
#undef X
}

static bool has_same_bits(const struct plan *a, const struct plan *b)
{
#define X(name) a->name == b->name &&
	return PLAN_SHARED_NUMBERS(X) a->kind == b->kind &&
	       memcmp(a->integrator, b->integrator, sizeof a->integrator) == 0 &&
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

int extend_plan(const struct plan *p, const struct extension *x, const struct extension_basis *basis,
		struct plan_request *request, struct plan *out, struct error *e)
{
	bool adds_samples = x->spp || x->mutations, adds_time = x->seconds > 0, sets_error = x->target_error > 0;
	int rc = extend_check(x, e);
	if (rc)
		return rc;
	if (sets_error && basis->has_ended && basis->error <= x->target_error)
		return error_set(e, EINVAL, "its error is already %.3g %%", 100 * basis->error);
	uint64_t total = requested_total(p, request, basis);
	bool bounded = p->rounds != UINT64_MAX && !basis->was_extension_cancelled;
	request->spp = 0;
	request->mutations = bounded ? total : 0;
	rc = adds_samples ? add_samples(p, x, basis, request, e) : 0;
	if (rc)
		return rc;
	if (!adds_samples && basis->has_ended && bounded && basis->rounds >= p->rounds)
		request->mutations = 0; /* this bound is met, and lifted */
	request->seconds = p->seconds;
	if (adds_time)
		request->seconds =
			(p->seconds > 0 && !basis->was_extension_cancelled ? p->seconds : basis->seconds) + x->seconds;
	else if (basis->was_extension_cancelled || (basis->has_ended && p->seconds > 0 && basis->seconds >= p->seconds))
		request->seconds = 0;
	request->target_error = p->target_error;
	if (sets_error)
		request->target_error = x->target_error;
	else if (basis->was_extension_cancelled || (basis->has_ended && basis->error <= p->target_error))
		request->target_error = 0;
	keep_chosen_counts(p, request);
	rc = plan_make(request, out, e);
	if (!rc && !has_same_bits(p, out))
		rc = error_set(e, EINVAL, "its plan was made by a version with different rules: submit it again");
	if (!rc && out->rounds < p->rounds && !basis->has_ended)
		rc = error_set(e, EINVAL, "it would end earlier than it does");
	if (!rc && out->rounds <= basis->rounds)
		rc = error_set(e, EINVAL, "it already has as many samples");
	if (!rc && out->seconds > 0 && basis->has_ended && basis->seconds >= out->seconds)
		rc = error_set(e, EINVAL, "it has already taken %.3g s", basis->seconds);
	return rc;
}
