/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Walks to random half vectors in worlds that are hard in different ways. If a walk reports its arrival, independent
 * checks follow: half vectors are computed here in long double from the shapes' own vertices, positions must lie on
 * the primitives that they name, no edge may be occluded, and both ends must be unchanged bit by bit. From the new
 * path, a second walk to the old half vectors must find the old vertices; a walk to the path's own half vectors must
 * stay; and a walk with half the tolerance must reach the same position. Deterministic: seeds are the names of the
 * cases. HSLT_TEST_ROWS=1 prints the rates.
 */
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/halfvec/walk.h"
#include "worker/render/math/fptrap.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { DEPTH = 7 };

typedef struct {
	long double x, y, z;
} wide;

static wide vec3_to_wide(vec3 v)
{
	return (wide){(long double)v.x, (long double)v.y, (long double)v.z};
}

static wide wide_add(wide a, long double s, wide b)
{
	return (wide){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}

static long double wide_dot(wide a, wide b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

static wide wide_unit(wide a)
{
	return wide_add((wide){0, 0, 0}, 1 / sqrtl(wide_dot(a, a)), a);
}

static wide wide_cross(wide a, wide b)
{
	return (wide){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/* Returns a point of the shape in world space; only instances have a transform. */
static wide wide_in_world(const struct geom_shape *g, wide p)
{
	const struct placement *m = g->placement;
	return m ? wide_add(wide_add(wide_add(vec3_to_wide(m->origin), p.x, vec3_to_wide(m->x)), p.y,
				     vec3_to_wide(m->y)),
			    p.z, vec3_to_wide(m->z))
		 : p;
}

/* Transforms a normal by cofactors, without inverting the matrix. */
static wide wide_normal_in_world(const struct geom_shape *g, wide n)
{
	const struct placement *m = g->placement;
	if (!m)
		return n;
	wide x = vec3_to_wide(m->x), y = vec3_to_wide(m->y), z = vec3_to_wide(m->z), a = wide_cross(y, z),
	     zero = {0, 0, 0};
	wide r = wide_add(wide_add(wide_add(zero, n.x, a), n.y, wide_cross(z, x)), n.z, wide_cross(x, y));
	return wide_unit(wide_dot(a, x) < 0 ? wide_add(zero, -1, r) : r);
}

/* Computes the position, shading normal and first tangent of a vertex from its shape, with the vertex's own
 * coordinates on the primitive. */
static void evaluate_shape(const struct world *w, const struct path_vertex *v, wide *p, wide *n, wide *s)
{
	const struct geom_shape *g = &w->shapes[v->x.prim.shape];
	if (g->is_sphere) {
		wide out = wide_unit(wide_add(vec3_to_wide(v->x.p), -1, vec3_to_wide(g->center)));
		*p = wide_add(vec3_to_wide(g->center), (long double)g->radius, out);
		*n = wide_add((wide){0, 0, 0}, (long double)g->normal_sign, out);
	} else {
		const uint32_t *i = g->index[v->x.prim.prim];
		long double b[3] = {1 - (long double)v->x.b1 - (long double)v->x.b2, (long double)v->x.b1,
				    (long double)v->x.b2};
		assert_true(v->x.b1 >= 0 && v->x.b2 >= 0 && v->x.b1 + v->x.b2 <= 1 + 1e-15);
		wide q[3], m = {0, 0, 0};
		*p = m;
		for (int k = 0; k < 3; k++) {
			const float *at = g->position[i[k]];
			q[k] = wide_in_world(g, (wide){(long double)at[0], (long double)at[1], (long double)at[2]});
			*p = wide_add(*p, b[k], q[k]);
		}
		wide flat = wide_unit(wide_cross(wide_add(q[1], -1, q[0]), wide_add(q[2], -1, q[0])));
		for (int k = 0; k < 3 && g->normal; k++) {
			const float *at = g->normal[i[k]];
			m = wide_add(m, b[k],
				     wide_normal_in_world(
					     g, (wide){(long double)at[0], (long double)at[1], (long double)at[2]}));
		}
		*n = wide_dot(m, flat) > 0 ? wide_unit(m) : flat;
	}
	wide d = vec3_to_wide(v->x.axis);
	d = wide_add(d, -wide_dot(d, *n), *n);
	*s = wide_dot(d, d) > 0 ? wide_unit(d) : vec3_to_wide(v->x.sh.s);
}

static wide wide_direction(const struct path_vertex *a, const struct path_vertex *b)
{
	if (b->kind == VERTEX_INFINITE)
		return vec3_to_wide(b->x.p);
	return wide_unit(wide_add(vec3_to_wide(b->x.p), -1, vec3_to_wide(a->x.p)));
}

/* Computes the half vector at vertex j; fails unless the vertex lies on its shape and scatters in its mode. */
static void measure_half_vector(const struct world *w, const struct full_path *y, unsigned j, long double h[2])
{
	const struct path_vertex *v = &y->v[j];
	wide p, n, s, i = wide_direction(v, &y->v[j - 1]), o = wide_direction(v, &y->v[j + 1]);
	evaluate_shape(w, v, &p, &n, &s);
	wide deviation = wide_add(p, -1, vec3_to_wide(v->x.p));
	assert_true(sqrtl(wide_dot(deviation, deviation)) < 1e-14L);
	long double ni = wide_dot(i, n), no = wide_dot(o, n), eta = 1;
	assert_true((ni * no > 0) == !(v->mode & BSDF_TRANSMIT));
	assert_true(ni * wide_dot(i, vec3_to_wide(v->x.ng)) > 0 && no * wide_dot(o, vec3_to_wide(v->x.ng)) > 0);
	bool matched = false;
	if (v->mode & BSDF_TRANSMIT) {
		eta = (long double)bsdf_eta(v->bsdf, &y->wl);
		eta = no > 0 ? 1 / eta : eta;
		matched = eta == 1;
	}
	wide sum = wide_add(i, eta, o);
	long double below = matched ? 1 : wide_dot(sum, n);
	h[0] = wide_dot(sum, s) / below;
	h[1] = wide_dot(sum, wide_cross(n, s)) / below;
}

static struct ray_end make_ray_end(const struct path_vertex *v)
{
	return (struct ray_end){v->x.p, v->kind == VERTEX_CAMERA ? (vec3){0, 0, 0} : v->x.ng, v->x.prim};
}

/* Results of a run over one world. */
struct tally {
	size_t walks, arrived, returned_strictly, returned, ends[WALK_ITERATION_LIMIT + 1],
		back_ends[WALK_ITERATION_LIMIT + 1];
	size_t stays, stays_failed, repeats,
		repeats_elsewhere; /* walks to where the path is; walks with half the tolerance */
	uint64_t iterations, rays, occluded, seams;
	double max_residual;	  /* residual in tolerances */
	double max_stay_distance; /* largest move of a walk to the path's own half vectors */
};

static struct path_context context_of(const struct world *w, uint64_t *counters)
{
	return (struct path_context){.w = w,
				     .window = {-1, -1, w->settings.width + 2.0, w->settings.height + 2.0},
				     .min_depth = 1,
				     .max_depth = DEPTH,
				     .counters = counters};
}

/* Draws a camera sub-path as a full path. Returns false if it is too short to have inner vertices. */
static bool draw_path(struct path_context *c, uint64_t seed, uint64_t i, struct full_path *x)
{
	struct sampler_random s;
	double film[2];
	sampler_random_init(&s, seed, RNG_TEST, i, 0);
	unsigned n = path_walk_camera(c, &s.base, DEPTH + 1, film);
	if (n < 3)
		return false;
	x->edges = n - 1;
	x->wl = c->wl;
	for (unsigned k = 0; k < n; k++)
		x->v[n - 1 - k] = c->camera[k];
	if (x->v[0].kind == VERTEX_SURFACE && x->v[0].emitter >= 0)
		x->v[0].kind = VERTEX_EMITTER;
	for (unsigned e = 0; e < x->edges; e++)
		if (!full_path_compute_edge(x, e))
			return false;
	return true;
}

static double gauss(struct dice *d)
{
	return sqrt(-2 * log(1 - dice_uniform(d))) * cos(2 * M_PI * dice_uniform(d));
}

/* Moves x_b to the hit of a slightly turned ray from the vertex before it, if that hit has the same material. */
static void move_end(struct path_context *c, struct dice *d, struct full_path *y, unsigned b)
{
	if (b == y->edges)
		return;
	struct path_vertex *end_vertex = &y->v[b];
	const struct path_vertex *from = &y->v[b + 1];
	vec3 w = vec3_normalize(vec3_sub(end_vertex->x.p, from->x.p));
	w = vec3_normalize(vec3_madd(w, 0.005 * gauss(d), dice_direction(d)));
	struct ray_end start = make_ray_end(from);
	struct ray_hit hit;
	if (!accel_closest(c->w->accel, &start, w, 0, INFINITY, &hit))
		return;
	if (&c->w->bsdfs[c->w->shape_bindings[hit.prim.shape].bsdf] != end_vertex->bsdf)
		return;
	surface_from_hit(&c->w->shapes[hit.prim.shape], from->x.p, w, &hit, &end_vertex->x);
}

/* Returns a step like those of mutations: the width of the lobe, or the step that moves the vertex by about one
 * hundredth of its distance. */
static double halfvec_step_size(const struct full_path *x, const struct constraint *k, unsigned j)
{
	if (x->v[j].is_delta)
		return 0;
	double alpha = fmin(x->v[j].bsdf->min_alpha, 1), reach = 0.01 * sqrt(x->edge[j].distance2);
	return fmin(alpha / sqrt(M_PI), reach * sqrt(mat2_norm2(k[j].b)));
}

static void check_residuals(const struct world *w, const struct full_path *y, unsigned b, unsigned end,
			    const struct walk_target *target, double scale, struct tally *t)
{
	for (unsigned j = end + 1; j < b; j++) {
		long double h[2];
		measure_half_vector(w, y, j, h);
		double deviation = (double)hypotl(h[0] - (long double)target[j].h.x, h[1] - (long double)target[j].h.y);
		/* Next to an index of 1 the directions nearly cancel; a walk cannot see the digits that double loses.
		 */
		vec3 half = vec3_sub(vec3_scale(full_path_eta(y, j), y->edge[j].w), y->edge[j - 1].w);
		double rounding = 0x1p-52 / fabs(vec3_dot(half, y->v[j].x.sh.n));
		t->max_residual = fmax(t->max_residual, (deviation - rounding) / (scale * target[j].tolerance));
	}
}

static void check_arrival(struct path_context *c, const struct full_path *x, struct full_path *y, unsigned b,
			  unsigned end, const struct walk_target *target, double scale, struct tally *t)
{
	check_residuals(c->w, y, b, end, target, scale, t);
	for (unsigned j = end + 1; j < b; j++) {
		assert_ptr_equal(y->v[j].bsdf, x->v[j].bsdf);
		assert_int_equal(y->v[j].emitter, c->w->shape_bindings[y->v[j].x.prim.shape].emitter);
		t->seams += y->v[j].x.prim.prim != x->v[j].x.prim.prim || y->v[j].x.prim.shape != x->v[j].x.prim.shape;
	}
	for (unsigned e = end; e < b; e++) {
		double distance2;
		vec3 w = path_direction(&y->v[e], &y->v[e + 1], &distance2);
		assert_memory_equal(&w, &y->edge[e].w, sizeof w);
		assert_memory_equal(&w, &y->v[e].to_prev, sizeof w);
		assert_true(distance2 == y->edge[e].distance2);
		t->occluded += !full_path_edge_is_visible(c, y, e);
	}
}

static struct walk_scratch scratch;
static struct accuracy_settings accuracy;

/* Walks back from y to x: to x_b and the half vectors of x. */
static void walk_back(struct path_context *c, const struct full_path *x, struct full_path *y, unsigned b, unsigned end,
		      struct walk_target *target, const struct constraint *k, struct tally *t)
{
	static struct full_path z;
	z = *y;
	z.v[b] = x->v[b];
	for (unsigned j = end + 1; j < b; j++)
		target[j].h = x->v[j].is_delta ? (vec2){0, 0} : k[j].h;
	struct walk_limits limits = walk_limits_of(&accuracy);
	enum walk_result reverse_result = halfvec_walk(c, &z, b, end, target, true, &limits, WALK_STALE_ALL, &scratch);
	t->back_ends[reverse_result]++;
	if (reverse_result != WALK_OK)
		return;
	double moved = 0, off = 0;
	bool each = true;
	for (unsigned j = end + 1; j < b; j++) {
		double m = vec3_length(vec3_sub(y->v[j].x.p, x->v[j].x.p)),
		       o = vec3_length(vec3_sub(z.v[j].x.p, x->v[j].x.p));
		moved = fmax(moved, m);
		off = fmax(off, o);
		each = each && o <= 1e-3 * m;
	}
	t->returned += off <= 1e-3 * moved;
	t->returned_strictly += each;
}

/* Returns the largest distance between corresponding inner vertices. */
static double largest_distance(const struct full_path *x, const struct full_path *y, unsigned b, unsigned end)
{
	double max_distance = 0;
	for (unsigned j = end + 1; j < b; j++)
		max_distance = fmax(max_distance, vec3_length(vec3_sub(x->v[j].x.p, y->v[j].x.p)));
	return max_distance;
}

/* Walks to the path's own half vectors: one iteration, which moves the path by rounding alone. */
static void walk_in_place(struct path_context *c, const struct full_path *x, unsigned b, unsigned end,
			  struct walk_target *target, const struct constraint *k, struct tally *t)
{
	static struct full_path y;
	y = *x;
	for (unsigned j = end + 1; j < b; j++)
		target[j].h = k[j].h;
	struct walk_limits limits = walk_limits_of(&accuracy);
	t->stays++;
	if (halfvec_walk(c, &y, b, end, target, false, &limits, WALK_STALE_ALL, &scratch) != WALK_OK ||
	    scratch.iterations != 1)
		t->stays_failed++;
	else
		t->max_stay_distance = fmax(t->max_stay_distance, largest_distance(x, &y, b, end));
}

/* Walks from the same start with half the tolerance: to the same position y within what the whole tolerance
 * determines. */
static void walk_with_half_tolerance(struct path_context *c, const struct full_path *start, const struct full_path *y,
				     unsigned b, unsigned end, const struct walk_target *target, struct tally *t)
{
	static struct full_path z;
	z = *start;
	struct walk_limits limits = walk_limits_of(&accuracy);
	limits.tolerance_scale = 0.5;
	t->repeats++;
	if (halfvec_walk(c, &z, b, end, target, false, &limits, WALK_STALE_ALL, &scratch) != WALK_OK ||
	    largest_distance(&z, y, b, end) > 0.01 * largest_distance(start, y, b, end))
		t->repeats_elsewhere++;
	else
		check_residuals(c->w, &z, b, end, target, limits.tolerance_scale, t);
}

static void walk_once(struct path_context *c, struct dice *d, const struct full_path *x, struct tally *t)
{
	static struct full_path y, start;
	static struct constraint k[FULL_PATH_VERTICES_MAX];
	struct walk_target target[FULL_PATH_VERTICES_MAX];
	unsigned b = 2 + dice_below(d, x->edges - 1), end = dice_below(d, b - 1);
	y = *x;
	constraints_compute(c->w, x, b, end, k);
	double all = 0;
	for (unsigned j = end + 1; j < b; j++) {
		double step = halfvec_step_size(x, k, j);
		all += step;
		target[j].h = x->v[j].is_delta ? (vec2){0, 0}
					       : (vec2){k[j].h.x + step * gauss(d), k[j].h.y + step * gauss(d)};
		target[j].tolerance = x->v[j].is_delta ? 1e-9 : 1e-3 * fmin(step, x->v[j].bsdf->min_alpha);
	}
	if (b < x->edges)
		move_end(c, d, &y, b);
	if (all == 0 && b == x->edges)
		return;
	start = y;
	struct path_vertex first = y.v[b], last = y.v[end];
	struct walk_limits limits = walk_limits_of(&accuracy);
	uint64_t rays_before = batch_ray_count(c->counters);
	enum walk_result e = halfvec_walk(c, &y, b, end, target, false, &limits, WALK_STALE_ALL, &scratch);
	t->rays += batch_ray_count(c->counters) - rays_before;
	t->walks++;
	t->ends[e]++;
	t->iterations += scratch.iterations;
	if (e != WALK_OK)
		return;
	t->arrived++;
	assert_memory_equal(&first, &y.v[b], sizeof first);
	assert_memory_equal(&last.x, &y.v[end].x, sizeof last.x);
	check_arrival(c, x, &y, b, end, target, limits.tolerance_scale, t);
	for (unsigned j = end + 1; j < b; j++) { /* the caller gets the constraints at the new path */
		vec2 h = halfvec_of(&y, j);
		assert_memory_equal(&h, &scratch.k[j].h, sizeof h);
	}
	walk_with_half_tolerance(c, &start, &y, b, end, target, t);
	walk_back(c, x, &y, b, end, target, k, t);
	walk_in_place(c, x, b, end, target, k, t);
}

/* Prints a row in the format of make test-numerics: topic, case, measured, required, verdict. */
static void print_row(const char *name, const struct tally *t, double arrive, double come_back)
{
	const char *rows = getenv("HSLT_TEST_ROWS");
	if (!rows || rows[0] != '1')
		return;
	double n = (double)t->walks, ok = (double)t->arrived;
	printf("walk\t%s\t%zu walks: %.1f %% arrive, %.1f %% of them come back (each vertex %.1f %%); %.2f iterations, "
	       "%.2f rays; worst residual %.3f tolerances; from where it is %zu of %zu leave, by %.1e at most; by half "
	       "the tolerance %zu of %zu come elsewhere; missed %zu, blocked %zu, mode %zu, singular %zu, "
	       "diverged %zu, iterations %zu; back: %zu %zu %zu %zu %zu %zu; seams %llu\t%.1f %%, %.1f %%, 1.01\tok\n",
	       name, t->walks, 100 * ok / n, 100 * (double)t->returned / ok, 100 * (double)t->returned_strictly / ok,
	       (double)t->iterations / n, (double)t->rays / n, t->max_residual, t->stays_failed, t->stays,
	       t->max_stay_distance, t->repeats_elsewhere, t->repeats, t->ends[1], t->ends[2], t->ends[3], t->ends[4],
	       t->ends[5], t->ends[6], t->back_ends[1], t->back_ends[2], t->back_ends[3], t->back_ends[4],
	       t->back_ends[5], t->back_ends[6], (unsigned long long)t->seams, 100 * arrive, 100 * come_back);
	fflush(stdout);
}

/* The rate may fall below the one measured when this test was written by at most five standard errors and 0.3 %. A
 * walk that continues from the residual of a refused trial loses 0.4 to 2 % of its arrivals, and up to 3 % of its
 * walks back. */
static void check_rate(size_t hits, size_t of, double expected)
{
	double n = (double)of;
	assert_true((double)hits > n * (expected - 0.003) - 5 * sqrt(n * expected * (1 - expected)));
}

static struct tally run_walks(const char *name, struct world *w, double arrive, double come_back)
{
	static struct path_context c;
	static struct full_path x;
	uint64_t counters[BATCH_COUNTERS] = {0};
	struct tally t = {0};
	struct dice d = dice_for_test(name);
	c = context_of(w, counters);
	bool watched = fptrap_watch();
	for (uint64_t i = 0; i < dice_scaled_count(20000); i++)
		if (draw_path(&c, d.seed, i, &x))
			walk_once(&c, &d, &x, &t);
	fptrap_unwatch(watched);
	world_free(w);
	assert_true(t.max_residual <= 1.01);
	assert_int_equal(t.occluded, 0);
	assert_true(t.stays_failed <= t.stays / 1000 && t.max_stay_distance < 1e-9);
	assert_true(t.repeats_elsewhere <= t.repeats / 200);
	check_rate(t.arrived, t.walks, arrive);
	check_rate(t.returned, t.arrived, come_back);
	print_row(name, &t, arrive, come_back);
	return t;
}

/* clang-format off */
#define ROOM                                                                                                                    \
	"<shape type='cube'><transform name='to_world'><scale value='3'/></transform><bsdf type='diffuse'>"                       \
	"<float name='reflectance' value='.7'/></bsdf></shape>"
#define LAMP                                                                                                                    \
	"<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/><translate y='2.5'/></transform>"           \
	"<bsdf type='diffuse'/><emitter type='area'><float name='radiance' value='3'/></emitter></shape>"
#define FLOOR(bsdf)                                                                                                             \
	"<shape type='rectangle'><transform name='to_world'><scale value='4'/><rotate x='1' angle='-90'/>"                        \
	"<translate y='-1.1'/></transform>" bsdf "</shape>"
/* clang-format on */
#define BALL(x, y, z, bsdf)                                                   \
	"<shape type='sphere'><point name='center' x='" x "' y='" y "' z='" z \
	"'/><float name='radius' value='.6'/>" bsdf "</shape>"
#define METAL(alpha)                                                                                          \
	"<bsdf type='roughconductor'><string name='material' value='none'/><float name='alpha' value='" alpha \
	"'/></bsdf>"
#define GLASS(alpha) "<bsdf type='roughdielectric'><float name='alpha' value='" alpha "'/></bsdf>"
#define SKY "<emitter type='constant'><float name='radiance' value='.4'/></emitter>"

static void walks_arrive_among_spheres(void **state)
{
	(void)state;
	run_walks("spheres",
		  world_from_text(32, 32,
				  SENSOR("0,0,2.9", "0,0,0") ROOM LAMP BALL("-.7", "-.5", "0", METAL(".1"))
					  BALL(".8", "-.5", "0", METAL(".02")) FLOOR(METAL(".2"))),
		  0.908, 0.999);
}

static void walks_arrive_in_rough_glass(void **state)
{
	(void)state;
	run_walks("rough glass",
		  world_from_text(32, 32,
				  SENSOR("0,0,2.9", "0,0,0") ROOM LAMP BALL("-.3", "-.2", ".3", GLASS(".1"))
					  BALL(".9", "-.5", "0", GLASS(".01")) FLOOR("<bsdf type='diffuse'/>")),
		  0.891, 0.996);
}

static void walks_arrive_in_smooth_glass(void **state)
{
	(void)state;
	run_walks("smooth glass",
		  world_from_text(
			  32, 32,
			  SENSOR("0,0,2.9", "0,0,0") ROOM LAMP BALL("-.3", "-.2", ".3", "<bsdf type='dielectric'/>")
				  BALL(".9", "-.5", "0",
				       "<bsdf type='conductor'><string name='material' value='none'/></bsdf>")
					  FLOOR(METAL(".1"))),
		  0.907, 0.998);
}

static void walks_arrive_under_a_sky(void **state)
{
	(void)state;
	run_walks("sky",
		  world_from_text(32, 32,
				  SENSOR("0,0,2.9", "0,0,0") SKY BALL("-.3", "-.2", ".3", "<bsdf type='dielectric'/>")
					  BALL(".9", "-.5", "0", METAL(".05")) FLOOR(METAL(".1"))),
		  0.909, 0.993);
}

/* At smooth glass in a medium of nearly the same index, half vectors magnify the rounding of directions a million
 * times. */
static void walks_arrive_at_nearly_matched_indices(void **state)
{
	(void)state;
	run_walks("nearly matched",
		  world_from_text(
			  32, 32,
			  SENSOR("0,0,2.9", "0,0,0") ROOM LAMP BALL(
				  "-.3", "-.2", ".3",
				  "<bsdf type='dielectric'><float name='int_ior' value='1.000001'/>"
				  "<float name='ext_ior' value='1'/></bsdf>")
				  BALL(".9", "-.5", "0",
				       "<bsdf type='dielectric'><float name='int_ior' value='1.0001'/>"
				       "<float name='ext_ior' value='1'/></bsdf>")
					  BALL("0", "-.5", "-1",
					       "<bsdf type='dielectric'><float name='int_ior' value='1.00000001'/>"
					       "<float name='ext_ior' value='1'/></bsdf>") FLOOR(METAL(".1"))),
		  0.65, 0.983);
}

/* A pole of each sphere faces the camera, which sees little else. */
static void walks_arrive_at_poles_of_spheres(void **state)
{
	(void)state;
	run_walks("poles",
		  world_from_text(32, 32,
				  "<sensor type='perspective'><float name='fov' value='3'/><transform name='to_world'>"
				  "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform><film type='hdrfilm'>"
				  "<integer name='width' value='32'/><integer name='height' value='32'/>"
				  "<rfilter type='box'/></film></sensor>" SKY BALL("0", "0", "0", GLASS(".05"))
					  BALL("0", "0", "-2", METAL(".05"))),
		  0.839, 0.989);
}

/* Bumps with interpolated normals, n x n squares over [-2,2]^2. */
static struct world *bumpy_world(int n, const char *bsdf, const char *instances)
{
	static char obj[1 << 21], scene[4096];
	size_t at = 0;
	for (int j = 0; j <= n; j++)
		for (int i = 0; i <= n; i++) {
			double x = 4.0 * i / n - 2, z = 4.0 * j / n - 2, nx = -0.2 * cos(4 * x) * cos(3 * z),
			       nz = 0.15 * sin(4 * x) * sin(3 * z);
			at += (size_t)snprintf(obj + at, sizeof obj - at, "v %.9g %.9g %.9g\nvn %.9g 1 %.9g\n", x,
					       -1 + 0.05 * sin(4 * x) * cos(3 * z), z, nx, nz);
		}
	for (int j = 0; j < n; j++)
		for (int i = 0; i < n; i++) {
			int a = j * (n + 1) + i + 1, b = a + n + 1;
			at += (size_t)snprintf(obj + at, sizeof obj - at,
					       "f %d//%d %d//%d %d//%d\nf %d//%d %d//%d %d//%d\n", a, a, b, b, a + 1,
					       a + 1, a + 1, a + 1, b, b, b + 1, b + 1);
		}
	assert_true(at + 1 < sizeof obj);
	int m = snprintf(scene, sizeof scene,
			 "<scene version='3.0.0'>" SENSOR("0,1,2.9", "0,-1,0") SKY LAMP
			 "%s<shape type='obj'><string name='filename' value='bumps.obj'/>%s</shape>%s" BALL(
				 "0", "-.2", "0", METAL(".1")) "</scene>",
			 *instances ? "<shape type='shapegroup' id='g'>" : "", bsdf, instances);
	assert_true(m > 0 && (size_t)m < sizeof scene);
	const struct memory_file files[] = {{"bumps.xml", scene, (size_t)m}, {"bumps.obj", obj, at}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

static void walks_arrive_on_bumpy_meshes(void **state)
{
	(void)state;
	run_walks("coarse bumps", bumpy_world(12, METAL(".1"), ""), 0.772, 0.951);
	struct tally t = run_walks("fine bumps", bumpy_world(60, METAL(".1"), ""), 0.771, 0.952);
	assert_true(t.seams > t.arrived / 10);
	run_walks("bumpy water", bumpy_world(40, "<bsdf type='dielectric'/>", ""), 0.975, 0.993);
	/* Two instances: the bottom, and a mirrored and squeezed one over it. */
	struct world *w =
		bumpy_world(40, "<bsdf type='dielectric'/>",
			    "</shape><shape type='instance'><ref id='g'/><transform name='to_world'>"
			    "<scale x='-1.2' y='1' z='0.9'/></transform></shape><shape type='instance'><ref id='g'/>"
			    "<transform name='to_world'><translate y='-0.5'/></transform></shape>");
	assert_int_equal(w->sharing_shape_count, 2);
	run_walks("instances of water", w, 0.99, 0.998);
}

/* Steps are shortened more often than by default, so that the search is exercised; the arrival rate is two percentage
 * points higher. */
static void use_frequent_step_shortening(void)
{
	accuracy = accuracy_settings_default;
	accuracy.least_step = 0.03;
}

/* The same walks with matrices in float: as many arrive, as close to their targets, and as many come back. */
static void walks_in_float_arrive_as_often(void **state)
{
	accuracy.precision = SETTING_SINGLE;
	walks_arrive_among_spheres(state);
	walks_arrive_in_rough_glass(state);
	walks_arrive_in_smooth_glass(state);
	walks_arrive_at_nearly_matched_indices(state);
	use_frequent_step_shortening();
}

int main(void)
{
	use_frequent_step_shortening();
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(walks_arrive_among_spheres),
		cmocka_unit_test(walks_arrive_in_rough_glass),
		cmocka_unit_test(walks_arrive_in_smooth_glass),
		cmocka_unit_test(walks_arrive_under_a_sky),
		cmocka_unit_test(walks_arrive_at_poles_of_spheres),
		cmocka_unit_test(walks_arrive_on_bumpy_meshes),
		cmocka_unit_test(walks_arrive_at_nearly_matched_indices),
		cmocka_unit_test(walks_in_float_arrive_as_often),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
