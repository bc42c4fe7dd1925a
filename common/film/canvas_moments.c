/* SPDX-License-Identifier: Apache-2.0 */
/*
 * moments_add adds a render's moments to the open round of its epoch or, if that round is closed, to the prefix, and a
 * bootstrap's energy to its group. moments_close_round moves an open round into the prefix. Floats are rounded to the
 * grid before they are added, so the sums are integers and the order does not matter; moments_subtract adds the same
 * integers with the other sign, which removes a batch without a trace.
 *
 * Failures: moments_new returns -ENOMEM. Sums cannot overflow if moments_check_range, which bounds the mutations of a
 * chain, was called before. moments_load refuses moments of another shape and files that end early.
 */
#include "common/film/canvas_moments.h"

#include "common/base/mem.h"
#include "common/film/moments_sums.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { SHAPE_NUMBERS = 4 };
_Static_assert(sizeof(struct exact_sum) == EXACT_SUM_WORDS * sizeof(uint64_t), "an array of them is an array of words");
#define MUTATIONS_MAX (UINT64_C(1) << 42)

static size_t first_moment_count(const struct moments *m)
{
	return (size_t)m->lease_count * m->sequences_per_lease * m->tile_count;
}

static size_t second_moment_count(const struct moments *m)
{
	return m->sequences_per_lease ? (size_t)m->lease_count * m->tile_count : 0;
}

int moments_new(struct moments **out, const struct plan *p, struct error *e)
{
	struct moments *m = mem_alloc(1, sizeof *m);
	*out = m;
	if (m) {
		m->plan = *p;
		m->sequences_per_lease = batch_sequence_count(p);
		m->lease_count = p->groups * p->parts;
		m->tile_count = batch_film_tile_count(p);
		m->first_moments = mem_alloc(MOMENTS_SETS * first_moment_count(m), sizeof *m->first_moments);
		m->second_moments = mem_alloc(MOMENTS_SETS * second_moment_count(m), sizeof *m->second_moments);
		m->class_time = mem_alloc(MOMENTS_SETS * moments_class_count(m), sizeof *m->class_time);
		m->bootstrap_energy = mem_alloc(moments_class_count(m), sizeof *m->bootstrap_energy);
		if (m->first_moments && m->second_moments && m->class_time && m->bootstrap_energy)
			return 0;
	}
	moments_free(m);
	*out = NULL;
	return error_set(e, ENOMEM, "no memory for the moments of chains");
}

void moments_free(struct moments *m)
{
	if (!m)
		return;
	mem_free(m->first_moments);
	mem_free(m->second_moments);
	mem_free(m->class_time);
	mem_free(m->bootstrap_energy);
	mem_free(m);
}

int moments_check_range(const struct moments *m, const struct lease_key *k, struct error *e)
{
	if (m->sequences_per_lease == 0 || k->kind != LEASE_RENDER)
		return 0;
	uint64_t chains = m->plan.chains / m->lease_count, epochs = MUTATIONS_MAX / chains / m->plan.epoch;
	if (k->epoch < epochs)
		return 0;
	return error_set(e, ERANGE, "after %llu rounds the moments of chains leave their range",
			 (unsigned long long)epochs);
}

/* Adds (sign 1) or subtracts (sign -1) moments, rounded to the grid. */
static void add_grid(int64_t *to, const float *from, size_t count, int sign)
{
	for (size_t i = 0; i < count; i++)
		to[i] += sign * llrint((double)from[i] * MOMENTS_GRID);
}

static void add_classes(struct exact_sum *to, const double classes[PATH_CLASSES], int sign)
{
	for (int k = 0; k < PATH_CLASSES; k++)
		if (classes[k] != 0) {
			bool finite = exact_sum_add(&to[k], sign * classes[k]);
			assert(finite); /* batch_check */
			(void)finite;
		}
}

static void add_render(struct moments *m, const struct batch *b, bool closed, int sign)
{
	const struct lease_key *k = &b->key;
	size_t group = (size_t)k->group * PATH_CLASSES, set = closed ? MOMENTS_PREFIX : MOMENTS_OPEN + k->epoch % 2;
	add_classes(m->class_time + set * moments_class_count(m) + group, b->classes, sign);
	if (b->moment_count == 0)
		return;
	size_t lease = (size_t)k->group * m->plan.parts + k->part,
	       lease_values = (size_t)m->sequences_per_lease * m->tile_count;
	add_grid(m->first_moments + set * first_moment_count(m) + lease * lease_values, b->moments, lease_values, sign);
	add_grid(m->second_moments + set * second_moment_count(m) + lease * m->tile_count, b->moments + lease_values,
		 m->tile_count, sign);
}

void moments_add(struct moments *m, const struct batch *b, bool closed)
{
	if (b->key.kind == LEASE_BOOTSTRAP)
		add_classes(m->bootstrap_energy + (size_t)b->key.group * PATH_CLASSES, b->classes, 1);
	else
		add_render(m, b, closed, 1);
}

void moments_subtract(struct moments *m, const struct batch *b, bool closed)
{
	add_render(m, b, closed, -1);
}

/* Adds `from` to `to` and clears it. Zeros are skipped, so that untouched pages stay untouched. */
static void move_grid(int64_t *to, int64_t *from, size_t count)
{
	for (size_t i = 0; i < count; i++)
		if (from[i]) {
			to[i] += from[i];
			from[i] = 0;
		}
}

void moments_close_round(struct moments *m, uint64_t round)
{
	size_t set = MOMENTS_OPEN + round % 2;
	struct exact_sum *time = m->class_time + set * moments_class_count(m);
	move_grid(m->first_moments, m->first_moments + set * first_moment_count(m), first_moment_count(m));
	move_grid(m->second_moments, m->second_moments + set * second_moment_count(m), second_moment_count(m));
	for (size_t i = 0; i < moments_class_count(m); i++) {
		exact_sum_merge(&m->class_time[i], &time[i]);
		time[i] = (struct exact_sum){0};
	}
}

/* ---- files */

/* Saves `count` runs of `run` numbers each: the tiles of a film, or the words of an exact sum. */
static int save_runs(struct checked_file *out, const void *numbers, size_t run, size_t count, struct error *e)
{
	int rc = 0;
	for (const uint64_t *p = numbers; count && !rc; count--, p += run) {
		unsigned char is_nonzero = 0;
		for (size_t k = 0; k < run && !is_nonzero; k++)
			is_nonzero = p[k] != 0;
		rc = checked_file_write(out, &is_nonzero, 1, e);
		if (!rc && is_nonzero)
			rc = checked_file_write_numbers(out, p, sizeof *p, run, e);
	}
	return rc;
}

static int load_runs(struct checked_file *in, void *numbers, size_t run, size_t count, struct error *e)
{
	int rc = 0;
	for (uint64_t *p = numbers; count && !rc; count--, p += run) {
		unsigned char is_nonzero;
		rc = checked_file_read(in, &is_nonzero, 1, e);
		if (!rc && is_nonzero)
			rc = checked_file_read_numbers(in, p, sizeof *p, run, e);
	}
	return rc;
}

static void fill_shape(const struct moments *m, uint32_t shape[SHAPE_NUMBERS])
{
	const uint32_t all[SHAPE_NUMBERS] = {m->sequences_per_lease, m->lease_count, m->tile_count, PATH_CLASSES};
	memcpy(shape, all, sizeof all);
}

int moments_save(const struct moments *m, struct checked_file *out, struct error *e)
{
	uint32_t shape[SHAPE_NUMBERS];
	fill_shape(m, shape);
	int rc = checked_file_write_numbers(out, shape, sizeof *shape, SHAPE_NUMBERS, e);
	if (!rc)
		rc = save_runs(out, m->first_moments, m->tile_count,
			       MOMENTS_SETS * first_moment_count(m) / m->tile_count, e);
	if (!rc)
		rc = save_runs(out, m->second_moments, m->tile_count,
			       MOMENTS_SETS * second_moment_count(m) / m->tile_count, e);
	if (!rc)
		rc = save_runs(out, m->class_time, EXACT_SUM_WORDS, MOMENTS_SETS * moments_class_count(m), e);
	return rc ? rc : save_runs(out, m->bootstrap_energy, EXACT_SUM_WORDS, moments_class_count(m), e);
}

int moments_load(struct moments *m, struct checked_file *in, struct error *e)
{
	uint32_t shape[SHAPE_NUMBERS], expected[SHAPE_NUMBERS];
	fill_shape(m, expected);
	int rc = checked_file_read_numbers(in, shape, sizeof *shape, SHAPE_NUMBERS, e);
	if (!rc && memcmp(shape, expected, sizeof expected) != 0)
		rc = error_set(e, EBADMSG, "moments of other chains");
	if (!rc)
		rc = load_runs(in, m->first_moments, m->tile_count,
			       MOMENTS_SETS * first_moment_count(m) / m->tile_count, e);
	if (!rc)
		rc = load_runs(in, m->second_moments, m->tile_count,
			       MOMENTS_SETS * second_moment_count(m) / m->tile_count, e);
	if (!rc)
		rc = load_runs(in, m->class_time, EXACT_SUM_WORDS, MOMENTS_SETS * moments_class_count(m), e);
	return rc ? rc : load_runs(in, m->bootstrap_energy, EXACT_SUM_WORDS, moments_class_count(m), e);
}
