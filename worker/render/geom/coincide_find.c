/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The search for coinciding surfaces (coincide.h). Boxes are divided in halves, with primitives across the middle in
 * both, until a part holds a single shape that does not emit (so there is nothing to find) or few primitives, or cannot
 * be divided further; then its primitives are compared pairwise, in the order of ranks. A triangle that is entirely
 * hidden hides nothing itself, so a stack of equal triangles does not cost quadratic time.
 *
 * An instance of a mesh is a single item until a cut would divide it or nothing else is left to divide; then it is
 * replaced by those triangles of its flat parts that meet the box around the other items. Most instances are alone by
 * then, or have no such triangles, and cost nothing.
 *
 * A small mesh that does not emit is a single item, too, but a cut does not divide it: it goes to each half
 * that contains a part of it, as its spine (coincide_spine.h) tells. Where no cut separates it from other
 * items, it is replaced by its triangles that are near another item and parallel to the latter's triangles, as
 * far as the spines can tell.
 *
 * The search is bounded in steps and in pairs. If it reaches a bound, the result holds what was found so far and is
 * marked `is_incomplete`, which the user is told. It fails with -ENOMEM if out of memory.
 */
#include "worker/render/geom/coincide_find.h"

#include "common/base/list.h"
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/geom/coincide_result.h"
#include "worker/render/geom/coincide_spine.h"
#include "worker/render/geom/flat_parts.h"

#include <stdlib.h>

#define WHOLE_SHAPE UINT32_MAX /* as the primitive number: an entire instance or small mesh */
enum { INSTANCED_TRIANGLES_MAX = 1 << 22 };
enum { SMALL_MESH_TRIANGLES_MAX = 2048 }; /* most triangles of a small mesh */
enum { COMPARED_MAX = 12, CUTS_MAX = 64, SAMPLE_SIZE = 129, OTHERS_MAX = 32, MANY_ITEMS = 16 * OTHERS_MAX };

struct search {
	const struct accel_shape *shapes;
	struct coincide_pair *pairs;
	size_t pair_count, pair_capacity, pair_limit;
	uint64_t work, work_limit; /* number of primitives put into parts, plus pairs compared */
	bool is_incomplete;
	double box_min[3], box_max[3]; /* the box that is currently searched */
	struct spine *spines;	       /* of the small meshes, by shape; NULL: there are none */
	struct flat_parts *flat_parts; /* of each mesh, at its first shape; NULL: there are no instances */
};

struct boxed_item {
	struct prim_ref prim;
	double box_min[3], box_max[3];
	struct spine_part part;	       /* for a small mesh */
	struct coincide_facing facing; /* only set in compare_part */
};

static bool is_small_shape(const struct accel_shape *s)
{
	return s->triangle_count > 0 && s->triangle_count <= SMALL_MESH_TRIANGLES_MAX && !s->is_sphere &&
	       !s->placement && s->rank != SURFACE_EMITS;
}

static bool is_small_mesh(const struct search *f, struct prim_ref p)
{
	return p.prim == WHOLE_SHAPE && !f->shapes[p.shape].placement;
}

static void instance_extent(const struct accel_shape *s, uint32_t prim, unsigned axis, double *low, double *high)
{
	double margin = s->placement->vertex_error;
	if (prim == WHOLE_SHAPE) {
		*low = vec3_component(s->placement->center, axis) - vec3_component(s->placement->half, axis) - margin;
		*high = vec3_component(s->placement->center, axis) + vec3_component(s->placement->half, axis) + margin;
		return;
	}
	const struct triangle t = accel_triangle(s, prim, 0);
	double u = vec3_component(t.v[0], axis), v = vec3_component(t.v[1], axis), w = vec3_component(t.v[2], axis);
	*low = fmin(u, fmin(v, w)) - margin;
	*high = fmax(u, fmax(v, w)) + margin;
}

/* The extent of the part of a small mesh within the box that is currently searched. */
static void small_mesh_extent(const struct search *f, uint32_t shape, struct spine_part part, unsigned axis,
			      double *low, double *high)
{
	spine_extent(&f->spines[shape], part, axis, low, high);
	*low = fmax(*low, f->box_min[axis]);
	*high = fmin(*high, f->box_max[axis]);
}

/* The extent of an item's box along an axis, slightly enlarged so that boxes with rounded coordinates meet. */
static void item_extent(const struct search *f, struct prim_ref p, unsigned axis, double *low, double *high)
{
	const struct accel_shape *s = &f->shapes[p.shape];
	if (is_small_mesh(f, p)) {
		struct spine_part part;
		spine_clip(&f->spines[p.shape], f->box_min, f->box_max, &part);
		small_mesh_extent(f, p.shape, part, axis, low, high);
		return;
	}
	if (s->placement) {
		instance_extent(s, p.prim, axis, low, high);
	} else if (s->is_sphere) {
		double c = vec3_component(s->center, axis);
		*low = c - s->radius;
		*high = c + s->radius;
	} else {
		const uint32_t *i = s->index[p.prim];
		float u = s->position[i[0]][axis], v = s->position[i[1]][axis], w = s->position[i[2]][axis];
		float smaller = u < v ? u : v, larger = u < v ? v : u;
		*low = (double)(w < smaller ? w : smaller);
		*high = (double)(w > larger ? w : larger);
	}
	double margin = 0x1p-21 * fmax(fabs(*low), fabs(*high));
	*low -= margin;
	*high += margin;
}

static struct boxed_item make_boxed_item(const struct search *f, struct prim_ref p)
{
	struct boxed_item m = {.prim = p};
	if (is_small_mesh(f, p))
		spine_clip(&f->spines[p.shape], f->box_min, f->box_max, &m.part);
	for (unsigned k = 0; k < 3; k++)
		if (is_small_mesh(f, p))
			small_mesh_extent(f, p.shape, m.part, k, &m.box_min[k], &m.box_max[k]);
		else
			item_extent(f, p, k, &m.box_min[k], &m.box_max[k]);
	return m;
}

/* Finds the cut with the smallest halves, judged by a sample. Returns false if they are hardly smaller than the box. */
static bool choose_cut(const struct search *f, const struct prim_ref *items, size_t n, unsigned *axis, double *position)
{
	struct boxed_item m[SAMPLE_SIZE];
	double middle[SAMPLE_SIZE];
	size_t count = n < SAMPLE_SIZE ? n : SAMPLE_SIZE, fewest = SIZE_MAX, small_count = 0;
	for (size_t i = 0; i < count; i++) {
		m[i] = make_boxed_item(f, items[(size_t)((double)n * (double)i / (double)count)]);
		small_count += is_small_mesh(f, m[i].prim);
	}
	for (unsigned k = 0; k < 3; k++) {
		size_t below = 0, above = 0;
		for (size_t i = 0; i < count; i++)
			middle[i] = m[i].box_min[k] + (m[i].box_max[k] - m[i].box_min[k]) / 2;
		qsort(middle, count, sizeof *middle, compare_doubles);
		double cut = middle[count / 2];
		for (size_t i = 0; i < count; i++) {
			below += m[i].box_min[k] <= cut;
			above += m[i].box_max[k] >= cut;
		}
		/* A half equal to the whole would be cut in the same way forever. */
		if (below + above < fewest && below < count && above < count) {
			fewest = below + above;
			*axis = k;
			*position = cut;
		}
	}
	/* Separating meshes saves comparing their triangles, so a cut may gain less. A few other items could as well be
	 * compared, so a cut must save at least as much as that costs. */
	if (2 * small_count > count)
		return fewest < SIZE_MAX && fewest * 4 <= count * 7;
	return fewest < SIZE_MAX && (n < MANY_ITEMS ? fewest * 5 <= count * 7 : fewest * 3 <= count * 5);
}

static bool is_emitter(const struct search *f, struct prim_ref p)
{
	return f->shapes[p.shape].rank == SURFACE_EMITS;
}

/* Whether all items belong to one shape that does not emit. */
static bool nothing_to_find(const struct search *f, const struct prim_ref *items, size_t n)
{
	for (size_t i = 1; i < n; i++)
		if (items[i].shape != items[0].shape)
			return false;
	return n < 2 || !is_emitter(f, items[0]);
}

static bool test_pair(const struct search *f, struct coincide_pair *p)
{
	const struct accel_shape *a = &f->shapes[p->hidden.shape], *b = &f->shapes[p->covering.shape];
	p->covers_all = p->faces_same_side = true;
	if (a->is_sphere || b->is_sphere)
		return a->is_sphere && b->is_sphere && coincide_spheres(a, b);
	const struct triangle t = accel_triangle(a, p->hidden.prim, 0), u = accel_triangle(b, p->covering.prim, 0);
	double vertex_error =
		(a->placement ? a->placement->vertex_error : 0) + (b->placement ? b->placement->vertex_error : 0);
	p->faces_same_side = vec3_dot(t.n, u.n) > 0;
	return coincide_triangles(&t, &u, vertex_error, &p->covers_all);
}

static int add_pair(struct search *f, const struct coincide_pair *p)
{
	if (f->pair_count == f->pair_limit) {
		f->is_incomplete = true;
		return 0;
	}
	if (f->pair_count == f->pair_capacity) {
		size_t capacity = f->pair_capacity ? 2 * f->pair_capacity : 64;
		struct coincide_pair *grown =
			mem_grow(f->pairs, f->pair_capacity * sizeof *grown, capacity * sizeof *grown);
		if (!grown)
			return -ENOMEM;
		f->pairs = grown;
		f->pair_capacity = capacity;
	}
	f->pairs[f->pair_count++] = *p;
	return 0;
}

static bool items_may_meet(const struct search *f, const struct boxed_item *a, const struct boxed_item *b)
{
	if (a->prim.shape == b->prim.shape && !is_emitter(f, a->prim))
		return false;
	for (int k = 0; k < 3; k++)
		if (a->box_max[k] < b->box_min[k] || b->box_max[k] < a->box_min[k])
			return false;
	return true;
}

/* Compares each primitive with those before it, which have lower ranks, that are not entirely hidden. */
static int compare_items(struct search *f, struct boxed_item *m, size_t n)
{
	size_t kept = 0;
	for (size_t i = 0; i < n && !f->is_incomplete; i++) {
		bool is_hidden = false;
		for (size_t j = 0; j < kept && !is_hidden; j++) {
			struct coincide_pair p = {
				.hidden = m[i].prim, .covering = m[j].prim, .rank = f->shapes[m[j].prim.shape].rank};
			f->work++;
			if (!items_may_meet(f, &m[i], &m[j]) ||
			    coincide_directions_differ(&m[i].facing, &m[j].facing) || !test_pair(f, &p))
				continue;
			int rc = add_pair(f, &p);
			if (rc)
				return rc;
			is_hidden = p.covers_all;
		}
		if (!is_hidden)
			m[kept++] = m[i];
		f->is_incomplete |= f->work > f->work_limit;
		liveness_tick();
	}
	return 0;
}

static int compare_part(struct search *f, const struct prim_ref *items, size_t n)
{
	struct boxed_item buffer[COMPARED_MAX], *m = n <= COMPARED_MAX ? buffer : mem_alloc(n, sizeof *m);
	if (!m)
		return -ENOMEM;
	for (size_t i = 0; i < n; i++) {
		const struct accel_shape *s = &f->shapes[items[i].shape];
		m[i] = make_boxed_item(f, items[i]);
		if (s->is_sphere || s->placement)
			continue;
		const struct triangle t = accel_triangle(s, items[i].prim, 0);
		m[i].facing = coincide_facing_from_triangle(&t);
	}
	int rc = compare_items(f, m, n);
	if (m != buffer)
		mem_free(m);
	return rc;
}

/* Returns the shape to which most of the items belong, if more than half do (majority vote). */
static uint32_t most_common_shape(const struct prim_ref *items, size_t n)
{
	uint32_t shape = items[0].shape;
	size_t votes = 0;
	for (size_t i = 0; i < n; i++) {
		if (votes == 0)
			shape = items[i].shape;
		votes = items[i].shape == shape ? votes + 1 : votes - 1;
	}
	return shape;
}

/* Keeps only those primitives of the commonest shape that meet the box of one of the few others: most of a statue does
 * not touch its room. Returns the number of items that remain, which are at the front. */
static size_t drop_distant_items(const struct search *f, struct prim_ref *items, size_t n)
{
	struct boxed_item others[OTHERS_MAX];
	size_t count = 0, kept = 0;
	uint32_t shape = most_common_shape(items, n);
	for (size_t i = 0; i < n; i++)
		if (items[i].shape != shape) {
			if (count == OTHERS_MAX)
				return n;
			others[count++] = make_boxed_item(f, items[i]);
		}
	for (size_t i = 0; i < n; i++) {
		bool is_near = items[i].shape != shape;
		const struct boxed_item m = make_boxed_item(f, items[i]);
		for (size_t k = 0; k < count && !is_near; k++)
			is_near = items_may_meet(f, &m, &others[k]);
		if (is_near)
			items[kept++] = items[i];
		if (i % 4096 == 0)
			liveness_tick();
	}
	return kept;
}

static int search_items(struct search *f, struct prim_ref *items, size_t n, unsigned cuts);

/* A cut; `is_valid` is false if there is none. */
struct cut {
	bool is_valid;
	unsigned axis;
	double position;
};

/* Whether an item is replaced by its triangles: an instance across the cut; without a cut, all instances and meshes. */
static bool is_divided(const struct search *f, struct prim_ref p, const struct cut *c)
{
	double low, high;
	if (p.prim != WHOLE_SHAPE)
		return false;
	if (is_small_mesh(f, p))
		return !c->is_valid;
	item_extent(f, p, c->axis, &low, &high);
	return !c->is_valid || (low <= c->position && high >= c->position);
}

static const struct flat_parts *instance_flat_parts(const struct search *f, uint32_t instance)
{
	return &f->flat_parts[f->shapes[instance].placement->first_shape];
}

/* Returns the room needed for all items and the triangles of those that are replaced; 0 if none is. */
static size_t count_divided(const struct search *f, const struct prim_ref *items, size_t n, const struct cut *c)
{
	size_t count = n;
	bool divides = false;
	for (size_t i = 0; i < n; i++)
		if (is_divided(f, items[i], c)) {
			divides = true;
			count += is_small_mesh(f, items[i]) ? f->shapes[items[i].shape].triangle_count
							    : instance_flat_parts(f, items[i].shape)->count;
		}
	return divides ? count : 0;
}

/* Returns the box around all items but one; if there are many items, all of space. */
static struct boxed_item box_of_others(const struct search *f, const struct prim_ref *items, size_t n, size_t excluded)
{
	double bound = n > MANY_ITEMS ? INFINITY : -INFINITY;
	struct boxed_item box = {
		.prim = PRIM_NONE, .box_min = {-bound, -bound, -bound}, .box_max = {bound, bound, bound}};
	if (n > MANY_ITEMS)
		return box;
	for (size_t i = 0; i < n; i++)
		for (unsigned k = 0; k < 3 && i != excluded; k++) {
			double low, high;
			item_extent(f, items[i], k, &low, &high);
			box.box_min[k] = fmin(box.box_min[k], low);
			box.box_max[k] = fmax(box.box_max[k], high);
		}
	return box;
}

/* Appends those triangles of an instance's flat parts that meet the box. Returns their number. */
static size_t append_instance_triangles(struct search *f, uint32_t shape, const struct boxed_item *box,
					struct prim_ref *out)
{
	size_t count = 0;
	const struct flat_parts *flat = instance_flat_parts(f, shape);
	f->work += flat->count;
	for (uint32_t k = 0; k < flat->count; k++) {
		const struct boxed_item m = make_boxed_item(f, (struct prim_ref){shape, flat->prims[k], 0});
		if (items_may_meet(f, &m, box))
			out[count++] = m.prim;
		if (k % 4096 == 0)
			liveness_tick();
	}
	return count;
}

/* Finds the items near the small mesh, at most OTHERS_MAX of them. Returns their number; OTHERS_MAX + 1 if there are
 * more. */
static size_t find_near_items(struct search *f, const struct prim_ref *items, size_t n, const struct boxed_item *m,
			      struct boxed_item *others)
{
	size_t count = 0;
	f->work += n;
	for (size_t i = 0; i < n; i++) {
		const struct boxed_item o = make_boxed_item(f, items[i]);
		if (!items_may_meet(f, m, &o) || f->shapes[o.prim.shape].is_sphere ||
		    (is_small_mesh(f, o.prim) &&
		     !spines_may_meet(&f->spines[m->prim.shape], m->part, &f->spines[o.prim.shape], o.part)))
			continue;
		if (count == OTHERS_MAX)
			return OTHERS_MAX + 1;
		others[count++] = o;
	}
	return count;
}

/* The items near a small mesh, and how much its triangles may lean to be parallel to theirs (spine_max_parallel_lean).
 */
struct near_items {
	size_t count; /* OTHERS_MAX + 1: there are more */
	struct boxed_item others[OTHERS_MAX];
	double max_lean[OTHERS_MAX];
};

static bool is_near_any_item(const struct search *f, struct prim_ref p, const struct near_items *nearby)
{
	const struct triangle t = accel_triangle(&f->shapes[p.shape], p.prim, 0);
	double n2 = vec3_dot(t.n, t.n);
	for (size_t i = 0; i < nearby->count; i++) {
		const struct boxed_item *o = &nearby->others[i];
		if (is_small_mesh(f, o->prim)) {
			double lean = vec3_dot(t.n, f->spines[o->prim.shape].direction);
			if (lean * lean > nearby->max_lean[i] * nearby->max_lean[i] * n2)
				continue;
		}
		const struct boxed_item m = make_boxed_item(f, p);
		if (items_may_meet(f, &m, o))
			return true;
	}
	return false;
}

static void find_max_leans(const struct search *f, uint32_t shape, struct near_items *nearby)
{
	for (size_t i = 0; i < nearby->count && i < OTHERS_MAX; i++)
		if (is_small_mesh(f, nearby->others[i].prim))
			nearby->max_lean[i] =
				spine_max_parallel_lean(&f->spines[nearby->others[i].prim.shape], &f->spines[shape]);
}

/* Whether the triangle meets the searched box. Used where there are too many items to compare it with. */
static bool is_in_box(const struct search *f, struct prim_ref p)
{
	const struct boxed_item m = make_boxed_item(f, p);
	for (int k = 0; k < 3; k++)
		if (m.box_max[k] < f->box_min[k] || m.box_min[k] > f->box_max[k])
			return false;
	return true;
}

/* Appends those triangles of a small mesh, one of the items, that are near another item. Returns their number. */
static size_t append_small_mesh_triangles(struct search *f, const struct prim_ref *items, size_t n, uint32_t shape,
					  struct prim_ref *out)
{
	struct near_items nearby = {.count = OTHERS_MAX + 1};
	const struct boxed_item mesh = make_boxed_item(f, (struct prim_ref){shape, WHOLE_SHAPE, 0});
	size_t count = 0;
	if (n <= MANY_ITEMS)
		nearby.count = find_near_items(f, items, n, &mesh, nearby.others);
	if (nearby.count == 0)
		return 0;
	find_max_leans(f, shape, &nearby);
	f->work += f->shapes[shape].triangle_count;
	for (uint32_t k = 0; k < f->shapes[shape].triangle_count; k++) {
		const struct prim_ref p = {shape, k, 0};
		if (nearby.count > OTHERS_MAX ? is_in_box(f, p) : is_near_any_item(f, p, &nearby))
			out[count++] = p;
	}
	liveness_tick();
	return count;
}

static size_t divide_items(struct search *f, const struct prim_ref *items, size_t n, const struct cut *c,
			   struct prim_ref *out)
{
	size_t count = 0;
	for (size_t i = 0; i < n; i++) {
		if (!is_divided(f, items[i], c)) {
			out[count++] = items[i];
			continue;
		}
		if (is_small_mesh(f, items[i])) {
			count += append_small_mesh_triangles(f, items, n, items[i].shape, out + count);
			continue;
		}
		const struct boxed_item box = box_of_others(f, items, n, i);
		count += append_instance_triangles(f, items[i].shape, &box, out + count);
	}
	return count;
}

/* Whether an item meets the half that is the box currently searched. */
static bool is_in_half(const struct search *f, struct prim_ref p, bool upper, const struct cut *c)
{
	double low, high;
	struct spine_part unused;
	if (is_small_mesh(f, p))
		return spine_clip(&f->spines[p.shape], f->box_min, f->box_max, &unused);
	item_extent(f, p, c->axis, &low, &high);
	return upper ? high >= c->position : low <= c->position;
}

static int search_halves(struct search *f, const struct prim_ref *items, size_t n, unsigned cuts, const struct cut *c)
{
	struct prim_ref *half = mem_alloc(n, sizeof *half);
	int rc = half ? 0 : -ENOMEM;
	for (int upper = 0; upper < 2 && !rc; upper++) {
		double *side = upper ? &f->box_min[c->axis] : &f->box_max[c->axis], bound = *side;
		size_t count = 0;
		*side = c->position;
		for (size_t i = 0; i < n; i++) {
			if (is_in_half(f, items[i], upper, c))
				half[count++] = items[i];
			if (i % 4096 == 0)
				liveness_tick();
		}
		rc = search_items(f, half, count, cuts - 1);
		*side = bound;
	}
	mem_free(half);
	return rc;
}

/* Searches the items, which are sorted by rank and are overwritten. cuts: how many more cuts are allowed. */
static int search_items(struct search *f, struct prim_ref *items, size_t n, unsigned cuts)
{
	struct cut c = {.is_valid = false};
	f->work += n;
	f->is_incomplete |= f->work > f->work_limit;
	if (f->is_incomplete || nothing_to_find(f, items, n))
		return 0;
	if (n > MANY_ITEMS && f->shapes[most_common_shape(items, n)].rank != SURFACE_EMITS)
		n = drop_distant_items(f, items, n);
	c.is_valid = n > COMPARED_MAX && cuts > 0 && choose_cut(f, items, n, &c.axis, &c.position);
	size_t capacity = count_divided(f, items, n, &c);
	if (capacity == 0)
		return c.is_valid ? search_halves(f, items, n, cuts, &c) : compare_part(f, items, n);
	f->is_incomplete |= f->work + capacity > f->work_limit;
	if (f->is_incomplete)
		return 0;
	struct prim_ref *divided = mem_alloc(capacity, sizeof *divided);
	if (!divided)
		return -ENOMEM;
	size_t count = divide_items(f, items, n, &c, divided);
	int rc = c.is_valid ? search_halves(f, divided, count, cuts, &c) : search_items(f, divided, count, cuts);
	mem_free(divided);
	return rc;
}

/* Lists all primitives by rank, instances and small meshes as single items. Returns their number; items may be NULL. */
static size_t list_primitives(const struct accel_shape *shapes, uint32_t count, struct prim_ref *items)
{
	size_t n = 0;
	for (unsigned rank = 0; rank < SURFACE_RANKS; rank++)
		for (uint32_t i = 0; i < count; i++) {
			bool is_single = shapes[i].is_sphere || shapes[i].placement || is_small_shape(&shapes[i]);
			uint32_t prims = is_single ? !accel_shape_is_moving(&shapes[i]) : shapes[i].triangle_count;
			for (uint32_t k = 0; shapes[i].rank == rank && k < prims; k++, n++)
				if (items)
					items[n] = (struct prim_ref){
						i, shapes[i].placement || is_small_shape(&shapes[i]) ? WHOLE_SHAPE : k,
						0};
		}
	return n;
}

/* Finds the flat parts of shared meshes. *instanced: the number of their triangles over all instances that do not move.
 */
static int find_flat_parts(struct search *f, uint32_t count, size_t *instanced)
{
	*instanced = 0;
	for (uint32_t i = 0; i < count; i++) {
		const struct placement *p = f->shapes[i].placement;
		if (!p || f->shapes[i].is_sphere)
			continue;
		if (!f->flat_parts && !(f->flat_parts = mem_alloc(count, sizeof *f->flat_parts)))
			return -ENOMEM;
		int rc = p->first_shape == i ? flat_parts_find(&f->flat_parts[i], &f->shapes[i]) : 0;
		if (rc)
			return rc;
		*instanced += p->movement ? 0 : f->flat_parts[p->first_shape].count;
	}
	return 0;
}

/* Computes the spines of small meshes. *triangles: the total number of triangles in them. */
static int find_spines(struct search *f, uint32_t count, size_t *triangles)
{
	*triangles = 0;
	for (uint32_t i = 0; i < count; i++) {
		if (!is_small_shape(&f->shapes[i]))
			continue;
		if (!f->spines && !(f->spines = mem_alloc(count, sizeof *f->spines)))
			return -ENOMEM;
		f->spines[i] = spine_make(&f->shapes[i]);
		*triangles += f->shapes[i].triangle_count;
		liveness_tick();
	}
	return 0;
}

static int search_all(struct search *f, uint32_t count, size_t n)
{
	size_t instanced, small;
	int rc = find_flat_parts(f, count, &instanced);
	rc = rc ? rc : find_spines(f, count, &small);
	struct prim_ref *items = rc ? NULL : mem_alloc(n, sizeof *items);
	if (!items)
		return -ENOMEM;
	/* The limits suffice for complete sorting and for each primitive to meet dozens of others, but not for all
	 * triangles of a huge number of instances. */
	size_t total = n + small,
	       instanced_limited = instanced < INSTANCED_TRIANGLES_MAX ? instanced : INSTANCED_TRIANGLES_MAX;
	f->work_limit = 128 * (uint64_t)total + (1u << 25) + 16 * (uint64_t)instanced_limited;
	f->pair_limit = 4 * total + (1u << 16) + instanced_limited;
	list_primitives(f->shapes, count, items);
	rc = search_items(f, items, n, CUTS_MAX);
	mem_free(items);
	return rc;
}

int coincide_find(struct coincidence **out, const struct accel_shape *shapes, uint32_t count, struct error *e)
{
	*out = NULL;
	struct search f = {.shapes = shapes,
			   .box_min = {-INFINITY, -INFINITY, -INFINITY},
			   .box_max = {INFINITY, INFINITY, INFINITY}};
	int rc = search_all(&f, count, list_primitives(shapes, count, NULL));
	for (uint32_t i = 0; f.flat_parts && i < count; i++)
		mem_free(f.flat_parts[i].prims);
	mem_free(f.flat_parts);
	mem_free(f.spines);
	if (!rc && (f.pair_count > 0 || f.is_incomplete))
		rc = coincide_make_result(f.pairs, f.pair_count, f.is_incomplete, count, out);
	else
		mem_free(f.pairs);
	return rc ? error_set(e, ENOMEM, "out of memory") : 0;
}
