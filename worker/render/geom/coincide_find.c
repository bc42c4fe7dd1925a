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
 * marked `incomplete`, which the user is told. It fails with -ENOMEM if out of memory.
 */
#include "worker/render/geom/coincide_find.h"

#include "common/base/list.h"
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "worker/render/geom/coincide_result.h"
#include "worker/render/geom/coincide_spine.h"
#include "worker/render/geom/flat_parts.h"

#include <stdlib.h>

#define WHOLE UINT32_MAX /* as the primitive number: an entire instance or small mesh */
enum { INSTANCED_MAX = 1 << 22 };
enum { SMALL = 2048 }; /* most triangles of a small mesh */
enum { FEW = 12, MOST_CUTS = 64, SAMPLE = 129, OTHERS = 32, MANY = 16 * OTHERS };

struct search {
	const struct accel_shape *shapes;
	struct coincide_pair *pairs;
	size_t pair_count, pair_room, pair_limit;
	uint64_t work, limit; /* number of primitives put into parts, plus pairs compared */
	bool incomplete;
	double low[3], high[3];	 /* the box that is currently searched */
	struct spine *spines;	 /* of the small meshes, by shape; NULL: there are none */
	struct flat_parts *flat; /* of each mesh, at its first shape; NULL: there are no instances */
};

struct member {
	struct prim_ref prim;
	double low[3], high[3];
	struct spine_part part;	       /* for a small mesh */
	struct coincide_facing facing; /* only set in compare_part */
};

static bool is_small(const struct accel_shape *s)
{
	return s->triangle_count > 0 && s->triangle_count <= SMALL && !s->is_sphere && !s->place &&
	       s->rank != SURFACE_SHINES;
}

static bool is_small_mesh(const struct search *f, struct prim_ref p)
{
	return p.prim == WHOLE && !f->shapes[p.shape].place;
}

static void extent_of_instance(const struct accel_shape *s, uint32_t prim, unsigned axis, double *low, double *high)
{
	double margin = s->place->vertex_is_off;
	if (prim == WHOLE) {
		*low = vec3_along(s->place->center, axis) - vec3_along(s->place->half, axis) - margin;
		*high = vec3_along(s->place->center, axis) + vec3_along(s->place->half, axis) + margin;
		return;
	}
	const struct triangle t = accel_triangle(s, prim, 0);
	double u = vec3_along(t.v[0], axis), v = vec3_along(t.v[1], axis), w = vec3_along(t.v[2], axis);
	*low = fmin(u, fmin(v, w)) - margin;
	*high = fmax(u, fmax(v, w)) + margin;
}

/* The extent of the part of a small mesh within the box that is currently searched. */
static void extent_of_small(const struct search *f, uint32_t shape, struct spine_part part, unsigned axis, double *low,
			    double *high)
{
	spine_extent(&f->spines[shape], part, axis, low, high);
	*low = fmax(*low, f->low[axis]);
	*high = fmin(*high, f->high[axis]);
}

/* The extent of an item's box along an axis, slightly enlarged so that boxes with rounded coordinates meet. */
static void extent(const struct search *f, struct prim_ref p, unsigned axis, double *low, double *high)
{
	const struct accel_shape *s = &f->shapes[p.shape];
	if (is_small_mesh(f, p)) {
		struct spine_part part;
		spine_clip(&f->spines[p.shape], f->low, f->high, &part);
		extent_of_small(f, p.shape, part, axis, low, high);
		return;
	}
	if (s->place) {
		extent_of_instance(s, p.prim, axis, low, high);
	} else if (s->is_sphere) {
		double c = vec3_along(s->center, axis);
		*low = c - s->radius;
		*high = c + s->radius;
	} else {
		const uint32_t *i = s->index[p.prim];
		float u = s->position[i[0]][axis], v = s->position[i[1]][axis], w = s->position[i[2]][axis];
		float least = u < v ? u : v, most = u < v ? v : u;
		*low = (double)(w < least ? w : least);
		*high = (double)(w > most ? w : most);
	}
	double margin = 0x1p-21 * fmax(fabs(*low), fabs(*high));
	*low -= margin;
	*high += margin;
}

static struct member member_of(const struct search *f, struct prim_ref p)
{
	struct member m = {.prim = p};
	if (is_small_mesh(f, p))
		spine_clip(&f->spines[p.shape], f->low, f->high, &m.part);
	for (unsigned k = 0; k < 3; k++)
		if (is_small_mesh(f, p))
			extent_of_small(f, p.shape, m.part, k, &m.low[k], &m.high[k]);
		else
			extent(f, p, k, &m.low[k], &m.high[k]);
	return m;
}

/* Finds the cut with the smallest halves, judged by a sample. Returns false if they are hardly smaller than the box. */
static bool choose_cut(const struct search *f, const struct prim_ref *items, size_t n, unsigned *axis, double *at)
{
	struct member m[SAMPLE];
	double middle[SAMPLE];
	size_t count = n < SAMPLE ? n : SAMPLE, least = SIZE_MAX, small = 0;
	for (size_t i = 0; i < count; i++) {
		m[i] = member_of(f, items[(size_t)((double)n * (double)i / (double)count)]);
		small += is_small_mesh(f, m[i].prim);
	}
	for (unsigned k = 0; k < 3; k++) {
		size_t below = 0, above = 0;
		for (size_t i = 0; i < count; i++)
			middle[i] = m[i].low[k] + (m[i].high[k] - m[i].low[k]) / 2;
		qsort(middle, count, sizeof *middle, double_compare);
		double cut = middle[count / 2];
		for (size_t i = 0; i < count; i++) {
			below += m[i].low[k] <= cut;
			above += m[i].high[k] >= cut;
		}
		/* A half equal to the whole would be cut in the same way forever. */
		if (below + above < least && below < count && above < count) {
			least = below + above;
			*axis = k;
			*at = cut;
		}
	}
	/* Separating meshes saves comparing their triangles, so a cut may gain less. A few other items could as well be
	 * compared, so a cut must save at least as much as that costs. */
	if (2 * small > count)
		return least < SIZE_MAX && least * 4 <= count * 7;
	return least < SIZE_MAX && (n < MANY ? least * 5 <= count * 7 : least * 3 <= count * 5);
}

static bool is_emitter(const struct search *f, struct prim_ref p)
{
	return f->shapes[p.shape].rank == SURFACE_SHINES;
}

/* Whether all items belong to one shape that does not emit. */
static bool nothing_to_find(const struct search *f, const struct prim_ref *items, size_t n)
{
	for (size_t i = 1; i < n; i++)
		if (items[i].shape != items[0].shape)
			return false;
	return n < 2 || !is_emitter(f, items[0]);
}

static bool coincide(const struct search *f, struct coincide_pair *p)
{
	const struct accel_shape *a = &f->shapes[p->hidden.shape], *b = &f->shapes[p->by.shape];
	p->wholly = p->same_side = true;
	if (a->is_sphere || b->is_sphere)
		return a->is_sphere && b->is_sphere && coincide_spheres(a, b);
	const struct triangle t = accel_triangle(a, p->hidden.prim, 0), u = accel_triangle(b, p->by.prim, 0);
	double off = (a->place ? a->place->vertex_is_off : 0) + (b->place ? b->place->vertex_is_off : 0);
	p->same_side = vec3_dot(t.n, u.n) > 0;
	return coincide_triangles(&t, &u, off, &p->wholly);
}

static int add_pair(struct search *f, const struct coincide_pair *p)
{
	if (f->pair_count == f->pair_limit) {
		f->incomplete = true;
		return 0;
	}
	if (f->pair_count == f->pair_room) {
		size_t room = f->pair_room ? 2 * f->pair_room : 64;
		struct coincide_pair *more = mem_grow(f->pairs, f->pair_room * sizeof *more, room * sizeof *more);
		if (!more)
			return -ENOMEM;
		f->pairs = more;
		f->pair_room = room;
	}
	f->pairs[f->pair_count++] = *p;
	return 0;
}

static bool may_meet(const struct search *f, const struct member *a, const struct member *b)
{
	if (a->prim.shape == b->prim.shape && !is_emitter(f, a->prim))
		return false;
	for (int k = 0; k < 3; k++)
		if (a->high[k] < b->low[k] || b->high[k] < a->low[k])
			return false;
	return true;
}

/* Compares each primitive with those before it, which have lower ranks, that are not entirely hidden. */
static int compare_all(struct search *f, struct member *m, size_t n)
{
	size_t kept = 0;
	for (size_t i = 0; i < n && !f->incomplete; i++) {
		bool gone = false;
		for (size_t j = 0; j < kept && !gone; j++) {
			struct coincide_pair p = {
				.hidden = m[i].prim, .by = m[j].prim, .rank = f->shapes[m[j].prim.shape].rank};
			f->work++;
			if (!may_meet(f, &m[i], &m[j]) || coincide_faces_away(&m[i].facing, &m[j].facing) ||
			    !coincide(f, &p))
				continue;
			int rc = add_pair(f, &p);
			if (rc)
				return rc;
			gone = p.wholly;
		}
		if (!gone)
			m[kept++] = m[i];
		f->incomplete |= f->work > f->limit;
		liveness_tick();
	}
	return 0;
}

static int compare_part(struct search *f, const struct prim_ref *items, size_t n)
{
	struct member few[FEW], *m = n <= FEW ? few : mem_alloc(n, sizeof *m);
	if (!m)
		return -ENOMEM;
	for (size_t i = 0; i < n; i++) {
		const struct accel_shape *s = &f->shapes[items[i].shape];
		m[i] = member_of(f, items[i]);
		if (s->is_sphere || s->place)
			continue;
		const struct triangle t = accel_triangle(s, items[i].prim, 0);
		m[i].facing = coincide_facing_of(&t);
	}
	int rc = compare_all(f, m, n);
	if (m != few)
		mem_free(m);
	return rc;
}

/* Returns the shape to which most of the items belong, if more than half do (majority vote). */
static uint32_t commonest(const struct prim_ref *items, size_t n)
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
static size_t leave_out(const struct search *f, struct prim_ref *items, size_t n)
{
	struct member others[OTHERS];
	size_t count = 0, kept = 0;
	uint32_t shape = commonest(items, n);
	for (size_t i = 0; i < n; i++)
		if (items[i].shape != shape) {
			if (count == OTHERS)
				return n;
			others[count++] = member_of(f, items[i]);
		}
	for (size_t i = 0; i < n; i++) {
		bool near = items[i].shape != shape;
		const struct member m = member_of(f, items[i]);
		for (size_t k = 0; k < count && !near; k++)
			near = may_meet(f, &m, &others[k]);
		if (near)
			items[kept++] = items[i];
		if (i % 4096 == 0)
			liveness_tick();
	}
	return kept;
}

static int look_into(struct search *f, struct prim_ref *items, size_t n, unsigned cuts);

/* A cut; `is` is false if there is none. */
struct cut {
	bool is;
	unsigned axis;
	double at;
};

/* Whether an item is replaced by its triangles: an instance across the cut; without a cut, all instances and meshes. */
static bool is_divided(const struct search *f, struct prim_ref p, const struct cut *c)
{
	double low, high;
	if (p.prim != WHOLE)
		return false;
	if (is_small_mesh(f, p))
		return !c->is;
	extent(f, p, c->axis, &low, &high);
	return !c->is || (low <= c->at && high >= c->at);
}

static const struct flat_parts *flat_of(const struct search *f, uint32_t instance)
{
	return &f->flat[f->shapes[instance].place->first];
}

/* Returns the room needed for all items and the triangles of those that are replaced; 0 if none is. */
static size_t room_divided(const struct search *f, const struct prim_ref *items, size_t n, const struct cut *c)
{
	size_t room = n;
	bool any = false;
	for (size_t i = 0; i < n; i++)
		if (is_divided(f, items[i], c)) {
			any = true;
			room += is_small_mesh(f, items[i]) ? f->shapes[items[i].shape].triangle_count
							   : flat_of(f, items[i].shape)->count;
		}
	return any ? room : 0;
}

/* Returns the box around all items but one; if there are many items, all of space. */
static struct member box_of_others(const struct search *f, const struct prim_ref *items, size_t n, size_t without)
{
	double edge = n > MANY ? INFINITY : -INFINITY;
	struct member box = {.prim = PRIM_NONE, .low = {-edge, -edge, -edge}, .high = {edge, edge, edge}};
	if (n > MANY)
		return box;
	for (size_t i = 0; i < n; i++)
		for (unsigned k = 0; k < 3 && i != without; k++) {
			double low, high;
			extent(f, items[i], k, &low, &high);
			box.low[k] = fmin(box.low[k], low);
			box.high[k] = fmax(box.high[k], high);
		}
	return box;
}

/* Appends those triangles of an instance's flat parts that meet the box. Returns their number. */
static size_t divide(struct search *f, uint32_t shape, const struct member *box, struct prim_ref *out)
{
	size_t count = 0;
	const struct flat_parts *flat = flat_of(f, shape);
	f->work += flat->count;
	for (uint32_t k = 0; k < flat->count; k++) {
		const struct member m = member_of(f, (struct prim_ref){shape, flat->prim[k], 0});
		if (may_meet(f, &m, box))
			out[count++] = m.prim;
		if (k % 4096 == 0)
			liveness_tick();
	}
	return count;
}

/* Finds the items near the small mesh, at most OTHERS of them. Returns their number; OTHERS + 1 if there are more. */
static size_t find_near(struct search *f, const struct prim_ref *items, size_t n, const struct member *m,
			struct member *others)
{
	size_t count = 0;
	f->work += n;
	for (size_t i = 0; i < n; i++) {
		const struct member o = member_of(f, items[i]);
		if (!may_meet(f, m, &o) || f->shapes[o.prim.shape].is_sphere ||
		    (is_small_mesh(f, o.prim) &&
		     !spines_meet(&f->spines[m->prim.shape], m->part, &f->spines[o.prim.shape], o.part)))
			continue;
		if (count == OTHERS)
			return OTHERS + 1;
		others[count++] = o;
	}
	return count;
}

/* The items near a small mesh, and how much its triangles may lean to be parallel to theirs (spine_lean_at_most). */
struct near {
	size_t count; /* OTHERS + 1: there are more */
	struct member others[OTHERS];
	double lean[OTHERS];
};

static bool is_near_any(const struct search *f, struct prim_ref p, const struct near *near)
{
	const struct triangle t = accel_triangle(&f->shapes[p.shape], p.prim, 0);
	double n2 = vec3_dot(t.n, t.n);
	for (size_t i = 0; i < near->count; i++) {
		const struct member *o = &near->others[i];
		if (is_small_mesh(f, o->prim)) {
			double lean = vec3_dot(t.n, f->spines[o->prim.shape].direction);
			if (lean * lean > near->lean[i] * near->lean[i] * n2)
				continue;
		}
		const struct member m = member_of(f, p);
		if (may_meet(f, &m, o))
			return true;
	}
	return false;
}

static void find_leans(const struct search *f, uint32_t shape, struct near *near)
{
	for (size_t i = 0; i < near->count && i < OTHERS; i++)
		if (is_small_mesh(f, near->others[i].prim))
			near->lean[i] = spine_lean_at_most(&f->spines[near->others[i].prim.shape], &f->spines[shape]);
}

/* Whether the triangle meets the searched box. Used where there are too many items to compare it with. */
static bool is_in_box(const struct search *f, struct prim_ref p)
{
	const struct member m = member_of(f, p);
	for (int k = 0; k < 3; k++)
		if (m.high[k] < f->low[k] || m.low[k] > f->high[k])
			return false;
	return true;
}

/* Appends those triangles of a small mesh, one of the items, that are near another item. Returns their number. */
static size_t divide_small(struct search *f, const struct prim_ref *items, size_t n, uint32_t shape,
			   struct prim_ref *out)
{
	struct near near = {.count = OTHERS + 1};
	const struct member mesh = member_of(f, (struct prim_ref){shape, WHOLE, 0});
	size_t count = 0;
	if (n <= MANY)
		near.count = find_near(f, items, n, &mesh, near.others);
	if (near.count == 0)
		return 0;
	find_leans(f, shape, &near);
	f->work += f->shapes[shape].triangle_count;
	for (uint32_t k = 0; k < f->shapes[shape].triangle_count; k++) {
		const struct prim_ref p = {shape, k, 0};
		if (near.count > OTHERS ? is_in_box(f, p) : is_near_any(f, p, &near))
			out[count++] = p;
	}
	liveness_tick();
	return count;
}

static size_t divide_all(struct search *f, const struct prim_ref *items, size_t n, const struct cut *c,
			 struct prim_ref *out)
{
	size_t count = 0;
	for (size_t i = 0; i < n; i++) {
		if (!is_divided(f, items[i], c)) {
			out[count++] = items[i];
			continue;
		}
		if (is_small_mesh(f, items[i])) {
			count += divide_small(f, items, n, items[i].shape, out + count);
			continue;
		}
		const struct member box = box_of_others(f, items, n, i);
		count += divide(f, items[i].shape, &box, out + count);
	}
	return count;
}

/* Whether an item meets the half that is the box currently searched. */
static bool is_in_half(const struct search *f, struct prim_ref p, bool upper, const struct cut *c)
{
	double low, high;
	struct spine_part unused;
	if (is_small_mesh(f, p))
		return spine_clip(&f->spines[p.shape], f->low, f->high, &unused);
	extent(f, p, c->axis, &low, &high);
	return upper ? high >= c->at : low <= c->at;
}

static int look_into_halves(struct search *f, const struct prim_ref *items, size_t n, unsigned cuts,
			    const struct cut *c)
{
	struct prim_ref *half = mem_alloc(n, sizeof *half);
	int rc = half ? 0 : -ENOMEM;
	for (int upper = 0; upper < 2 && !rc; upper++) {
		double *side = upper ? &f->low[c->axis] : &f->high[c->axis], whole = *side;
		size_t count = 0;
		*side = c->at;
		for (size_t i = 0; i < n; i++) {
			if (is_in_half(f, items[i], upper, c))
				half[count++] = items[i];
			if (i % 4096 == 0)
				liveness_tick();
		}
		rc = look_into(f, half, count, cuts - 1);
		*side = whole;
	}
	mem_free(half);
	return rc;
}

/* Searches the items, which are sorted by rank and are overwritten. cuts: how many more cuts are allowed. */
static int look_into(struct search *f, struct prim_ref *items, size_t n, unsigned cuts)
{
	struct cut c = {.is = false};
	f->work += n;
	f->incomplete |= f->work > f->limit;
	if (f->incomplete || nothing_to_find(f, items, n))
		return 0;
	if (n > MANY && f->shapes[commonest(items, n)].rank != SURFACE_SHINES)
		n = leave_out(f, items, n);
	c.is = n > FEW && cuts > 0 && choose_cut(f, items, n, &c.axis, &c.at);
	size_t room = room_divided(f, items, n, &c);
	if (room == 0)
		return c.is ? look_into_halves(f, items, n, cuts, &c) : compare_part(f, items, n);
	f->incomplete |= f->work + room > f->limit;
	if (f->incomplete)
		return 0;
	struct prim_ref *all = mem_alloc(room, sizeof *all);
	if (!all)
		return -ENOMEM;
	size_t count = divide_all(f, items, n, &c, all);
	int rc = c.is ? look_into_halves(f, all, count, cuts, &c) : look_into(f, all, count, cuts);
	mem_free(all);
	return rc;
}

/* Lists all primitives by rank, instances and small meshes as single items. Returns their number; items may be NULL. */
static size_t list_primitives(const struct accel_shape *shapes, uint32_t count, struct prim_ref *items)
{
	size_t n = 0;
	for (unsigned rank = 0; rank < SURFACE_RANKS; rank++)
		for (uint32_t i = 0; i < count; i++) {
			bool whole = shapes[i].is_sphere || shapes[i].place || is_small(&shapes[i]);
			uint32_t prims = whole ? !accel_moves(&shapes[i]) : shapes[i].triangle_count;
			for (uint32_t k = 0; shapes[i].rank == rank && k < prims; k++, n++)
				if (items)
					items[n] = (struct prim_ref){
						i, shapes[i].place || is_small(&shapes[i]) ? WHOLE : k, 0};
		}
	return n;
}

/* Finds the flat parts of shared meshes. *moved: the number of their triangles over all instances that do not move. */
static int find_flat_parts(struct search *f, uint32_t count, size_t *moved)
{
	*moved = 0;
	for (uint32_t i = 0; i < count; i++) {
		const struct placement *p = f->shapes[i].place;
		if (!p || f->shapes[i].is_sphere)
			continue;
		if (!f->flat && !(f->flat = mem_alloc(count, sizeof *f->flat)))
			return -ENOMEM;
		int rc = p->first == i ? flat_parts_find(&f->flat[i], &f->shapes[i]) : 0;
		if (rc)
			return rc;
		*moved += p->moves ? 0 : f->flat[p->first].count;
	}
	return 0;
}

/* Computes the spines of small meshes. *triangles: the total number of triangles in them. */
static int find_spines(struct search *f, uint32_t count, size_t *triangles)
{
	*triangles = 0;
	for (uint32_t i = 0; i < count; i++) {
		if (!is_small(&f->shapes[i]))
			continue;
		if (!f->spines && !(f->spines = mem_alloc(count, sizeof *f->spines)))
			return -ENOMEM;
		f->spines[i] = spine_of(&f->shapes[i]);
		*triangles += f->shapes[i].triangle_count;
		liveness_tick();
	}
	return 0;
}

static int find(struct search *f, uint32_t count, size_t n)
{
	size_t moved, small;
	int rc = find_flat_parts(f, count, &moved);
	rc = rc ? rc : find_spines(f, count, &small);
	struct prim_ref *items = rc ? NULL : mem_alloc(n, sizeof *items);
	if (!items)
		return -ENOMEM;
	/* The limits suffice for complete sorting and for each primitive to meet dozens of others, but not for all
	 * triangles of a huge number of instances. */
	size_t all = n + small, most = moved < INSTANCED_MAX ? moved : INSTANCED_MAX;
	f->limit = 128 * (uint64_t)all + (1u << 25) + 16 * (uint64_t)most;
	f->pair_limit = 4 * all + (1u << 16) + most;
	list_primitives(f->shapes, count, items);
	rc = look_into(f, items, n, MOST_CUTS);
	mem_free(items);
	return rc;
}

int coincide_find(struct coincidence **out, const struct accel_shape *shapes, uint32_t count, struct error *e)
{
	*out = NULL;
	struct search f = {
		.shapes = shapes, .low = {-INFINITY, -INFINITY, -INFINITY}, .high = {INFINITY, INFINITY, INFINITY}};
	int rc = find(&f, count, list_primitives(shapes, count, NULL));
	for (uint32_t i = 0; f.flat && i < count; i++)
		mem_free(f.flat[i].prim);
	mem_free(f.flat);
	mem_free(f.spines);
	if (!rc && (f.pair_count > 0 || f.incomplete))
		rc = coincide_result(f.pairs, f.pair_count, f.incomplete, count, out);
	else
		mem_free(f.pairs);
	return rc ? error_set(e, ENOMEM, "out of memory") : 0;
}
