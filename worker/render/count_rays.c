/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Counts the rays of a pilot, one group after the other: a short bootstrap lease, then a lease of a single chain that
 * starts from one of the bootstrap's samples. Starting a chain is as much work as a bootstrap sample, so only the
 * chain's second epoch is counted. For samples, the bootstrap alone is counted, because its samples are as much work.
 *
 * Failures: those of a lease; the counts are lost.
 */
#include "worker/render/count_rays.h"

#include "common/plan/resample.h"

enum {
	GROUPS = PLAN_GROUPS_MAX,
	SAMPLES_PER_GROUP = 16, /* samples of a group's bootstrap; one of them also looks for paths that are too long */
	MUTATIONS_PER_EPOCH = 32,
	ENOUGH_RAYS = 1 << 18, /* rays that are enough, for bootstrap samples and for mutations each */
	GROUPS_MIN = 2,
};

struct ray_count {
	double rays, steps;
};

struct ray_counter {
	const struct world *w;
	struct plan plan;
	struct ray_count bootstrap, chain;
	struct error *e;
};

/* Makes the pilot's plan. Its random numbers are not drawn by the render, so that a render is independent of its
 * pilot. */
static int make_plan(const struct plan_request *r, struct plan *p, struct error *e)
{
	struct plan_request q = *r;
	q.seed = ~r->seed;
	q.spp = 0;
	q.mutations = 1;
	q.seconds = q.target_error = q.speed = q.bandwidth = 0;
	q.groups = GROUPS;
	q.parts = 1;
	q.chains = r->kind == PLAN_CHAINS ? GROUPS : 0;
	q.bootstrap = (uint64_t)GROUPS * SAMPLES_PER_GROUP;
	q.epoch = r->kind == PLAN_CHAINS ? MUTATIONS_PER_EPOCH : 1;
	return plan_make(&q, p, e);
}

static void add_counts(struct ray_count *c, const struct batch *b)
{
	c->rays += (double)batch_ray_count(b->counters);
	c->steps += (double)b->counters[COUNT_SAMPLES];
}

static int run_lease(struct ray_counter *c, enum lease_kind kind, uint32_t group, uint64_t epoch,
		     const struct lease_input *in, struct batch *b)
{
	const struct lease_key k = {.kind = kind, .group = group, .epoch = epoch};
	enum lease_outcome result;
	return render_lease(c->w, &c->plan, &k, in, NULL, &result, b, c->e);
}

static int count_chain(struct ray_counter *c, uint32_t group, uint64_t seed)
{
	struct lease_input in = {.chain_count = 1, .seeds = &seed};
	struct batch first, second;
	int rc = run_lease(c, LEASE_RENDER, group, 0, &in, &first);
	if (rc)
		return rc;
	in = (struct lease_input){.chain_count = 1, .states = first.states};
	rc = run_lease(c, LEASE_RENDER, group, 1, &in, &second);
	batch_fini(&first);
	if (rc)
		return rc;
	add_counts(&c->chain, &second);
	batch_fini(&second);
	return 0;
}

static int count_group(struct ray_counter *c, uint32_t group)
{
	struct batch b;
	uint64_t seed;
	int rc = run_lease(c, LEASE_BOOTSTRAP, group, 0, NULL, &b);
	if (rc)
		return rc;
	add_counts(&c->bootstrap, &b);
	bool has_seed = plan_resample(&c->plan, group, b.weights, b.weight_count, plan_resample_offset(&c->plan, group),
				      1, &seed);
	batch_fini(&b);
	if (c->plan.kind != PLAN_CHAINS || !has_seed || c->chain.rays >= ENOUGH_RAYS)
		return 0;
	return count_chain(c, group, seed);
}

int render_count_rays(const struct world *w, const struct plan_request *r, struct plan_rays *out, struct error *e)
{
	struct ray_counter c = {.w = w, .e = e};
	int rc = make_plan(r, &c.plan, e);
	*out = (struct plan_rays){0, 0};
	for (uint32_t g = 0; !rc && g < GROUPS && (g < GROUPS_MIN || c.bootstrap.rays < ENOUGH_RAYS); g++)
		rc = count_group(&c, g);
	if (rc)
		return rc;
	out->bootstrap = c.bootstrap.rays / c.bootstrap.steps;
	out->step = c.chain.steps > 0 ? c.chain.rays / c.chain.steps : out->bootstrap;
	return 0;
}
