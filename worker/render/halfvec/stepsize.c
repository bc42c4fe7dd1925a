/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/halfvec/stepsize.h"

#include "worker/render/halfvec/constraint_system.h"
/* Standard deviation of a step on the film, as a fraction of its smaller side. */
#define FILM_STEP 0.02
/* Minimum of sigma relative to its limit: below it, a pixel sees so little of a lobe that a walk in double has no
 * room. */
#define SIGMA_RATIO_MIN 1e-6
/* Cosines and determinants below this count as zero, because dividing by them would overflow. */
#define DIVISOR_MIN 0x1p-500

double halfvec_film_sigma(const struct camera *camera)
{
	return FILM_STEP * fmin(camera->width, camera->height);
}

double halfvec_lobe_width(const struct path_vertex *v)
{
	assert(v->bsdf->min_alpha > 0);
	return fmin(v->bsdf->min_alpha, 1);
}

static double sigma_limit(const struct path_context *c, const struct path_vertex *v)
{
	return c->w->accuracy.step_scale * halfvec_lobe_width(v) / sqrt(M_PI);
}

/* Computes d x_{k-1} / d pixel, where rays through x_k meet the plane perpendicular to the geometric normal. */
static bool pixel_footprint(const struct camera *camera, const struct full_path *x, mat2 *j)
{
	const struct full_path_edge *e = &x->edge[x->edges - 1];
	const struct surface_point *point = &x->v[x->edges - 1].x;
	vec3 w = vec3_neg(e->w), du, dv, axis[2], d[2];
	double length[2], cosine = vec3_dot(point->ng, w);
	camera_pixel_footprint(camera, w, sqrt(e->distance2), axis, length);
	if (!(length[0] > 0 && length[1] > 0) || !(fabs(cosine) > DIVISOR_MIN))
		return false;
	for (int i = 0; i < 2; i++)
		d[i] = vec3_scale(length[i], vec3_madd(axis[i], -vec3_dot(point->ng, axis[i]) / cosine, w));
	surface_tangents(point, &du, &dv);
	*j = (mat2){vec3_dot(du, d[0]), vec3_dot(du, d[1]), vec3_dot(dv, d[0]), vec3_dot(dv, d[1])};
	return true;
}

/* Computes *e = d^-1 j, with both matrices scaled to entries of at most 1 first. */
static bool divide_scaled(mat2 d, mat2 j, mat2 *e)
{
	double size_d = mat2_largest(d), size_j = mat2_largest(j);
	if (!(size_d > 0) || !(size_j > 0) || !isfinite(size_d) || !isfinite(size_j))
		return false;
	d = mat2_scale(1 / size_d, d);
	j = mat2_scale(1 / size_j, j);
	double det = mat2_det(d);
	if (!(fabs(det) > DIVISOR_MIN))
		return false;
	double factor = size_j / size_d / det;
	if (!isfinite(factor))
		return false;
	*e = mat2_scale(factor, mat2_mul(mat2_adjugate(d), j));
	return true;
}

static double clamp_sigma(double sigma, double limit)
{
	return fmin(fmax(sigma, SIGMA_RATIO_MIN * limit), limit);
}

struct halfvec_step halfvec_step_from_matrix(mat2 e, double scale, double limit)
{
	struct halfvec_step s = {{1, 0, 0, 1}, {limit, limit}};
	double size = mat2_largest(e);
	if (!isfinite(size) || !(size > 0) || !isfinite(size * scale))
		return s;
	e = (mat2){e.xx / size, e.xy / size, e.yx / size, e.yy / size};
	/* e e^T = U diag(s^2) U^T; the smaller singular value follows from the determinant, which keeps its
	 * precision. */
	double s00 = e.xx * e.xx + e.xy * e.xy, s11 = e.yx * e.yx + e.yy * e.yy, s01 = e.xx * e.yx + e.xy * e.yy;
	double difference = s00 - s11, root = sqrt(difference * difference + 4 * s01 * s01);
	double larger = sqrt(0.5 * (s00 + s11 + root)), smaller = fabs(mat2_det(e)) / larger;
	double angle = 0.5 * atan2(2 * s01, difference), cosine = cos(angle), sine = sin(angle);
	s.rotation = (mat2){cosine, -sine, sine, cosine};
	s.sigma[0] = clamp_sigma(size * scale * larger, limit);
	s.sigma[1] = clamp_sigma(size * scale * smaller, limit);
	return s;
}

void halfvec_compute_steps(const struct path_context *c, const struct full_path *x, const struct constraint *k,
			   unsigned b, unsigned c_end, struct halfvec_step *step)
{
	struct camera storage;
	const struct camera *camera = world_camera_at(c->w, &x->v[x->edges].x, &storage);
	double sum = 0, pixels = halfvec_film_sigma(camera);
	mat2 d[FULL_PATH_VERTICES_MAX], footprint = {0, 0, 0, 0};
	for (unsigned j = c_end + 1; j < b; j++)
		if (!x->v[j].is_delta)
			sum += sigma_limit(c, &x->v[j]);
	bool differentials = b == x->edges && pixel_footprint(camera, x, &footprint) &&
			     constraint_solver_of(&c->w->accuracy)->differentials(k, b, c_end, d) == CONSTRAINT_OK;
	for (unsigned j = c_end + 1; j < b; j++) {
		if (x->v[j].is_delta)
			continue;
		double limit = sigma_limit(c, &x->v[j]);
		mat2 e;
		step[j] = (struct halfvec_step){{1, 0, 0, 1}, {limit, limit}};
		/* Each vertex takes its share of the pixels, in proportion to its limit. */
		if (differentials && divide_scaled(d[j], footprint, &e))
			step[j] = halfvec_step_from_matrix(e, pixels * limit / sum, limit);
	}
}

vec2 halfvec_step_sample(const struct halfvec_step *s, double g0, double g1)
{
	return mat2_apply(s->rotation, (vec2){s->sigma[0] * g0, s->sigma[1] * g1});
}

double halfvec_step_log_pdf(const struct halfvec_step *s, vec2 dh)
{
	double x = (s->rotation.xx * dh.x + s->rotation.yx * dh.y) / s->sigma[0],
	       y = (s->rotation.xy * dh.x + s->rotation.yy * dh.y) / s->sigma[1];
	return -0.5 * (x * x + y * y) - log(2 * M_PI * s->sigma[0] * s->sigma[1]);
}
