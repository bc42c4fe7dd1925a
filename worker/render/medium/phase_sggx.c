/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Microflakes that reflect like mirrors, with the SGGX distribution (Heitz, Dupuy, Crassin and Dachsbacher 2015, The
 * SGGX Microflake Distribution). With the matrix S = L L^T, the area of the flakes seen along w is sigma(w) = sqrt(w .
 * S w), the distribution of their normals D(m) = 1 / (pi det L |L^-1 m|^4), and the phase function p(wo, wi) = D(h) /
 * (4 sigma(wo)), with the half vector h of wo and wi. Symmetry: sigma(wo) p(wo, wi) = sigma(wi) p(wi, wo).
 *
 * The normals of the flakes are those of a sphere, n, transformed to L n, with areas in proportion to |L n|. The area
 * seen along w is therefore the integral of max(0, w . L n) / pi, which is |L^T w|, and flakes visible from w are
 * sampled by drawing n with density cos / pi around L^T w.
 *
 * Creation fails in a scene of 0.6, or as described in flakes.h. Where there are no flakes, densities are 0.
 */
#include "worker/render/math/frame.h"
#include "worker/render/medium/flakes.h"
#include "worker/render/medium/phase.h"

#include <math.h>

static int create(struct phase *p, const struct scene_node *n, const struct volume_build *build, struct error *e)
{
	struct flakes *f = arena_alloc(build->arena, 1, sizeof *f);
	if (!f)
		return node_error(n, e, ENOMEM, "out of memory");
	p->flakes = f;
	if (!build->is_dialect_3)
		return node_error(n, e, ENOTSUP, "a scene of 0.6 has no \"sggx\"");
	return flakes_create(f, n, build, e);
}

/* The lower triangular matrix L, from the Cholesky decomposition of S. */
struct cholesky_factor {
	double xx, yx, yy, zx, zy, zz;
};

/* Computes L at a point. Returns false if there are no flakes. */
static bool cholesky_factor_at(const struct phase *p, vec3 position, struct cholesky_factor *l)
{
	double s[FLAKES_NUMBERS];
	flakes_eval(p->flakes, position, s);
	if (!(s[0] + s[1] + s[2] > 1e-60))
		return false;
	l->xx = sqrt(s[0]);
	l->yx = s[3] / l->xx;
	l->zx = s[4] / l->xx;
	l->yy = sqrt(s[1] - l->yx * l->yx);
	l->zy = (s[5] - l->zx * l->yx) / l->yy;
	l->zz = sqrt(s[2] - l->zx * l->zx - l->zy * l->zy);
	return true;
}

static vec3 multiply_transposed(const struct cholesky_factor *l, vec3 w)
{
	return (vec3){l->xx * w.x + l->yx * w.y + l->zx * w.z, l->yy * w.y + l->zy * w.z, l->zz * w.z};
}

static double normal_density(const struct cholesky_factor *l, vec3 m)
{
	double x = m.x / l->xx, y = (m.y - l->yx * x) / l->yy, z = (m.z - l->zx * x - l->zy * y) / l->zz,
	       square = x * x + y * y + z * z;
	return 1 / (M_PI * l->xx * l->yy * l->zz * square * square);
}

static double eval(const struct phase *p, vec3 position, vec3 wo, vec3 wi)
{
	struct cholesky_factor l;
	vec3 h = vec3_add(wo, wi);
	double length = vec3_length(h);
	if (!cholesky_factor_at(p, position, &l))
		return 0;
	/* If light goes straight on, any flake parallel to the ray may have scattered it: choose one of these. */
	h = length > 0 ? vec3_scale(1 / length, h) : frame_around(wo).s;
	return normal_density(&l, h) / (4 * vec3_length(multiply_transposed(&l, wo)));
}

static vec3 sample(const struct phase *p, vec3 position, vec3 wo, const double u[2])
{
	struct cholesky_factor l;
	if (!cholesky_factor_at(p, position, &l))
		return vec3_neg(wo);
	struct frame around = frame_around(vec3_normalize(multiply_transposed(&l, wo)));
	double r = sqrt(u[0]), phi = 2 * M_PI * u[1];
	vec3 n = frame_to_world(&around, (vec3){r * cos(phi), r * sin(phi), sqrt(1 - u[0])});
	vec3 m = vec3_normalize((vec3){l.xx * n.x, l.yx * n.x + l.yy * n.y, l.zx * n.x + l.zy * n.y + l.zz * n.z});
	return vec3_normalize(vec3_madd(vec3_neg(wo), 2 * vec3_dot(wo, m), m));
}

static double area(const struct phase *p, vec3 position, vec3 w)
{
	struct cholesky_factor l;
	return cholesky_factor_at(p, position, &l) ? vec3_length(multiply_transposed(&l, w)) : 0;
}

const struct phase_ops phase_ops_sggx = {
	.decl = PLUGIN(PHASE, "sggx", {"S", UNDERSTOOD(VALUE_NODE | VALUE_IS_VOLUME)}),
	.create = create,
	.eval_flakes = eval,
	.sample_flakes = sample,
	.area = area,
};
