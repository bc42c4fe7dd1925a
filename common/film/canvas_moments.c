/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/canvas_moments.h"

#include "common/base/mem.h"
#include "common/film/moments_sums.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { SHAPE = 4 };
_Static_assert(sizeof(struct exact_sum) == EXACT_SUM_WORDS * sizeof(uint64_t), "an array of them is an array of words");
#define MUTATIONS_MOST (UINT64_C(1) << 42)

static size_t first_count(const struct moments *m)
{
	return (size_t)m->leases * m->per_lease * m->tiles;
}

static size_t second_count(const struct moments *m)
{
	return m->per_lease ? (size_t)m->leases * m->tiles : 0;
}

int moments_new(struct moments **out, const struct plan *p, struct error *e)
{
	struct moments *m = mem_alloc(1, sizeof *m);
	*out = m;
	if (m) {
		m->plan = *p;
		m->per_lease = batch_sequences(p);
		m->leases = p->groups * p->parts;
		m->tiles = batch_film_tiles(p);
		m->first = mem_alloc(MOMENTS_SETS * first_count(m), sizeof *m->first);
		m->second = mem_alloc(MOMENTS_SETS * second_count(m), sizeof *m->second);
		m->time = mem_alloc(MOMENTS_SETS * moments_classes(m), sizeof *m->time);
		m->bootstrap = mem_alloc(moments_classes(m), sizeof *m->bootstrap);
		if (m->first && m->second && m->time && m->bootstrap)
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
	mem_free(m->first);
	mem_free(m->second);
	mem_free(m->time);
	mem_free(m->bootstrap);
	mem_free(m);
}

int moments_fit(const struct moments *m, const struct lease_key *k, struct error *e)
{
	if (m->per_lease == 0 || k->kind != LEASE_RENDER)
		return 0;
	uint64_t chains = m->plan.chains / m->leases, epochs = MUTATIONS_MOST / chains / m->plan.epoch;
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
	add_classes(m->time + set * moments_classes(m) + group, b->classes, sign);
	if (b->moment_count == 0)
		return;
	size_t lease = (size_t)k->group * m->plan.parts + k->part, own = (size_t)m->per_lease * m->tiles;
	add_grid(m->first + set * first_count(m) + lease * own, b->moments, own, sign);
	add_grid(m->second + set * second_count(m) + lease * m->tiles, b->moments + own, m->tiles, sign);
}

void moments_add(struct moments *m, const struct batch *b, bool closed)
{
	if (b->key.kind == LEASE_BOOTSTRAP)
		add_classes(m->bootstrap + (size_t)b->key.group * PATH_CLASSES, b->classes, 1);
	else
		add_render(m, b, closed, 1);
}

void moments_take_back(struct moments *m, const struct batch *b, bool closed)
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
	struct exact_sum *time = m->time + set * moments_classes(m);
	move_grid(m->first, m->first + set * first_count(m), first_count(m));
	move_grid(m->second, m->second + set * second_count(m), second_count(m));
	for (size_t i = 0; i < moments_classes(m); i++) {
		exact_sum_merge(&m->time[i], &time[i]);
		time[i] = (struct exact_sum){0};
	}
}

/* ---- files */

/* Saves `count` runs of `run` numbers each: the tiles of a film, or the words of an exact sum. */
static int save_runs(struct checked_file *out, const void *numbers, size_t run, size_t count, struct error *e)
{
	int rc = 0;
	for (const uint64_t *p = numbers; count && !rc; count--, p += run) {
		unsigned char any = 0;
		for (size_t k = 0; k < run && !any; k++)
			any = p[k] != 0;
		rc = checked_file_write(out, &any, 1, e);
		if (!rc && any)
			rc = checked_file_write_numbers(out, p, sizeof *p, run, e);
	}
	return rc;
}

static int load_runs(struct checked_file *in, void *numbers, size_t run, size_t count, struct error *e)
{
	int rc = 0;
	for (uint64_t *p = numbers; count && !rc; count--, p += run) {
		unsigned char any;
		rc = checked_file_read(in, &any, 1, e);
		if (!rc && any)
			rc = checked_file_read_numbers(in, p, sizeof *p, run, e);
	}
	return rc;
}

static void shape_of(const struct moments *m, uint32_t shape[SHAPE])
{
	const uint32_t all[SHAPE] = {m->per_lease, m->leases, m->tiles, PATH_CLASSES};
	memcpy(shape, all, sizeof all);
}

int moments_save(const struct moments *m, struct checked_file *out, struct error *e)
{
	uint32_t shape[SHAPE];
	shape_of(m, shape);
	int rc = checked_file_write_numbers(out, shape, sizeof *shape, SHAPE, e);
	if (!rc)
		rc = save_runs(out, m->first, m->tiles, MOMENTS_SETS * first_count(m) / m->tiles, e);
	if (!rc)
		rc = save_runs(out, m->second, m->tiles, MOMENTS_SETS * second_count(m) / m->tiles, e);
	if (!rc)
		rc = save_runs(out, m->time, EXACT_SUM_WORDS, MOMENTS_SETS * moments_classes(m), e);
	return rc ? rc : save_runs(out, m->bootstrap, EXACT_SUM_WORDS, moments_classes(m), e);
}

int moments_load(struct moments *m, struct checked_file *in, struct error *e)
{
	uint32_t shape[SHAPE], want[SHAPE];
	shape_of(m, want);
	int rc = checked_file_read_numbers(in, shape, sizeof *shape, SHAPE, e);
	if (!rc && memcmp(shape, want, sizeof want) != 0)
		rc = error_set(e, EBADMSG, "moments of other chains");
	if (!rc)
		rc = load_runs(in, m->first, m->tiles, MOMENTS_SETS * first_count(m) / m->tiles, e);
	if (!rc)
		rc = load_runs(in, m->second, m->tiles, MOMENTS_SETS * second_count(m) / m->tiles, e);
	if (!rc)
		rc = load_runs(in, m->time, EXACT_SUM_WORDS, MOMENTS_SETS * moments_classes(m), e);
	return rc ? rc : load_runs(in, m->bootstrap, EXACT_SUM_WORDS, moments_classes(m), e);
}
