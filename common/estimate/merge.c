/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The bootstrap of a job, and the bounds that end it.
 *
 * Happy path: batches of the bootstrap are added in any order (bootstrap_add). When none is missing,
 * bootstrap_compute_b computes b by group and pooled, bootstrap_draw_seeds draws each group's seeds by systematic
 * resampling, and bootstrap_add_to_canvas starts the film's sums. After complete rounds merge_find_end says which bound
 * ends the job; merge_error_is_due says at which rounds the error is estimated at all.
 *
 * Failures: a lease that was added before is -EEXIST, a damaged file of saved leases -EBADMSG, and -ENOMEM. A
 * bootstrap without light is no failure: it is `is_black`, and its seeds are UINT64_MAX. Exact sums make the result
 * independent of the order of batches.
 */
#include "common/estimate/merge.h"

#include "common/base/mem.h"
#include "common/estimate/stated_error.h"
#include "common/estimate/tail.h"
#include "common/plan/resample.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { KEY_NUMBERS = 2, SUM_NUMBERS = 3 }; /* numbers of these kinds in a saved lease */

struct bootstrap {
	struct plan plan;
	float *weights;		/* [bootstrap], in index order */
	struct batch *batches;	/* [group][part]; only key, counters, sums and classes are kept */
	uint32_t missing_count; /* leases not added yet */
	struct tail tail;	/* of all weights */
};

/* Returns how many of the largest samples the tail index is estimated from: one in 512, but at least 16, for which its
 * relative standard error is a quarter. */
static size_t tail_count(const struct plan *p)
{
	uint64_t n = p->bootstrap / 512;
	return n > 16 ? (size_t)n : 16;
}

int bootstrap_new(struct bootstrap **out, const struct plan *p, struct error *e)
{
	*out = NULL;
	struct bootstrap *s = mem_alloc(1, sizeof *s);
	if (s) {
		s->plan = *p;
		s->missing_count = p->groups * p->parts;
		s->weights = mem_alloc(p->bootstrap, sizeof *s->weights);
		s->batches = mem_alloc(s->missing_count, sizeof *s->batches);
	}
	if (!s || !s->weights || !s->batches || tail_init(&s->tail, tail_count(p) + 1)) {
		bootstrap_free(s);
		return error_set(e, ENOMEM, "no memory for %llu bootstrap weights", (unsigned long long)p->bootstrap);
	}
	*out = s;
	return 0;
}

void bootstrap_free(struct bootstrap *s)
{
	if (!s)
		return;
	mem_free(s->weights);
	mem_free(s->batches);
	tail_fini(&s->tail);
	mem_free(s);
}

static struct batch *stored_batch(const struct bootstrap *s, uint32_t group, uint32_t part)
{
	return s->batches + (size_t)group * s->plan.parts + part;
}

bool bootstrap_has_lease(const struct bootstrap *s, uint32_t group, uint32_t part)
{
	return stored_batch(s, group, part)->key.kind == LEASE_BOOTSTRAP;
}

uint32_t bootstrap_missing_count(const struct bootstrap *s)
{
	return s->missing_count;
}

uint32_t bootstrap_added_count(const struct bootstrap *s)
{
	return s->plan.groups * s->plan.parts - s->missing_count;
}

int bootstrap_add(struct bootstrap *s, const struct batch *b, struct error *e)
{
	const struct lease_key *k = &b->key;
	struct plan_range r = plan_bootstrap_range(&s->plan, k->group, k->part);
	assert(k->kind == LEASE_BOOTSTRAP && b->weight_count == r.end - r.begin);
	if (bootstrap_has_lease(s, k->group, k->part))
		return error_set(e, EEXIST, "the bootstrap lease has been merged before");
	memcpy(s->weights + r.begin, b->weights, b->weight_count * sizeof *b->weights);
	for (size_t i = 0; i < b->weight_count; i++)
		tail_add(&s->tail, (double)b->weights[i]);
	struct batch *stored = stored_batch(s, k->group, k->part);
	stored->key = *k;
	memcpy(stored->counters, b->counters, sizeof stored->counters);
	stored->independent_sum = b->independent_sum;
	stored->independent_square = b->independent_square;
	stored->overlong_sum = b->overlong_sum;
	memcpy(stored->classes, b->classes, sizeof stored->classes);
	s->missing_count--;
	return 0;
}

static int save_lease(const struct bootstrap *s, const struct batch *b, struct checked_file *f, struct error *e)
{
	struct plan_range r = plan_bootstrap_range(&s->plan, b->key.group, b->key.part);
	const uint32_t key[KEY_NUMBERS] = {b->key.group, b->key.part};
	const double sums[SUM_NUMBERS] = {b->independent_sum, b->independent_square, b->overlong_sum};
	int rc = checked_file_write_numbers(f, key, sizeof *key, KEY_NUMBERS, e);
	if (!rc)
		rc = checked_file_write_numbers(f, b->counters, sizeof *b->counters, BATCH_COUNTERS, e);
	if (!rc)
		rc = checked_file_write_numbers(f, sums, sizeof *sums, SUM_NUMBERS, e);
	if (!rc)
		rc = checked_file_write_numbers(f, b->classes, sizeof *b->classes, PATH_CLASSES, e);
	return rc ? rc : checked_file_write_numbers(f, s->weights + r.begin, sizeof *s->weights, r.end - r.begin, e);
}

int bootstrap_save(const struct bootstrap *s, struct checked_file *f, struct error *e)
{
	uint32_t leases = s->plan.groups * s->plan.parts, count = bootstrap_added_count(s);
	int rc = checked_file_write_numbers(f, &count, sizeof count, 1, e);
	for (uint32_t i = 0; i < leases && !rc; i++)
		if (s->batches[i].key.kind == LEASE_BOOTSTRAP)
			rc = save_lease(s, &s->batches[i], f, e);
	return rc;
}

static int load_lease(struct bootstrap *s, struct checked_file *f, struct error *e)
{
	uint32_t key[KEY_NUMBERS];
	double sums[SUM_NUMBERS];
	int rc = checked_file_read_numbers(f, key, sizeof *key, KEY_NUMBERS, e);
	if (rc)
		return rc;
	if (key[0] >= s->plan.groups || key[1] >= s->plan.parts)
		return error_set(e, EBADMSG, "a bootstrap lease of group %u, part %u", key[0], key[1]);
	struct plan_range r = plan_bootstrap_range(&s->plan, key[0], key[1]);
	struct batch b = {.key = {.kind = LEASE_BOOTSTRAP, .group = key[0], .part = key[1]},
			  .weight_count = r.end - r.begin,
			  .weights = mem_alloc(r.end - r.begin, sizeof *b.weights)};
	if (!b.weights)
		return error_set(e, ENOMEM, "no memory for %llu bootstrap weights",
				 (unsigned long long)(r.end - r.begin));
	rc = checked_file_read_numbers(f, b.counters, sizeof *b.counters, BATCH_COUNTERS, e);
	if (!rc)
		rc = checked_file_read_numbers(f, sums, sizeof *sums, SUM_NUMBERS, e);
	if (!rc)
		rc = checked_file_read_numbers(f, b.classes, sizeof *b.classes, PATH_CLASSES, e);
	if (!rc)
		rc = checked_file_read_numbers(f, b.weights, sizeof *b.weights, b.weight_count, e);
	if (!rc) {
		b.independent_sum = sums[0];
		b.independent_square = sums[1];
		b.overlong_sum = sums[2];
	}
	if (!rc)
		rc = batch_check(&b, &s->plan, e);
	if (!rc)
		rc = bootstrap_add(s, &b, e);
	mem_free(b.weights);
	return rc;
}

int bootstrap_load(struct bootstrap *s, struct checked_file *f, struct error *e)
{
	uint32_t count;
	assert(s->missing_count == s->plan.groups * s->plan.parts);
	int rc = checked_file_read_numbers(f, &count, sizeof count, 1, e);
	if (!rc && count > s->missing_count)
		rc = error_set(e, EBADMSG, "%u bootstrap leases of %u", count, s->missing_count);
	for (uint32_t i = 0; i < count && !rc; i++)
		rc = load_lease(s, f, e);
	return rc;
}

void bootstrap_compute_b(const struct bootstrap *s, struct bootstrap_result *r)
{
	assert(s->missing_count == 0);
	*r = (struct bootstrap_result){0};
	struct exact_sum all = {0}, beyond = {0};
	uint64_t all_count = 0;
	for (uint32_t g = 0; g < s->plan.groups; g++) {
		struct exact_sum sum = {0};
		uint64_t count = 0;
		for (uint32_t part = 0; part < s->plan.parts; part++) {
			const struct batch *b = stored_batch(s, g, part);
			exact_sum_add(&sum, b->independent_sum);
			exact_sum_add(&beyond, b->overlong_sum);
			count += b->counters[COUNT_INDEPENDENT];
		}
		r->b[g] = exact_sum_value(&sum) / (double)count;
		exact_sum_merge(&all, &sum);
		all_count += count;
	}
	double inside = exact_sum_value(&all), outside = exact_sum_value(&beyond);
	r->b_pooled = inside / (double)all_count;
	r->overlong_share = outside > 0 ? outside / (inside + outside) : 0;
	r->is_black = s->plan.kind == PLAN_CHAINS && !(inside > 0);
}

void bootstrap_draw_seeds(const struct bootstrap *s, uint32_t group, uint64_t *index)
{
	assert(s->missing_count == 0 && s->plan.kind == PLAN_CHAINS);
	uint64_t first = plan_bootstrap_range(&s->plan, group, 0).begin, count = s->plan.bootstrap / s->plan.groups;
	if (plan_resample(&s->plan, group, s->weights + first, count, plan_resample_offset(&s->plan, group),
			  s->plan.chains / s->plan.groups, index))
		return;
	for (uint32_t k = 0; k < s->plan.chains / s->plan.groups; k++)
		index[k] = UINT64_MAX;
}

void bootstrap_add_to_canvas(struct bootstrap *s, struct canvas *c)
{
	assert(s->missing_count == 0);
	tail_select_largest(&s->tail);
	canvas_set_tail_index(c, tail_index(&s->tail, tail_count(&s->plan)));
	for (uint32_t i = 0; i < s->plan.groups * s->plan.parts; i++) {
		int rc = canvas_add(c, s->batches + i, NULL);
		assert(rc == 0 || rc == -EEXIST);
		(void)rc;
	}
}

/* Returns the least number of rounds between two estimates of the error. An estimate costs 15 to 17 ns per pixel and
 * group, a mutation or sample at least 2 us: after 0.9 mutations or samples per pixel and group, an estimate costs less
 * than 1 % of the work since the last one. */
static uint64_t error_interval_rounds(const struct plan *p)
{
	uint64_t work = (uint64_t)p->crop_width * p->crop_height * p->groups / 10 * 9, round = plan_round_mutations(p);
	return work / round + (work % round != 0);
}

uint64_t merge_next_error_rounds(const struct plan *p, uint64_t rounds)
{
	uint64_t step = error_interval_rounds(p), due = 1;
	step = step > 0 ? step : 1;
	if (rounds >= UINT64_MAX / 2)
		return UINT64_MAX;
	while (due <= rounds / step)
		due += due < 4 ? 1 : due / 4;
	return due > UINT64_MAX / step ? UINT64_MAX : due * step;
}

bool merge_error_is_due(const struct plan *p, uint64_t rounds)
{
	return p->target_error > 0 && rounds > 0 && merge_next_error_rounds(p, rounds - 1) == rounds;
}

bool merge_ends_black(const struct plan *p, uint64_t rounds, bool black)
{
	static const double samples = 1e6;
	bool bounded = p->rounds != UINT64_MAX || p->seconds > 0;
	return black && !bounded && p->kind == PLAN_SAMPLES &&
	       (double)rounds * (double)plan_round_mutations(p) >= samples;
}

enum merge_end merge_find_end(const struct plan *p, uint64_t rounds, double seconds, const struct canvas_image *img)
{
	if (img && p->target_error > 0 && stated_error_meets(img, p->target_error))
		return MERGE_ERROR;
	if (rounds >= p->rounds)
		return MERGE_ROUNDS;
	if (p->seconds > 0 && rounds > 0 && seconds >= p->seconds)
		return MERGE_TIME;
	if (img && merge_ends_black(p, rounds, img->is_black))
		return MERGE_BLACK;
	return MERGE_CONTINUES;
}

const char *merge_end_name(enum merge_end end, bool black)
{
	static const char *const names[] = {[MERGE_CONTINUES] = "interrupted",
					    [MERGE_ROUNDS] = "mutations",
					    [MERGE_TIME] = "time",
					    [MERGE_ERROR] = "target-error",
					    [MERGE_BLACK] = "black"};
	return black ? "black" : names[end];
}

double merge_seconds_remaining(const struct plan *p, double seconds, double rounds, double rounds_per_second)
{
	double remaining = p->seconds - seconds;
	if (!(rounds_per_second > 0))
		return remaining > 0 ? remaining : NAN;
	double last = fmax(ceil(rounds + fmax(0, remaining) * rounds_per_second), floor(rounds) + 1);
	return (fmax(1, last) - rounds) / rounds_per_second;
}
