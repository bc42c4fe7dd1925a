/* SPDX-License-Identifier: Apache-2.0 */
/*
 * T(x -> y) against sampling. From one x, from which all proposals arrive, a pilot run determines the mean and the
 * covariance of all moving vertices, which whiten their positions. Inside an ellipsoid of known volume, E[1{y in bin}
 * / T(x -> y)] is the volume of the bin, whatever the shape of T: for the eight bins given by the signs of three
 * coordinates, and for the whole ellipsoid. T is multiplied out with all constants
 * (tests/worker/render/mutation/explicit.h): film, steps, choice of b and c, aperture and emitter. Failed proposals
 * are counted and must be rare.
 *
 * Level: 1e-6 for all bins of all cases together. Power: the error found with 95 % probability is printed, 2 to 4 %
 * on the whole ellipsoid.
 */
#include "tests/support/dice.h"
#include "tests/support/rooms.h"
#include "tests/support/starts.h"
#include "tests/support/stats.h"
#include "tests/worker/render/mutation/explicit.h"
#include "worker/render/world/build.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

enum { VERTICES_MAX = 6, BITS = 3, BINS = 1 << BITS, PILOT = 4000, LOOK_SAMPLES = 256, STARTS = 2400 };
#define COMPARISONS 256
#define LEVEL (1e-6 / COMPARISONS)
/* Largest step, to both sides, of the numbers in [0,1) that give the points on the emitter and on the aperture. */
#define END_STEP 0.1

struct example {
	const char *room, *strategy;
	struct mutation_forced_choice forced;
	unsigned edges, b, c; /* the case that is tested, if b and c are drawn */
};

static const struct example examples[] = {
	{"rough glass", "halfvec", {-1, -1}, 2, 2, 0},
	{"gold", "halfvec", {-1, -1}, 3, 3, 0},
	{"rough glass", "halfvec", {-1, -1}, 4, 4, 0},
	{"bent normals", "halfvec", {-1, -1}, 3, 3, 0},
	{"bent normals", "hslt", {3, 1}, 3, 3, 1},
	{"gold", "hslt", {4, 2}, 4, 4, 2},
	{"gold", "hslt", {1, 0}, 2, 1, 0},
	{"gold", "hslt", {1, 0}, 3, 1, 0},
	{"rough glass", "hslt", {2, 1}, 4, 2, 1},
	{"picture", "hslt", {2, 0}, 3, 2, 0},
	{"gold", "hslt", {3, 1}, 4, 3, 1},
	{"gold", "multichain", {-1, -1}, 2, 0, 0},
	{"bent normals", "multichain", {-1, -1}, 3, 0, 0},
	{"gold", "hslt", {-1, -1}, 3, 2, 1},
	{"gold", "hslt", {-1, -1}, 3, 2, 0},
	{"gold", "light", {-1, -1}, 2, 1, 0},
	{"rough glass", "rejoin", {-1, -1}, 2, 1, 0},
	{"gold", "rejoin", {-1, -1}, 3, 2, 1},
	{"lens", "halfvec", {-1, -1}, 2, 2, 0},
	{"lens", "hslt", {1, 0}, 2, 1, 0},
	{"lens", "multichain", {-1, -1}, 2, 0, 0},
};

static struct mutation_ctx m;
static struct path_context c;
static uint64_t counters[BATCH_COUNTERS], strategy_counters[STRATEGY_COUNTERS];

struct sampling {
	const struct example *example;
	const struct mutation_ops *ops;
	struct full_path *x, *y;
	unsigned vertex[FULL_PATH_VERTICES_MAX], count, ends;	       /* moving vertices; ends: of these, path ends */
	double mean[VERTICES_MAX], factor[VERTICES_MAX][VERTICES_MAX]; /* factor: Cholesky's, of the covariance */
	unsigned long failures;
};

enum outcome { OTHER, FAILED, ELSEWHERE, ARRIVED }; /* OTHER: another b or c was drawn */

static void list_vertices(struct sampling *s)
{
	const struct example *e = s->example;
	s->count = 0;
	unsigned first = e->b < e->edges ? e->edges - 1 : e->b - 1;
	for (unsigned j = first; j > e->c || (j == e->b && e->b == 0); j--) {
		s->vertex[s->count++] = j;
		if (j == 0)
			break;
	}
	s->ends = 0;
	if (explicit_moves_emitter(e->strategy, e->b, e->c))
		s->vertex[s->count + s->ends++] = 0;
	if (camera_has_aperture(&c.w->camera) && e->b < e->edges)
		s->vertex[s->count + s->ends++] = e->edges;
	s->count += s->ends;
}

/* Position in the plane in which the point on the aperture moves. */
static void aperture_coordinates(const struct sampling *s, double *z, double *log_plane)
{
	const struct camera *camera = &c.w->camera;
	vec3 d = frame_to_local(&camera->axes, vec3_sub(s->y->v[s->y->edges].x.p, s->x->v[s->x->edges].x.p));
	z[0] = d.x;
	z[1] = d.y;
	/* The density counts the aperture's area as 1. */
	*log_plane += log(M_PI * camera->aperture_radius * camera->aperture_radius);
}

/* Stores positions in the tangent planes of x, and the logarithm of the area in these planes per area of the
 * surfaces. Returns false if a vertex left its plane or sphere. */
static bool tangent_coordinates(const struct sampling *s, double *z, double *log_plane)
{
	*log_plane = 0;
	for (unsigned i = 0; i < s->count; i++) {
		if (s->vertex[i] == s->x->edges) {
			aperture_coordinates(s, &z[2 * i], log_plane);
			continue;
		}
		const struct surface_point *x = &s->x->v[s->vertex[i]].x, *y = &s->y->v[s->vertex[i]].x;
		struct frame f = frame_around(x->ng);
		vec3 d = frame_to_local(&f, vec3_sub(y->p, x->p));
		double cosine = vec3_dot(x->ng, y->ng);
		bool sphere = c.w->shapes[x->prim.shape].is_sphere;
		if (x->prim.shape != y->prim.shape || cosine < 0.3 ||
		    (!sphere && (cosine < 1 - 1e-9 || fabs(d.z) > 1e-9)))
			return false;
		z[2 * i] = d.x;
		z[2 * i + 1] = d.y;
		*log_plane += log(cosine);
	}
	return true;
}

static enum outcome propose(struct sampling *s, double *z, double *log_density)
{
	const struct example *e = s->example;
	struct proposal_move move = {.b = FULL_PATH_VERTICES_MAX};
	double log_plane, unused;
	m.step++;
	m.counters = strategy_counters;
	enum proposal_result end = s->ops->propose(s->ops, &m, &e->forced, s->x, s->y, &move);
	enum outcome out = move.b != e->b || move.c != e->c ? OTHER : end ? FAILED : ELSEWHERE;
	if (out == ELSEWHERE && tangent_coordinates(s, z, &log_plane)) {
		out = ARRIVED;
		bool steps = strcmp(e->strategy, "hslt") == 0 || strcmp(e->strategy, "halfvec") == 0;
		*log_density = explicit_log_selection(&c, e->strategy, &e->forced, s->x, e->b, e->c) +
			       explicit_log_traced_part(&c, s->x, s->y, e->b, &unused) +
			       explicit_log_walked_part(&c, s->x, s->y, e->b, e->c, steps ? m.scratch.dh : NULL, 1) -
			       log_plane;
		if (explicit_moves_emitter(e->strategy, e->b, e->c)) {
			const struct path_vertex *v = &s->y->v[0];
			const struct emitter *em = &c.w->emitters[v->emitter];
			struct emitter_point p = world_emitter_point(&v->x);
			*log_density += log(em->ops->pdf_point(em, &p));
		}
		*log_density -= 2 * s->ends * log(2 * END_STEP);
	}
	full_path_copy(s->y, s->x, move.b > s->x->edges ? 0 : move.first,
		       move.b > s->x->edges ? s->x->edges : move.last);
	return out;
}

static int bin_of(const struct sampling *s, const double *z, double radius);

/* Returns the radius of the ellipsoid in standard deviations. Ends of the path move uniformly, within 1.7 deviations.
 */
static double ellipsoid_radius(const struct sampling *s)
{
	static const double radii[] = {0, 1.2, 1.6, 2};
	return s->ends ? 1.5 : radii[s->count];
}

/* Returns whether the proposals from this start fill the ellipsoid, and each part of it, like a normal distribution:
 * not if they lie on a curve, as at the limb of a sphere. Judged by positions alone, not by densities. */
static bool fills_ellipsoid(const struct sampling *s, const double z[][VERTICES_MAX], unsigned n)
{
	unsigned d = 2 * s->count, bins = d < BITS ? 1u << d : BINS, in[BINS] = {0}, all = 0;
	double radius = ellipsoid_radius(s), tail = 0, term = 1;
	for (unsigned k = 0; k < s->count; k++) { /* chi-square with an even number of degrees of freedom */
		tail += term;
		term *= 0.5 * radius * radius / (k + 1);
	}
	double expected = (1 - exp(-0.5 * radius * radius) * tail) * n;
	for (unsigned i = 0; i < n; i++) {
		int bin = bin_of(s, z[i], radius);
		if (bin >= 0) {
			in[bin]++;
			all++;
		}
	}
	bool ok = s->ends || (all > 0.85 * expected && all < 1.15 * expected);
	for (unsigned b = 0; b < bins && ok; b++)
		ok = in[b] * bins > 0.7 * all;
	return ok;
}

/* Finds the mean and the covariance. Returns false if proposals fail or leave their surface, or if they do not fill
 * the ellipsoid. */
static bool run_pilot(struct sampling *s)
{
	static double z[PILOT][VERTICES_MAX];
	unsigned n = 0, d = 2 * s->count, failed = 0;
	double density;
	for (unsigned i = 0; i < PILOT || n < PILOT / 4; i++) {
		enum outcome out = propose(s, z[n], &density);
		failed += out != ARRIVED && out != OTHER;
		if (failed * 1000 > PILOT || i > 40 * PILOT || (i > LOOK_SAMPLES && n == 0))
			return false;
		n += out == ARRIVED;
		if (n == PILOT)
			break;
	}
	double covariance[VERTICES_MAX][VERTICES_MAX] = {{0}};
	memset(s->mean, 0, sizeof s->mean);
	for (unsigned i = 0; i < n; i++)
		for (unsigned a = 0; a < d; a++)
			s->mean[a] += z[i][a] / n;
	for (unsigned i = 0; i < n; i++)
		for (unsigned a = 0; a < d; a++)
			for (unsigned b = 0; b < d; b++)
				covariance[a][b] += (z[i][a] - s->mean[a]) * (z[i][b] - s->mean[b]) / n;
	for (unsigned a = 0; a < d; a++)
		for (unsigned b = 0; b <= a; b++) {
			double sum = covariance[a][b];
			for (unsigned i = 0; i < b; i++)
				sum -= s->factor[a][i] * s->factor[b][i];
			if (a == b && !(sum > 0))
				return false;
			s->factor[a][b] = a == b ? sqrt(sum) : sum / s->factor[b][b];
		}
	return fills_ellipsoid(s, (const double(*)[VERTICES_MAX])z, n);
}

static bool all_smooth(const struct full_path *x)
{
	for (unsigned j = 1; j < x->edges; j++)
		if (x->v[j].is_delta)
			return false;
	return true;
}

/* Returns the bin of the whitened coordinates, or -1 outside the ellipsoid. */
static int bin_of(const struct sampling *s, const double *z, double radius)
{
	unsigned d = 2 * s->count;
	double u[VERTICES_MAX], r2 = 0;
	int bin = 0;
	for (unsigned a = 0; a < d; a++) {
		u[a] = z[a] - s->mean[a];
		for (unsigned b = 0; b < a; b++)
			u[a] -= s->factor[a][b] * u[b];
		u[a] /= s->factor[a][a];
		r2 += u[a] * u[a];
		if (a < BITS && u[a] > 0)
			bin |= 1 << a;
	}
	return r2 < radius * radius ? bin : -1;
}

static void compare_samples(struct sampling *s, const char *name)
{
	unsigned d = 2 * s->count;
	size_t n = dice_scaled_count(120000), failures = 0, bins = d < BITS ? 1u << d : BINS;
	double radius = ellipsoid_radius(s), volume = pow(M_PI, s->count) / tgamma(s->count + 1) * pow(radius, d);
	for (unsigned a = 0; a < d; a++)
		volume *= s->factor[a][a];
	double sum[BINS + 1] = {0}, square[BINS + 1] = {0}, worst = 0, error = 0, whole = 0, full_path_error = 0;
	for (size_t i = 0; i < n; i++) {
		double z[VERTICES_MAX], density;
		enum outcome out = propose(s, z, &density);
		failures += out == FAILED || out == ELSEWHERE;
		int bin = out == ARRIVED ? bin_of(s, z, radius) : -1;
		if (bin < 0)
			continue;
		double w = exp(-density) / volume;
		sum[bin] += w * (double)bins;
		square[bin] += w * w * (double)bins * (double)bins;
		sum[BINS] += w;
		square[BINS] += w * w;
	}
	bool right = true;
	for (size_t b = 0; b <= BINS; b++) {
		if (b >= bins && b < BINS)
			continue;
		double mean = sum[b] / (double)n, sigma = sqrt((square[b] / (double)n - mean * mean) / (double)n),
		       t = (mean - 1) / sigma;
		right = right && stats_student_t_p(t, (double)n - 1) >= LEVEL;
		worst = fabs(t) > fabs(worst) ? t : worst;
		error = b < BINS ? fmax(error, sigma) : error;
		whole = mean;
		full_path_error = sigma;
	}
	/* 6.8 standard errors for the level, plus 1.645 for a power of 95 %. */
	printf("%-42s %u vertices, whole %.4f, worst t %+.2f, finds %.1f %% on it and %.1f %% on a bin, failed %.2g\n",
	       name, s->count, whole, worst, 845 * full_path_error, 845 * error, (double)failures / (double)n);
	assert_true(right);
	assert_true((double)failures < 0.002 * (double)n + 3);
}

static void proposals_follow_the_stated_density(void **state)
{
	const struct example *e = *state;
	static struct full_path x, y;
	static struct sampling s;
	char name[64];
	snprintf(name, sizeof name, "%s, %s, k = %u, b = %u, c = %u", e->room, e->strategy, e->edges, e->b, e->c);
	struct world *w = room_build_named(e->room);
	struct starts starts;
	starts_init_context(&c, w, 1, e->edges, counters);
	m = (struct mutation_ctx){
		.path = &c, .seed = stats_seed(name), .limits = walk_limits_of(&accuracy_settings_default)};
	starts_init(&starts, &c, m.seed, 0, 12000);
	s = (struct sampling){.example = e, .ops = mutation_find(e->strategy, strlen(e->strategy)), .x = &x, .y = &y};
	list_vertices(&s);
	assert_true(s.count >= 1 && 2 * s.count <= VERTICES_MAX);
	bool found = false;
	for (unsigned i = 0; i < STARTS && !found; i++) {
		if (!starts_make_path(&starts, e->edges, ((i * 377) % STARTS + 0.5) / STARTS, &x) || !all_smooth(&x))
			continue;
		full_path_copy(&y, &x, 0, e->edges);
		found = run_pilot(&s);
	}
	if (!found)
		fail_msg("%s: no start from which all proposals arrive", name);
	compare_samples(&s, name);
	starts_fini(&starts);
	world_free(w);
}

int main(void)
{
	enum { EXAMPLES = sizeof examples / sizeof *examples };
	struct CMUnitTest tests[EXAMPLES];
	for (size_t i = 0; i < EXAMPLES; i++)
		tests[i] = (struct CMUnitTest){examples[i].strategy, proposals_follow_the_stated_density, NULL, NULL,
					       (void *)(uintptr_t)&examples[i]};
	return _cmocka_run_group_tests("sampled", tests, EXAMPLES, NULL, NULL);
}
