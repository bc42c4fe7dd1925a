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

typedef unsigned __int128 wide;

enum {
	DEFAULT_GROUPS = 16,
	LEAST_GROUPS = 4,
	DEFAULT_PARTS = 4,
	DEFAULT_CHAINS = 1024,
	DEFAULT_BOOTSTRAP = 1000000,
	LEAST_BOOTSTRAP = 16384,
	FEW_BOOTSTRAP = 4096,	    /* minimum for plans of samples, whose bootstrap only sets the scale of the grid */
	SHARE_BOOTSTRAP = 64,	    /* plans of samples have one bootstrap sample per 64 samples */
	LEAST_BOOTSTRAP_SLOW = 256, /* minimum if a bootstrap sample takes thousands of rays: each then connects as many
				       pairs of vertices, so that 256 samples find light if there is any */
	LEAST_CHAINS = 16,
	MUTATIONS_PER_CHAIN = 2048,    /* shorter jobs have fewer chains, not shorter ones */
	AIM_ROUNDS = 8,		       /* rounds of a job whose number of mutations or samples is bounded */
	LEASE_SAMPLES_MOST = 1 << 20,  /* chains: most mutations in one lease */
	LEASE_SAMPLES_OPEN = 1 << 18,  /* the same if nothing bounds the job's mutations */
	LEASE_SAMPLES_LEAST = 1 << 13, /* the fewest mutations in one lease, in that case */
	LEASE_SECONDS = 20,	       /* time that a lease should take, of one thread */
	LEASE_SAMPLES_SLOW = 1 << 15,  /* so many never took longer than LEASE_SECONDS in any scene tried */
	SPEED_UNKNOWN = 50000,	       /* mutations or samples a second of one thread, if no pilot has measured it */
	RAYS_A_SECOND = 2000000,       /* assumed of one thread; 1.5 to 3.5 million in the scenes of tests/bench */
	RAYS_USUAL = 8,		       /* mutations and samples that take more rays count as slow */
	PIXEL_BYTES = 12,	       /* of a tile on the wire */
	STRIP_SAMPLES_MOST = 1 << 17,  /* samples: most samples in one lease */
};
#define TOTAL_MOST (UINT64_C(1) << 62)
#define LEASE_MOST (UINT64_C(1) << 40)
static const double unseen_most = 1e12;

static wide wide_ceil_div(wide a, wide b)
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

static struct plan_range split(uint64_t total, uint32_t part, uint32_t parts)
{
	return (struct plan_range){(uint64_t)((wide)total * part / parts),
				   (uint64_t)((wide)total * (part + 1) / parts)};
}

struct plan_range plan_bootstrap_range(const struct plan *p, uint32_t group, uint32_t part)
{
	uint64_t n = p->bootstrap / ((uint64_t)p->groups * p->parts);
	uint64_t lease = (uint64_t)group * p->parts + part;
	return (struct plan_range){lease * n, (lease + 1) * n};
}

struct plan_range plan_chain_range(const struct plan *p, uint32_t part)
{
	return split(p->chains / p->groups, part, p->parts);
}

struct plan_range plan_row_range(const struct plan *p, uint32_t part)
{
	return split((uint64_t)p->crop_height + 2 * (uint64_t)p->border, part, p->parts);
}

uint32_t plan_parts_usual(const struct plan *p)
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
	if (p->width < 1 || p->height < 1 || p->width > PLAN_MAX_SIZE || p->height > PLAN_MAX_SIZE)
		return error_set(e, EINVAL, "the film is %ux%u pixels; each side must be 1 to %d", p->width, p->height,
				 PLAN_MAX_SIZE);
	if (p->crop_width < 1 || p->crop_height < 1 || p->crop_x >= p->width || p->crop_y >= p->height ||
	    p->crop_width > p->width - p->crop_x || p->crop_height > p->height - p->crop_y)
		return error_set(e, EINVAL,
				 "the crop %u,%u,%u,%u (x,y,width,height) does not lie inside the film of %ux%u",
				 p->crop_x, p->crop_y, p->crop_width, p->crop_height, p->width, p->height);
	if (crop_pixels(p) > PLAN_MAX_PIXELS)
		return error_set(e, EINVAL, "the image has %llu pixels; a render has at most %d: --crop renders a part",
				 (unsigned long long)crop_pixels(p), PLAN_MAX_PIXELS);
	if (p->border > PLAN_MAX_BORDER)
		return error_set(e, EINVAL, "the filter extends %u pixels beyond the image; at most %d", p->border,
				 PLAN_MAX_BORDER);
	return 0;
}

/* Sets *total to the number of samples or mutations requested, the least of the given bounds; 0: there is no bound. */
static int asked_total(const struct plan_request *r, const struct plan *p, uint64_t *total, struct error *e)
{
	*total = 0;
	if (r->spp) {
		wide n = (wide)r->spp * crop_pixels(p);
		if (n > TOTAL_MOST)
			return error_set(e, EINVAL, "%llu samples per pixel are more than can be counted",
					 (unsigned long long)r->spp);
		*total = (uint64_t)n;
	}
	if (r->mutations > TOTAL_MOST)
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

bool plan_wants_rays(const struct plan_request *r)
{
	bool asked = r->bootstrap && r->epoch && (r->chains || r->kind == PLAN_SAMPLES);
	bool counted = r->spp || r->mutations;
	return !asked && (!counted || r->seconds > 0 || r->target_error > 0);
}

/* Returns how many bootstrap samples one thread is assumed to draw in that time; 2^62 if no rays were counted. */
static uint64_t bootstrap_room(const struct plan_request *r, double seconds)
{
	return r->rays.bootstrap > 0 ? (uint64_t)fmin(seconds * RAYS_A_SECOND / r->rays.bootstrap, 0x1p62) : 1ull << 62;
}

uint64_t plan_bootstrap_room(const struct plan_request *r, double seconds)
{
	return clamp(bootstrap_room(r, seconds), LEAST_BOOTSTRAP_SLOW, PLAN_MAX_BOOTSTRAP / 2);
}

/* Returns the ratio of the rays of a mutation or sample to the usual number; at least 1. */
static double slowness_of(const struct plan_request *r)
{
	return fmax(1, r->rays.step / RAYS_USUAL);
}

/* Returns the mutations in a lease of a plan that only time or error end: 32 per pixel and round, divided among the
 * round's leases, but at least half a mutation per pixel of the crop: summing, sending and adding a lease's tiles costs
 * about 20 ns per pixel, which is 2 % of the time of half a mutation. Fewer than 2^13 are not worth sending; leases of
 * slow mutations are shorter in proportion. */
static uint64_t open_lease(const struct plan_request *r, const struct plan *p)
{
	uint64_t leases = (uint64_t)p->groups * p->parts, per_pixel = crop_pixels(p) * 32 / leases,
		 least = crop_pixels(p) / 2;
	uint64_t lease = clamp(per_pixel > least ? per_pixel : least, LEASE_SAMPLES_LEAST, LEASE_SAMPLES_OPEN);
	return (uint64_t)((double)lease / slowness_of(r));
}

/* The next two functions return how many samples or mutations fit into a bound on time or on the error; infinity if
 * there is no such bound. They assume one thread at SPEED_UNKNOWN, and independent pixels whose relative error is 100 %
 * per sample: conservative constants, because a plan must not depend on the machine. */
static double room_in_time(const struct plan_request *r)
{
	return r->seconds > 0 ? SPEED_UNKNOWN / slowness_of(r) * r->seconds : INFINITY;
}

static double room_for_error(const struct plan_request *r, const struct plan *p)
{
	return r->target_error > 0 ? (double)crop_pixels(p) / (r->target_error * r->target_error) : INFINITY;
}

enum epoch_rule { RULE_ASKED, RULE_ROUNDS, RULE_FILM, RULE_ROOM, RULE_MOST, RULE_SECONDS, RULE_BANDWIDTH };

/* Returns the power of two nearest to x by ratio, from 1 to 2^40. */
static double power_of_two_near(double x)
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

/* Chooses the length of an epoch by the rule that plan.h states above plan_wants_speed, and returns which part of the
 * rule decided. p's parts, groups and chains are set already. */
static enum epoch_rule choose_epoch(const struct plan_request *r, const struct plan *p, uint64_t total, uint64_t *epoch)
{
	bool chains = p->kind == PLAN_CHAINS;
	uint64_t unit = lease_unit(p), round = chains ? p->chains : p->groups * crop_pixels(p);
	uint64_t usual =
		chains ? LEASE_SAMPLES_MOST / unit : (uint64_t)STRIP_SAMPLES_MOST * p->parts / plan_extended_pixels(p);
	uint64_t most = clamp(usual, 1, LEASE_SAMPLES_MOST);
	enum epoch_rule rule = RULE_MOST;
	if (r->epoch) {
		*epoch = r->epoch;
		return RULE_ASKED;
	}
	if (r->speed > 0) {
		most = (uint64_t)power_of_two_near(LEASE_SECONDS * r->speed / (double)unit);
		rule = RULE_SECONDS;
	}
	double aim = (double)round * AIM_ROUNDS, in_time = room_in_time(r) / aim;
	double film = (double)(chains ? open_lease(r, p) / unit : usual);
	double want = chains ? film : fmin(fmin(in_time, room_for_error(r, p) / aim), film);
	double asked = (double)wide_ceil_div(total, (wide)round * AIM_ROUNDS);
	if (total)
		want = fmin(asked, chains ? fmax(in_time, film) : in_time);
	*epoch = clamp((uint64_t)fmin(want, 0x1p62), 1, most);
	if (want <= (double)most)
		rule = total && want == asked ? RULE_ROUNDS : want == film ? RULE_FILM : RULE_ROOM;
	double seconds = r->bandwidth > 0 ? (double)lease_bytes(p) / r->bandwidth : 0;
	double least = ceil(seconds * (r->speed > 0 ? r->speed : SPEED_UNKNOWN) / (double)unit);
	uint64_t all = total ? (uint64_t)wide_ceil_div(total, round) : LEASE_MOST / unit;
	least = fmin(exp2(ceil(log2(fmax(least, 1)))), (double)all);
	if (least > (double)*epoch) {
		*epoch = (uint64_t)least;
		rule = RULE_BANDWIDTH;
	}
	return rule;
}

/* Returns the number of groups, if none are requested. A round of samples has at least one sample per pixel and
 * group; if two threads would not finish it within the job's time, there are fewer groups than usual, but at least
 * four, so that an error can be estimated. */
static uint32_t usual_groups(const struct plan_request *r, const struct plan *p)
{
	if (r->groups)
		return r->groups;
	if (p->kind == PLAN_CHAINS || !(r->seconds > 0) || !(r->rays.step > 0))
		return DEFAULT_GROUPS;
	double samples = fmin(2.0 * RAYS_A_SECOND * r->seconds / r->rays.step, 0x1p62);
	return (uint32_t)clamp((uint64_t)samples / plan_extended_pixels(p), LEAST_GROUPS, DEFAULT_GROUPS);
}

void plan_describe_epoch(const struct plan_request *r, const struct plan *p, char *text, size_t size)
{
	struct plan q = *p;
	struct error e;
	uint64_t total, epoch;
	if (p->kind == PLAN_SAMPLES)
		q.groups = usual_groups(r, p);
	enum epoch_rule rule = asked_total(r, p, &total, &e) ? RULE_ASKED : choose_epoch(r, &q, total, &epoch);
	const char *thing = p->kind == PLAN_CHAINS ? "mutations" : "samples";
	if (rule == RULE_ROUNDS)
		snprintf(text, size, "epochs: for %s%d rounds", p->rounds < AIM_ROUNDS ? "at most " : "", AIM_ROUNDS);
	else if (rule == RULE_FILM)
		snprintf(text, size, "epochs: by the size of the film");
	else if (rule == RULE_ROOM)
		snprintf(text, size, "epochs: at least about %d rounds for the requested time or error", AIM_ROUNDS);
	else if (rule == RULE_MOST)
		snprintf(text, size, "epochs: the maximum of %s in a lease without a pilot", thing);
	else if (rule == RULE_SECONDS)
		snprintf(text, size, "epochs: leases of about %d s for a thread that makes %.3g %s per second",
			 LEASE_SECONDS, r->speed, thing);
	else if (rule == RULE_BANDWIDTH)
		snprintf(text, size,
			 "epochs: %.3g MB of tiles per lease at %.3g MB/s for a thread that makes %.3g %s per second",
			 1e-6 * (double)lease_bytes(p), 1e-6 * r->bandwidth, r->speed > 0 ? r->speed : SPEED_UNKNOWN,
			 thing);
	else if (size)
		*text = 0;
}

bool plan_wants_speed(const struct plan_request *r, const struct plan *p)
{
	return !r->epoch && !(r->speed > 0) && p->epoch > LEASE_SAMPLES_SLOW / lease_unit(p);
}

/* Chooses groups, chains, parts, epoch and rounds of a plan of chains. total: mutations requested; 0: no bound. */
static int make_chains(const struct plan_request *r, struct plan *p, uint64_t total, struct error *e)
{
	p->groups = r->groups ? r->groups : DEFAULT_GROUPS;
	uint64_t chains = r->chains;
	if (!chains)
		chains = total ? power_of_two_below(clamp(total / MUTATIONS_PER_CHAIN, LEAST_CHAINS, DEFAULT_CHAINS))
			       : DEFAULT_CHAINS;
	if (!r->chains && r->seconds > 0) {
		uint64_t starts = bootstrap_room(r, r->seconds / 8);
		if (starts < chains)
			chains = power_of_two_below(clamp(starts, LEAST_CHAINS, DEFAULT_CHAINS));
	}
	uint64_t per_group = ceil_div(chains, p->groups);
	p->parts = r->parts ? r->parts : (uint32_t)clamp(per_group, 1, DEFAULT_PARTS);
	if (r->parts && r->chains && (chains % p->groups || per_group % p->parts))
		return error_set(e, EINVAL, "%llu chains in %u groups cannot be divided into %u equal parts",
				 (unsigned long long)chains, p->groups, p->parts);
	chains = ceil_div(chains, (uint64_t)p->groups * p->parts) * p->groups * p->parts;
	if (chains > PLAN_MAX_CHAINS)
		return error_set(e, EINVAL, "%llu chains; at most %d are possible", (unsigned long long)chains,
				 PLAN_MAX_CHAINS);
	p->chains = (uint32_t)chains;
	uint64_t per_lease = lease_unit(p);
	choose_epoch(r, p, total, &p->epoch);
	if (p->epoch > LEASE_MOST / per_lease)
		return error_set(e, EINVAL, "an epoch of %llu mutations is too long", (unsigned long long)p->epoch);
	p->rounds = total ? ceil_div(total, chains * p->epoch) : UINT64_MAX;
	return 0;
}

/* Like make_chains, for a plan of samples. total: samples of all pixels. */
static int make_samples(const struct plan_request *r, struct plan *p, uint64_t total, struct error *e)
{
	uint64_t rows = (uint64_t)p->crop_height + 2 * (uint64_t)p->border;
	uint64_t groups = usual_groups(r, p),
		 parts = r->groups ? DEFAULT_PARTS : DEFAULT_PARTS * DEFAULT_GROUPS / groups;
	if (r->parts > rows)
		return error_set(e, EINVAL, "%llu rows cannot be divided into %u parts", (unsigned long long)rows,
				 r->parts);
	p->parts = r->parts ? r->parts : (uint32_t)clamp(rows, 1, parts);
	uint64_t spp = ceil_div(total, crop_pixels(p)); /* 0: no bound */
	p->groups = (uint32_t)groups;
	choose_epoch(r, p, total, &p->epoch);
	uint64_t k = p->epoch;
	if (k > LEASE_MOST / plan_extended_pixels(p))
		return error_set(e, EINVAL, "an epoch of %llu samples per pixel is too long", (unsigned long long)k);
	p->rounds = UINT64_MAX;
	if (spp) {
		p->rounds = (uint64_t)wide_ceil_div(spp, (wide)groups * k);
		if (!r->epoch)
			k = (uint64_t)wide_ceil_div(spp, (wide)groups * p->rounds);
		if (!r->groups)
			groups = (uint64_t)wide_ceil_div(spp, (wide)p->rounds * k);
	}
	p->groups = (uint32_t)groups;
	p->epoch = k;
	p->chains = 0;
	return 0;
}

static int make_bootstrap(const struct plan_request *r, struct plan *p, uint64_t total, struct error *e)
{
	uint64_t n = r->bootstrap, leases = (uint64_t)p->groups * p->parts;
	double expected = fmin(total ? (double)total : INFINITY, room_in_time(r));
	if (!n && p->kind == PLAN_SAMPLES)
		n = clamp((uint64_t)fmin(expected / SHARE_BOOTSTRAP, LEAST_BOOTSTRAP), FEW_BOOTSTRAP, LEAST_BOOTSTRAP);
	else if (!n)
		n = clamp((uint64_t)fmin(expected / 8, DEFAULT_BOOTSTRAP), LEAST_BOOTSTRAP, DEFAULT_BOOTSTRAP);
	if (!r->bootstrap && (r->seconds > 0 || r->target_error > 0)) {
		uint64_t room =
			plan_bootstrap_room(r, r->seconds > 0 ? r->seconds / 4 : LEASE_SECONDS * (double)leases);
		n = n < room ? n : room;
	}
	if (n > PLAN_MAX_BOOTSTRAP / 2)
		return error_set(e, EINVAL, "%llu bootstrap samples; at most %d", (unsigned long long)n,
				 PLAN_MAX_BOOTSTRAP / 2);
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
	PLAN_GIVEN(X)
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
	if (rc == 0 && (r->groups > PLAN_MAX_GROUPS || r->parts > PLAN_MAX_PARTS))
		rc = error_set(e, EINVAL, "--%s %u is above %d", r->groups > PLAN_MAX_GROUPS ? "groups" : "parts",
			       r->groups > PLAN_MAX_GROUPS ? r->groups : r->parts,
			       r->groups > PLAN_MAX_GROUPS ? PLAN_MAX_GROUPS : PLAN_MAX_PARTS);
	if (rc == 0)
		rc = asked_total(r, p, &total, e);
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
			PLAN_MAX_STRATEGIES, PLAN_MUTATIONS_MAX - 1);
	if (!plan_text_ok(p->mutations, sizeof p->mutations))
		return error_set(e, EINVAL, "the mixture of mutations has bytes after its text");
	if (!plan_text_ok(p->accuracy, sizeof p->accuracy) || !plan_text_ok(p->effects, sizeof p->effects))
		return error_set(e, EINVAL,
				 "the settings or the effects are not a text of letters, digits and @=,.:+-_");
	if (n > 0 && p->kind != PLAN_CHAINS)
		return error_set(e, EINVAL, "a plan without chains has a mixture of mutations");
	return 0;
}

static int check_cut(const struct plan *p, struct error *e)
{
	if (p->kind != PLAN_CHAINS && p->kind != PLAN_SAMPLES)
		return error_set(e, EINVAL, "unknown kind of plan %d", (int)p->kind);
	if (p->groups < 1 || p->groups > PLAN_MAX_GROUPS || p->parts < 1 || p->parts > PLAN_MAX_PARTS)
		return error_set(e, EINVAL, "%u groups of %u parts: there can be 1 to %d groups of 1 to %d parts",
				 p->groups, p->parts, PLAN_MAX_GROUPS, PLAN_MAX_PARTS);
	uint64_t leases = (uint64_t)p->groups * p->parts;
	if (p->bootstrap < 1 || p->bootstrap > PLAN_MAX_BOOTSTRAP || p->bootstrap % leases)
		return error_set(e, EINVAL, "%llu bootstrap samples are not a multiple of %llu up to %d",
				 (unsigned long long)p->bootstrap, (unsigned long long)leases, PLAN_MAX_BOOTSTRAP);
	uint64_t lease_unit;
	if (p->kind == PLAN_CHAINS) {
		if (p->chains < 1 || p->chains > PLAN_MAX_CHAINS || p->chains % leases)
			return error_set(e, EINVAL, "%u chains are not a multiple of %llu up to %d", p->chains,
					 (unsigned long long)leases, PLAN_MAX_CHAINS);
		lease_unit = p->chains / leases;
		if (lease_unit > PLAN_MAX_LEASE_CHAINS)
			return error_set(
				e, EINVAL,
				"%u chains in %u groups of %u parts are %llu per lease, of at most %d: choose more groups or parts",
				p->chains, p->groups, p->parts, (unsigned long long)lease_unit, PLAN_MAX_LEASE_CHAINS);
	} else {
		if (p->chains)
			return error_set(e, EINVAL, "a plan without chains names %u of them", p->chains);
		if (p->parts > p->crop_height + 2 * p->border)
			return error_set(e, EINVAL, "%u parts of %u rows", p->parts, p->crop_height + 2 * p->border);
		lease_unit = plan_extended_pixels(p);
	}
	if (p->epoch < 1 || p->epoch > LEASE_MOST / lease_unit)
		return error_set(e, EINVAL, "an epoch of %llu is not possible", (unsigned long long)p->epoch);
	return 0;
}

static int check_end(const struct plan *p, struct error *e)
{
	if (!isfinite(p->seconds) || p->seconds < 0 || !isfinite(p->target_error) || p->target_error < 0)
		return error_set(e, EINVAL, "the time and the target error must be finite and not negative");
	if (p->rounds == UINT64_MAX) {
		if (!(p->seconds > 0) && !(p->target_error > 0))
			return error_set(e, EINVAL, "the plan has no bound");
	} else if (p->rounds < 1 || (wide)p->rounds * plan_round_mutations(p) > TOTAL_MOST * 2) {
		return error_set(e, EINVAL, "%llu rounds are not possible", (unsigned long long)p->rounds);
	}
	if (p->max_depth >= 1 && p->min_depth > p->max_depth)
		return error_set(e, EINVAL, "--min-depth %u is above --max-depth %u", p->min_depth, p->max_depth);
	if (p->max_depth < 1 || p->max_depth > PLAN_MAX_DEPTH)
		return error_set(e, EINVAL, "path lengths from %u to %u edges; at most %d", p->min_depth, p->max_depth,
				 PLAN_MAX_DEPTH);
	return 0;
}

static int check_unseen(const struct plan *p, struct error *e)
{
	for (int i = 0; i < PLAN_UNSEEN; i++)
		if (!(p->unseen.at[i] >= 0 && p->unseen.at[i] <= unseen_most))
			return error_set(e, EINVAL, "unseen light of %g", p->unseen.at[i]);
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
		rc = check_cut(p, e);
	if (rc == 0)
		rc = check_unseen(p, e);
	return rc ? rc : check_end(p, e);
}

double plan_unseen_after(const struct plan *p, double spp)
{
	const double *at = p->unseen.at, x = fmin(fmax(0.5 * log2(spp), 0), PLAN_UNSEEN - 1);
	int i = (int)fmin(x, PLAN_UNSEEN - 2);
	return at[i] + (x - i) * (at[i + 1] - at[i]);
}

/* ---- texts ---- */

#define TEXT_CHARACTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789@=,.:+-_"

bool plan_text_ok(const char *text, size_t size)
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
	if ((length > 0 && mixture[length - 1] == ',') || count > PLAN_MAX_STRATEGIES)
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
