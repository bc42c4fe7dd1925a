/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/geom/coincide_result.h"

#include "common/base/mem.h"

#include <errno.h>
#include <stdlib.h>

static int compare_pairs(const void *x, const void *y)
{
	const struct coincide_pair *a = x, *b = y;
	const uint32_t u[] = {a->hidden.shape, a->hidden.prim, (uint32_t)a->rank, a->covering.shape, a->covering.prim};
	const uint32_t v[] = {b->hidden.shape, b->hidden.prim, (uint32_t)b->rank, b->covering.shape, b->covering.prim};
	for (int i = 0; i < 5; i++)
		if (u[i] != v[i])
			return u[i] < v[i] ? -1 : 1;
	return 0;
}

static int compare_shapes(const void *x, const void *y)
{
	const struct coincide_shape_pair *a = x, *b = y;
	if (a->hidden != b->hidden)
		return a->hidden < b->hidden ? -1 : 1;
	return a->covering < b->covering ? -1 : a->covering > b->covering;
}

/* Sorts the pairs and removes duplicates: pairs across a cut were found more than once. Returns the number left. */
static size_t unique_pairs(struct coincide_pair *p, size_t n)
{
	size_t kept = 0;
	if (n == 0) /* p may be NULL then, which qsort does not allow */
		return 0;
	qsort(p, n, sizeof *p, compare_pairs);
	for (size_t i = 0; i < n; i++)
		if (kept == 0 || compare_pairs(&p[kept - 1], &p[i]) != 0)
			p[kept++] = p[i];
	return kept;
}

static void list_shapes(struct coincidence *c)
{
	struct coincide_shape_pair *s = c->shape_pairs;
	for (size_t i = 0; i < c->pair_count; i++)
		s[i] = (struct coincide_shape_pair){c->pairs[i].hidden.shape, c->pairs[i].covering.shape,
						    c->pairs[i].faces_same_side};
	if (c->pair_count > 1)
		qsort(s, c->pair_count, sizeof *s, compare_shapes);
	for (size_t i = 0; i < c->pair_count; i++) {
		if (c->shape_pair_count == 0 || compare_shapes(&s[c->shape_pair_count - 1], &s[i]) != 0)
			s[c->shape_pair_count++] = s[i];
		else
			s[c->shape_pair_count - 1].faces_same_side |= s[i].faces_same_side;
	}
}

int coincide_make_result(struct coincide_pair *pairs, size_t n, bool is_incomplete, uint32_t count,
			 struct coincidence **out)
{
	struct coincidence *c = mem_alloc(1, sizeof *c);
	if (!c) {
		mem_free(pairs);
		return -ENOMEM;
	}
	*c = (struct coincidence){.pairs = pairs, .pair_count = unique_pairs(pairs, n), .is_incomplete = is_incomplete};
	c->shape_pairs = mem_alloc(c->pair_count, sizeof *c->shape_pairs);
	c->first_pair = mem_alloc((size_t)count + 1, sizeof *c->first_pair);
	if (!c->shape_pairs || !c->first_pair) {
		coincide_free(c);
		return -ENOMEM;
	}
	list_shapes(c);
	for (size_t i = 0; i < c->pair_count; i++)
		c->first_pair[c->pairs[i].hidden.shape + 1] = i + 1;
	for (uint32_t i = 0; i < count; i++)
		if (c->first_pair[i + 1] < c->first_pair[i])
			c->first_pair[i + 1] = c->first_pair[i];
	*out = c;
	return 0;
}
