/* SPDX-License-Identifier: Apache-2.0 */
/*
 * plan_make divides the work of a request into groups, parts, chains, epochs and rounds. All sizes are computed from
 * the request alone, never from the machine, the workers or the time of day, so that the same request always gives the
 * same plan. First come chains or samples with their groups and parts (make_chains, make_samples), then the length of
 * an epoch (choose_epoch) and the number of rounds, then the bootstrap. plan_check checks that a plan from the network
 * has every property that plan_make guarantees, so that its users need no further checks.
 *
 * Failures: -EINVAL with a sentence that names the number and its range.
 */
#include "common/plan/plan.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef unsigned __int128 uint128;

enum {
	DEFAULT_GROUPS = 16,
	GROUPS_MIN = 4,
	DEFAULT_PARTS = 4,
	DEFAULT_CHAINS = 1024,
	DEFAULT_BOOTSTRAP = 1000000,
	BOOTSTRAP_MIN = 16384,
	/* Minimum for plans of samples, whose bootstrap only sets the scale of the grid. */
	SAMPLES_BOOTSTRAP_MIN = 4096,
	SAMPLES_PER_BOOTSTRAP = 64, /* plans of samples have one bootstrap sample per 64 samples */
	SLOW_BOOTSTRAP_MIN = 256,   /* minimum if a bootstrap sample takes thousands of rays: each then connects as many
					 pairs of vertices, so that 256 samples find light if there is any */
	CHAINS_MIN = 16,
	MUTATIONS_PER_CHAIN = 2048,	       /* shorter jobs have fewer chains, not shorter ones */
	TARGET_ROUNDS = 8,		       /* rounds of a job whose number of mutations or samples is bounded */
	LEASE_SAMPLES_MAX = 1 << 20,	       /* chains: most mutations in one lease */
	UNBOUNDED_LEASE_SAMPLES_MAX = 1 << 18, /* the same if nothing bounds the job's mutations */
	UNBOUNDED_LEASE_SAMPLES_MIN = 1 << 13, /* the fewest mutations in one lease, in that case */
	LEASE_TARGET_SECONDS = 20,	       /* time that a lease should take, of one thread */
	LEASE_SAMPLES_SAFE = 1 << 15, /* so many never took longer than LEASE_TARGET_SECONDS in any scene tried */
	SPEED_DEFAULT = 50000,	      /* mutations or samples a second of one thread, if no pilot has measured it */
	RAYS_PER_SECOND = 2000000,    /* assumed of one thread; 1.5 to 3.5 million in the scenes of tests/bench */
	TYPICAL_RAYS = 8,	      /* mutations and samples that take more rays count as slow */
	PIXEL_BYTES = 12,	      /* of a tile on the wire */
	STRIP_SAMPLES_MAX = 1 << 17,  /* samples: most samples in one lease */
};
#define TOTAL_MAX (UINT64_C(1) << 62)
#define LEASE_SIZE_MAX (UINT64_C(1) << 40)
static const double max_unseen = 1e12;

static uint128 ceil_div_128(uint128 a, uint128 b)
{
	return (a + b - 1) / b;
}

static uint64_t ceil_div(uint64_t a, uint64_t b)
{
	return a / b + (a % b != 0);
}

static uint64_t clamp(uint64_t x, uint64_t low, uint64_t high)
{
	return x < low ? low : x > high ? high : x;
}

static uint64_t crop_pixels(const struct plan *p)
{
	return (uint64_t)p->crop_width * p->crop_height;
}

uint64_t plan_extended_pixels(const struct plan *p)
{
	return ((uint64_t)p->crop_width + 2 * (uint64_t)p->border) *
	       ((uint64_t)p->crop_height + 2 * (uint64_t)p->border);
}

uint64_t plan_round_mutations(const struct plan *p)
{
	if (p->kind == PLAN_CHAINS)
		return p->chains * p->epoch;
	return p->groups * p->epoch * plan_extended_pixels(p);
}

static struct plan_range part_range(uint64_t total, uint32_t part, uint32_t parts)
{
	return (struct plan_range){(uint64_t)((uint128)total * part / parts),
				   (uint64_t)((uint128)total * (part + 1) / parts)};
}

struct plan_range plan_bootstrap_range(const struct plan *p, uint32_t group, uint32_t part)
{
	uint64_t n = p->bootstrap / ((uint64_t)p->groups * p->parts);
	uint64_t lease = (uint64_t)group * p->parts + part;
	return (struct plan_range){lease * n, (lease + 1) * n};
}

struct plan_range plan_chain_range(const struct plan *p, uint32_t part)
{
	return part_range(p->chains / p->groups, part, p->parts);
}

struct plan_range plan_row_range(const struct plan *p, uint32_t part)
{
	return part_range((uint64_t)p->crop_height + 2 * (uint64_t)p->border, part, p->parts);
}

uint32_t plan_default_parts(const struct plan *p)
{
	if (p->kind == PLAN_CHAINS)
		return (uint32_t)clamp(ceil_div(p->chains, p->groups), 1, DEFAULT_PARTS);
	return (uint32_t)clamp((uint64_t)p->crop_height + 2 * (uint64_t)p->border, 1, DEFAULT_PARTS);
}

uint64_t plan_lease_mutations(const struct plan *p)
{
	if (p->kind == PLAN_CHAINS)
		return p->chains / (p->groups * p->parts) * p->epoch;
	uint64_t rows = ceil_div((uint64_t)p->crop_height + 2 * (uint64_t)p->border, p->parts);
	return rows * ((uint64_t)p->crop_width + 2 * (uint64_t)p->border) * p->epoch;
}

/* ---- making a plan */

static int check_film(const struct plan *p, struct error *e)
{
	if (p->width < 1 || p->height < 1 || p->width > PLAN_SIDE_MAX || p->height > PLAN_SIDE_MAX)
		return error_set(e, EINVAL, "the film is %ux%u pixels; each side must be 1 to %d", p->width, p->height,
				 PLAN_SIDE_MAX);
	if (p->crop_width < 1 || p->crop_height < 1 || p->crop_x >= p->width || p->crop_y >= p->height ||
	    p->crop_width > p->width - p->crop_x || p->crop_height > p->height - p->crop_y)
		return error_set(e, EINVAL,
				 "the crop %u,%u,%u,%u (x,y,width,height) does not lie inside the film of %ux%u",
				 p->crop_x, p->crop_y, p->crop_width, p->crop_height, p->width, p->height);
	if (crop_pixels(p) > PLAN_PIXELS_MAX)
		return error_set(e, EINVAL, "the image has %llu pixels; a render has at most %d: --crop renders a part",
				 (unsigned long long)crop_pixels(p), PLAN_PIXELS_MAX);
	if (p->border > PLAN_BORDER_MAX)
		return error_set(e, EINVAL, "the filter extends %u pixels beyond the image; at most %d", p->border,
				 PLAN_BORDER_MAX);
	return 0;
}

/* Sets *total to the number of samples or mutations requested, the least of the given bounds; 0: there is no bound. */
static int requested_total(const struct plan_request *r, const struct plan *p, uint64_t *total, struct error *e)
{
	*total = 0;
	if (r->spp) {
		uint128 n = (uint128)r->spp * crop_pixels(p);
		if (n > TOTAL_MAX)
			return error_set(e, EINVAL, "%llu samples per pixel are more than can be counted",
					 (unsigned long long)r->spp);
		*total = (uint64_t)n;
	}
	if (r->mutations > TOTAL_MAX)
		return error_set(e, EINVAL, "%llu mutations are more than can be counted",
				 (unsigned long long)r->mutations);
	if (r->mutations && (!*total || r->mutations < *total))
		*total = r->mutations;
	return 0;
}

static uint32_t power_of_two_below(uint64_t x)
{
	uint32_t p = 1;
	while (p <= x / 2 && p < 1u << 31)
		p *= 2;
	return p;
}

bool plan_needs_ray_count(const struct plan_request *r)
{
	bool is_fixed = r->bootstrap && r->epoch && (r->chains || r->kind == PLAN_SAMPLES);
	bool counted = r->spp || r->mutations;
	return !is_fixed && (!counted || r->seconds > 0 || r->target_error > 0);
}

/* Returns how many bootstrap samples one thread is assumed to draw in that time; 2^62 if no rays were counted. */
static uint64_t affordable_bootstrap(const struct plan_request *r, double seconds)
{
	return r->rays.bootstrap > 0 ? (uint64_t)fmin(seconds * RAYS_PER_SECOND / r->rays.bootstrap, 0x1p62)
				     : 1ull << 62;
}

uint64_t plan_affordable_bootstrap(const struct plan_request *r, double seconds)
{
	return clamp(affordable_bootstrap(r, seconds), SLOW_BOOTSTRAP_MIN, PLAN_BOOTSTRAP_MAX / 2);
}

/* Returns the ratio of the rays of a mutation or sample to the usual number; at least 1. */
static double slowness_factor(const struct plan_request *r)
{
	return fmax(1, r->rays.step / TYPICAL_RAYS);
}

/* Returns the mutations in a lease of a plan that only time or error end: 32 per pixel and round, divided among the
 * round's leases, but at least half a mutation per pixel of the crop: summing, sending and adding a lease's tiles costs
 * about 20 ns per pixel, which is 2 % of the time of half a mutation. Fewer than 2^13 are not worth sending; leases of
 * slow mutations are shorter in proportion. */
static uint64_t unbounded_lease_size(const struct plan_request *r, const struct plan *p)
{
	uint64_t leases = (uint64_t)p->groups * p->parts, per_pixel = crop_pixels(p) * 32 / leases,
		 min_size = crop_pixels(p) / 2;
	uint64_t lease = clamp(per_pixel > min_size ? per_pixel : min_size, UNBOUNDED_LEASE_SAMPLES_MIN,
			       UNBOUNDED_LEASE_SAMPLES_MAX);
	return (uint64_t)((double)lease / slowness_factor(r));
}

/* The next two functions return how many samples or mutations fit into a bound on time or on the error; infinity if
 * there is no such bound. They assume one thread at SPEED_DEFAULT, and independent pixels whose relative error is 100 %
 * per sample: conservative constants, because a plan must not depend on the machine. */
static double samples_in_time(const struct plan_request *r)
{
	return r->seconds > 0 ? SPEED_DEFAULT / slowness_factor(r) * r->seconds : INFINITY;
}

static double samples_for_error(const struct plan_request *r, const struct plan *p)
{
	return r->target_error > 0 ? (double)crop_pixels(p) / (r->target_error * r->target_error) : INFINITY;
}

enum epoch_rule { RULE_REQUESTED, RULE_ROUNDS, RULE_FILM, RULE_BOUND, RULE_LEASE_MAX, RULE_SECONDS, RULE_BANDWIDTH };

/* Returns the power of two nearest to x by ratio, from 1 to 2^40. */
static double nearest_power_of_two(double x)
{
	return x > 1 ? exp2(fmin(round(log2(x)), 40)) : 1;
}

/* Returns the mutations or samples in a lease if the epoch were 1. */
static uint64_t lease_unit(const struct plan *p)
{
	if (p->kind == PLAN_CHAINS)
		return p->chains / ((uint64_t)p->groups * p->parts);
	return ceil_div(plan_extended_pixels(p), p->parts);
}

static uint64_t lease_bytes(const struct plan *p)
{
	return crop_pixels(p) * PIXEL_BYTES / (p->kind == PLAN_CHAINS ? 1 : p->parts);
}

/* Chooses the length of an epoch by the rule that plan.h states above plan_needs_speed, and returns which part of the
 * rule decided. p's parts, groups and chains are set already. */
static enum epoch_rule choose_epoch(const struct plan_request *r, const struct plan *p, uint64_t total, uint64_t *epoch)
{
	bool chains = p->kind == PLAN_CHAINS;
	uint64_t unit = lease_unit(p), round = chains ? p->chains : p->groups * crop_pixels(p);
	uint64_t usual =
		chains ? LEASE_SAMPLES_MAX / unit : (uint64_t)STRIP_SAMPLES_MAX * p->parts / plan_extended_pixels(p);
	uint64_t max_epoch = clamp(usual, 1, LEASE_SAMPLES_MAX);
	enum epoch_rule rule = RULE_LEASE_MAX;
	if (r->epoch) {
		*epoch = r->epoch;
		return RULE_REQUESTED;
	}
	if (r->speed > 0) {
		max_epoch = (uint64_t)nearest_power_of_two(LEASE_TARGET_SECONDS * r->speed / (double)unit);
		rule = RULE_SECONDS;
	}
	double aim = (double)round * TARGET_ROUNDS, in_time = samples_in_time(r) / aim;
	double film = (double)(chains ? unbounded_lease_size(r, p) / unit : usual);
	double ideal = chains ? film : fmin(fmin(in_time, samples_for_error(r, p) / aim), film);
	double for_rounds = (double)ceil_div_128(total, (uint128)round * TARGET_ROUNDS);
	if (total)
		ideal = fmin(for_rounds, chains ? fmax(in_time, film) : in_time);
	*epoch = clamp((uint64_t)fmin(ideal, 0x1p62), 1, max_epoch);
	if (ideal <= (double)max_epoch)
		rule = total && ideal == for_rounds ? RULE_ROUNDS : ideal == film ? RULE_FILM : RULE_BOUND;
	double seconds = r->bandwidth > 0 ? (double)lease_bytes(p) / r->bandwidth : 0;
	double min_epoch = ceil(seconds * (r->speed > 0 ? r->speed : SPEED_DEFAULT) / (double)unit);
	uint64_t job_epochs = total ? (uint64_t)ceil_div_128(total, round) : LEASE_SIZE_MAX / unit;
	min_epoch = fmin(exp2(ceil(log2(fmax(min_epoch, 1)))), (double)job_epochs);
	if (min_epoch > (double)*epoch) {
		*epoch = (uint64_t)min_epoch;
		rule = RULE_BANDWIDTH;
	}
	return rule;
}

/* Returns the number of groups, if none are requested. A round of samples has at least one sample per pixel and
 * group; if two threads would not finish it within the job's time, there are fewer groups than usual, but at least
 * four, so that an error can be estimated. */
static uint32_t default_groups(const struct plan_request *r, const struct plan *p)
{
	if (r->groups)
		return r->groups;
	if (p->kind == PLAN_CHAINS || !(r->seconds > 0) || !(r->rays.step > 0))
		return DEFAULT_GROUPS;
	double samples = fmin(2.0 * RAYS_PER_SECOND * r->seconds / r->rays.step, 0x1p62);
	return (uint32_t)clamp((uint64_t)samples / plan_extended_pixels(p), GROUPS_MIN, DEFAULT_GROUPS);
}

void plan_describe_epoch(const struct plan_request *r, const struct plan *p, char *text, size_t size)
{
	struct plan q = *p;
	struct error e;
	uint64_t total, epoch;
	if (p->kind == PLAN_SAMPLES)
		q.groups = default_groups(r, p);
	enum epoch_rule rule = requested_total(r, p, &total, &e) ? RULE_REQUESTED : choose_epoch(r, &q, total, &epoch);
	const char *thing = p->kind == PLAN_CHAINS ? "mutations" : "samples";
	if (rule == RULE_ROUNDS)
		snprintf(text, size, "epochs: for %s%d rounds", p->rounds < TARGET_ROUNDS ? "at most " : "",
			 TARGET_ROUNDS);
	else if (rule == RULE_FILM)
		snprintf(text, size, "epochs: by the size of the film");
	else if (rule == RULE_BOUND)
		snprintf(text, size, "epochs: at least about %d rounds for the requested time or error", TARGET_ROUNDS);
	else if (rule == RULE_LEASE_MAX)
		snprintf(text, size, "epochs: the maximum of %s in a lease without a pilot", thing);
	else if (rule == RULE_SECONDS)
		snprintf(text, size, "epochs: leases of about %d s for a thread that makes %.3g %s per second",
			 LEASE_TARGET_SECONDS, r->speed, thing);
	else if (rule == RULE_BANDWIDTH)
		snprintf(text, size,
			 "epochs: %.3g MB of tiles per lease at %.3g MB/s for a thread that makes %.3g %s per second",
			 1e-6 * (double)lease_bytes(p), 1e-6 * r->bandwidth, r->speed > 0 ? r->speed : SPEED_DEFAULT,
			 thing);
	else if (size)
		*text = 0;
}

bool plan_needs_speed(const struct plan_request *r, const struct plan *p)
{
	return !r->epoch && !(r->speed > 0) && p->epoch > LEASE_SAMPLES_SAFE / lease_unit(p);
}

/* Chooses groups, chains, parts, epoch and rounds of a plan of chains. total: mutations requested; 0: no bound. */
static int make_chains(const struct plan_request *r, struct plan *p, uint64_t total, struct error *e)
{
	p->groups = r->groups ? r->groups : DEFAULT_GROUPS;
	uint64_t chains = r->chains;
	if (!chains)
		chains = total ? power_of_two_below(clamp(total / MUTATIONS_PER_CHAIN, CHAINS_MIN, DEFAULT_CHAINS))
			       : DEFAULT_CHAINS;
	if (!r->chains && r->seconds > 0) {
		uint64_t starts = affordable_bootstrap(r, r->seconds / 8);
		if (starts < chains)
			chains = power_of_two_below(clamp(starts, CHAINS_MIN, DEFAULT_CHAINS));
	}
	uint64_t per_group = ceil_div(chains, p->groups);
	p->parts = r->parts ? r->parts : (uint32_t)clamp(per_group, 1, DEFAULT_PARTS);
	if (r->parts && r->chains && (chains % p->groups || per_group % p->parts))
		return error_set(e, EINVAL, "%llu chains in %u groups cannot be divided into %u equal parts",
				 (unsigned long long)chains, p->groups, p->parts);
	chains = ceil_div(chains, (uint64_t)p->groups * p->parts) * p->groups * p->parts;
	if (chains > PLAN_CHAINS_MAX)
		return error_set(e, EINVAL, "%llu chains; at most %d are possible", (unsigned long long)chains,
				 PLAN_CHAINS_MAX);
	p->chains = (uint32_t)chains;
	uint64_t per_lease = lease_unit(p);
	choose_epoch(r, p, total, &p->epoch);
	if (p->epoch > LEASE_SIZE_MAX / per_lease)
		return error_set(e, EINVAL, "an epoch of %llu mutations is too long", (unsigned long long)p->epoch);
	p->rounds = total ? ceil_div(total, chains * p->epoch) : UINT64_MAX;
	return 0;
}

/* Like make_chains, for a plan of samples. total: samples of all pixels. */
static int make_samples(const struct plan_request *r, struct plan *p, uint64_t total, struct error *e)
{
	uint64_t rows = (uint64_t)p->crop_height + 2 * (uint64_t)p->border;
	uint64_t groups = default_groups(r, p),
		 parts = r->groups ? DEFAULT_PARTS : DEFAULT_PARTS * DEFAULT_GROUPS / groups;
	if (r->parts > rows)
		return error_set(e, EINVAL, "%llu rows cannot be divided into %u parts", (unsigned long long)rows,
				 r->parts);
	p->parts = r->parts ? r->parts : (uint32_t)clamp(rows, 1, parts);
	uint64_t spp = ceil_div(total, crop_pixels(p)); /* 0: no bound */
	p->groups = (uint32_t)groups;
	choose_epoch(r, p, total, &p->epoch);
	uint64_t k = p->epoch;
	if (k > LEASE_SIZE_MAX / plan_extended_pixels(p))
		return error_set(e, EINVAL, "an epoch of %llu samples per pixel is too long", (unsigned long long)k);
	p->rounds = UINT64_MAX;
	if (spp) {
		p->rounds = (uint64_t)ceil_div_128(spp, (uint128)groups * k);
		if (!r->epoch)
			k = (uint64_t)ceil_div_128(spp, (uint128)groups * p->rounds);
		if (!r->groups)
			groups = (uint64_t)ceil_div_128(spp, (uint128)p->rounds * k);
	}
	p->groups = (uint32_t)groups;
	p->epoch = k;
	p->chains = 0;
	return 0;
}

static int make_bootstrap(const struct plan_request *r, struct plan *p, uint64_t total, struct error *e)
{
	uint64_t n = r->bootstrap, leases = (uint64_t)p->groups * p->parts;
	double expected = fmin(total ? (double)total : INFINITY, samples_in_time(r));
	if (!n && p->kind == PLAN_SAMPLES)
		n = clamp((uint64_t)fmin(expected / SAMPLES_PER_BOOTSTRAP, BOOTSTRAP_MIN), SAMPLES_BOOTSTRAP_MIN,
			  BOOTSTRAP_MIN);
	else if (!n)
		n = clamp((uint64_t)fmin(expected / 8, DEFAULT_BOOTSTRAP), BOOTSTRAP_MIN, DEFAULT_BOOTSTRAP);
	if (!r->bootstrap && (r->seconds > 0 || r->target_error > 0)) {
		uint64_t affordable = plan_affordable_bootstrap(
			r, r->seconds > 0 ? r->seconds / 4 : LEASE_TARGET_SECONDS * (double)leases);
		n = n < affordable ? n : affordable;
	}
	if (n > PLAN_BOOTSTRAP_MAX / 2)
		return error_set(e, EINVAL, "%llu bootstrap samples; at most %d", (unsigned long long)n,
				 PLAN_BOOTSTRAP_MAX / 2);
	p->bootstrap = ceil_div(n, leases) * leases;
	return 0;
}

bool plan_request_is_bounded(const struct plan_request *r)
{
	return r->spp || r->mutations || r->seconds > 0 || r->target_error > 0;
}

int plan_make(const struct plan_request *r, struct plan *p, struct error *e)
{
	*p = (struct plan){.kind = r->kind, .seconds = r->seconds, .target_error = r->target_error};
#define X(name) p->name = r->name;
	PLAN_COPIED_NUMBERS(X)
#undef X
	memcpy(p->integrator, r->integrator, sizeof p->integrator);
	memcpy(p->mutations, r->mixture, strnlen(r->mixture, sizeof p->mutations));
	memcpy(p->accuracy, r->accuracy, strnlen(r->accuracy, sizeof p->accuracy));
	memcpy(p->effects, r->effects, strnlen(r->effects, sizeof p->effects));
	p->unseen = r->unseen;
	if (r->crop_width == 0) {
		p->crop_x = p->crop_y = 0;
		p->crop_width = r->width;
		p->crop_height = r->height;
	}
	uint64_t total = 0;
	int rc = check_film(p, e);
	if (rc == 0 && (r->groups > PLAN_GROUPS_MAX || r->parts > PLAN_PARTS_MAX))
		rc = error_set(e, EINVAL, "--%s %u is above %d", r->groups > PLAN_GROUPS_MAX ? "groups" : "parts",
			       r->groups > PLAN_GROUPS_MAX ? r->groups : r->parts,
			       r->groups > PLAN_GROUPS_MAX ? PLAN_GROUPS_MAX : PLAN_PARTS_MAX);
	if (rc == 0)
		rc = requested_total(r, p, &total, e);
	if (rc == 0 && !plan_request_is_bounded(r))
		rc = error_set(e, EINVAL, "no bound is given: --spp, --mutations, --time or --target-error");
	if (rc == 0)
		rc = r->kind == PLAN_CHAINS ? make_chains(r, p, total, e) : make_samples(r, p, total, e);
	if (rc == 0 && p->groups == 1 && p->rounds == UINT64_MAX && !(p->seconds > 0))
		rc = error_set(e, EINVAL,
			       "a single group of samples gives no error, so a target error alone would never end it: "
			       "give another bound as well, or render it with --groups 2 or more");
	if (rc == 0)
		rc = make_bootstrap(r, p, total, e);
	return rc ? rc : plan_check(p, e);
}

/* ---- checking a plan */

static int check_integrator(const struct plan *p, struct error *e)
{
	size_t n = strnlen(p->integrator, sizeof p->integrator);
	if (n == 0 || n == sizeof p->integrator)
		return error_set(e, EINVAL, "the integrator's name is empty or too long");
	if (strspn(p->integrator, "abcdefghijklmnopqrstuvwxyz0123456789_-") != n)
		return error_set(e, EINVAL, "the integrator's name has invalid characters");
	return 0;
}

static int check_mutations(const struct plan *p, struct error *e)
{
	int n = plan_strategy_count(p->mutations);
	if (n < 0)
		return error_set(
			e, EINVAL,
			"the mixture of mutations is not a list of up to %d names with weights in %d characters",
			PLAN_STRATEGIES_MAX, PLAN_MUTATIONS_MAX - 1);
	if (!plan_text_is_valid(p->mutations, sizeof p->mutations))
		return error_set(e, EINVAL, "the mixture of mutations has bytes after its text");
	if (!plan_text_is_valid(p->accuracy, sizeof p->accuracy) || !plan_text_is_valid(p->effects, sizeof p->effects))
		return error_set(e, EINVAL,
				 "the settings or the effects are not a text of letters, digits and @=,.:+-_");
	if (n > 0 && p->kind != PLAN_CHAINS)
		return error_set(e, EINVAL, "a plan without chains has a mixture of mutations");
	return 0;
}

static int check_division(const struct plan *p, struct error *e)
{
	if (p->kind != PLAN_CHAINS && p->kind != PLAN_SAMPLES)
		return error_set(e, EINVAL, "unknown kind of plan %d", (int)p->kind);
	if (p->groups < 1 || p->groups > PLAN_GROUPS_MAX || p->parts < 1 || p->parts > PLAN_PARTS_MAX)
		return error_set(e, EINVAL, "%u groups of %u parts: there can be 1 to %d groups of 1 to %d parts",
				 p->groups, p->parts, PLAN_GROUPS_MAX, PLAN_PARTS_MAX);
	uint64_t leases = (uint64_t)p->groups * p->parts;
	if (p->bootstrap < 1 || p->bootstrap > PLAN_BOOTSTRAP_MAX || p->bootstrap % leases)
		return error_set(e, EINVAL, "%llu bootstrap samples are not a multiple of %llu up to %d",
				 (unsigned long long)p->bootstrap, (unsigned long long)leases, PLAN_BOOTSTRAP_MAX);
	uint64_t unit;
	if (p->kind == PLAN_CHAINS) {
		if (p->chains < 1 || p->chains > PLAN_CHAINS_MAX || p->chains % leases)
			return error_set(e, EINVAL, "%u chains are not a multiple of %llu up to %d", p->chains,
					 (unsigned long long)leases, PLAN_CHAINS_MAX);
		unit = p->chains / leases;
		if (unit > PLAN_LEASE_CHAINS_MAX)
			return error_set(
				e, EINVAL,
				"%u chains in %u groups of %u parts are %llu per lease, of at most %d: choose more groups or parts",
				p->chains, p->groups, p->parts, (unsigned long long)unit, PLAN_LEASE_CHAINS_MAX);
	} else {
		if (p->chains)
			return error_set(e, EINVAL, "a plan without chains names %u of them", p->chains);
		if (p->parts > p->crop_height + 2 * p->border)
			return error_set(e, EINVAL, "%u parts of %u rows", p->parts, p->crop_height + 2 * p->border);
		unit = plan_extended_pixels(p);
	}
	if (p->epoch < 1 || p->epoch > LEASE_SIZE_MAX / unit)
		return error_set(e, EINVAL, "an epoch of %llu is not possible", (unsigned long long)p->epoch);
	return 0;
}

static int check_bounds(const struct plan *p, struct error *e)
{
	if (!isfinite(p->seconds) || p->seconds < 0 || !isfinite(p->target_error) || p->target_error < 0)
		return error_set(e, EINVAL, "the time and the target error must be finite and not negative");
	if (p->rounds == UINT64_MAX) {
		if (!(p->seconds > 0) && !(p->target_error > 0))
			return error_set(e, EINVAL, "the plan has no bound");
	} else if (p->rounds < 1 || (uint128)p->rounds * plan_round_mutations(p) > TOTAL_MAX * 2) {
		return error_set(e, EINVAL, "%llu rounds are not possible", (unsigned long long)p->rounds);
	}
	if (p->max_depth >= 1 && p->min_depth > p->max_depth)
		return error_set(e, EINVAL, "--min-depth %u is above --max-depth %u", p->min_depth, p->max_depth);
	if (p->max_depth < 1 || p->max_depth > PLAN_DEPTH_MAX)
		return error_set(e, EINVAL, "path lengths from %u to %u edges; at most %d", p->min_depth, p->max_depth,
				 PLAN_DEPTH_MAX);
	return 0;
}

static int check_unseen(const struct plan *p, struct error *e)
{
	for (int i = 0; i < PLAN_UNSEEN_COUNT; i++)
		if (!(p->unseen.mean_squares[i] >= 0 && p->unseen.mean_squares[i] <= max_unseen))
			return error_set(e, EINVAL, "unseen light of %g", p->unseen.mean_squares[i]);
	return 0;
}

int plan_check(const struct plan *p, struct error *e)
{
	int rc = check_integrator(p, e);
	if (rc == 0)
		rc = check_mutations(p, e);
	if (rc == 0)
		rc = check_film(p, e);
	if (rc == 0)
		rc = check_division(p, e);
	if (rc == 0)
		rc = check_unseen(p, e);
	return rc ? rc : check_bounds(p, e);
}

double plan_unseen_mean_square(const struct plan *p, double spp)
{
	const double *mean_squares = p->unseen.mean_squares, x = fmin(fmax(0.5 * log2(spp), 0), PLAN_UNSEEN_COUNT - 1);
	int i = (int)fmin(x, PLAN_UNSEEN_COUNT - 2);
	return mean_squares[i] + (x - i) * (mean_squares[i + 1] - mean_squares[i]);
}

/* ---- texts ---- */

#define TEXT_CHARACTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789@=,.:+-_"

bool plan_text_is_valid(const char *text, size_t size)
{
	size_t length = strnlen(text, size);
	if (length == size || strspn(text, TEXT_CHARACTERS) != length)
		return false;
	while (size > length && text[size - 1] == 0)
		size--;
	return size == length;
}

int plan_strategy_count(const char *mixture)
{
	size_t length = strnlen(mixture, PLAN_MUTATIONS_MAX);
	if (length == PLAN_MUTATIONS_MAX || strspn(mixture, TEXT_CHARACTERS) != length)
		return -1;
	int count = length > 0;
	for (size_t i = 0; i < length; i++) {
		bool begins = i == 0 || mixture[i - 1] == ',';
		if (begins && strspn(mixture + i, "abcdefghijklmnopqrstuvwxyz") == 0)
			return -1;
		count += mixture[i] == ',';
	}
	if ((length > 0 && mixture[length - 1] == ',') || count > PLAN_STRATEGIES_MAX)
		return -1;
	return count;
}

void plan_strategy_name(const char *mixture, uint32_t i, char *name, size_t size)
{
	for (; i > 0 && *mixture; i--) {
		mixture += strcspn(mixture, ",");
		mixture += *mixture == ',';
	}
	snprintf(name, size, "%.*s", (int)strcspn(mixture, "=,"), mixture);
}
