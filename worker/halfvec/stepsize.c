#include "worker/halfvec/stepsize.h"

/* Deviation of the film step that all vertices share, of the smaller side of the film. */
#define FILM_STEP 0.02
/* Steps are not shorter than that part of what the lobe allows: a focus would make them vanish. */
#define LEAST_STEP 1e-6

/* What the lobe allows: the mean |h_x| of a Beckmann lobe. */
static double lobe_limit(const struct path_vertex *v)
{
	return fmin(v->bsdf->alpha, 1) / sqrt(M_PI);
}

mat2 halfvec_footprint(const struct world *w, const struct whole_path *x)
{
	const struct camera *camera = &w->camera;
	const struct path_vertex *v = &x->v[x->edges - 1];
	vec3 d = vec3_neg(x->edge[x->edges - 1].w), du, dv;
	double along = vec3_dot(camera->axes.n, d), ng = vec3_dot(v->x.ng, d);
	double shift = along * sqrt(x->edge[x->edges - 1].distance2) / camera->scale;
	/* A pixel moves the ray's point by `shift` across the axis, and along the ray back into the plane. */
	vec3 px = vec3_scale(shift, vec3_madd(camera->axes.s, -vec3_dot(v->x.ng, camera->axes.s) / ng, d));
	vec3 py = vec3_scale(shift, vec3_madd(camera->axes.t, -vec3_dot(v->x.ng, camera->axes.t) / ng, d));
	surface_tangents(&v->x, &du, &dv);
	return (mat2){vec3_dot(px, du), vec3_dot(py, du), vec3_dot(px, dv), vec3_dot(py, dv)};
}

/* Axes and singular values of e times `pixels`; false: not finite. */
static bool axes_of(mat2 e, double pixels, struct halfvec_step *out)
{
	double s00 = e.xx * e.xx + e.xy * e.xy, s11 = e.yx * e.yx + e.yy * e.yy, s01 = e.xx * e.yx + e.xy * e.yy;
	double half = 0.5 * (s00 + s11), root = 0.5 * hypot(s00 - s11, 2 * s01), det = mat2_det(e);
	if (!isfinite(half) || !isfinite(root) || !(half > 0))
		return false;
	double theta = 0.5 * atan2(2 * s01, s00 - s11), c = cos(theta), s = sin(theta), large = half + root;
	out->u = (mat2){c, -s, s, c};
	out->sigma[0] = pixels * sqrt(large);
	/* The smaller value from the determinant: the difference would cancel. */
	out->sigma[1] = pixels * fabs(det) / sqrt(large);
	return isfinite(out->sigma[0]) && isfinite(out->sigma[1]);
}

static void clip(struct halfvec_step *s, double limit)
{
	for (int i = 0; i < 2; i++)
		s->sigma[i] = fmin(fmax(s->sigma[i], LEAST_STEP * limit), limit);
}

void halfvec_steps(const struct path_context *c, const struct whole_path *x, const struct constraint *k, unsigned b,
		   unsigned c_end, struct halfvec_step *step)
{
	mat2 d[WHOLE_MAX_VERTICES], footprint = {0, 0, 0, 0};
	double sum = 0;
	bool film = b == x->edges && constraint_differentials(k, b, c_end, d) == CONSTRAINT_OK;
	for (unsigned j = c_end + 1; j < b; j++)
		sum += x->v[j].delta ? 0 : lobe_limit(&x->v[j]);
	if (film)
		footprint = halfvec_footprint(c->w, x);
	double pixels = FILM_STEP * fmin(c->w->camera.width, c->w->camera.height);
	for (unsigned j = c_end + 1; j < b; j++) {
		if (x->v[j].delta)
			continue;
		double limit = lobe_limit(&x->v[j]), det = film ? mat2_det(d[j]) : 0;
		step[j] = (struct halfvec_step){{1, 0, 0, 1}, {limit, limit}};
		struct halfvec_step by_film;
		/* Each vertex takes its share of the pixels. */
		if (det != 0 && axes_of(mat2_mul(mat2_scale(1 / det, mat2_adjugate(d[j])), footprint), pixels * limit / sum, &by_film)) {
			clip(&by_film, limit);
			step[j] = by_film;
		}
	}
}

double halfvec_step_log_pdf(const struct halfvec_step *s, vec2 dh)
{
	double a = (s->u.xx * dh.x + s->u.yx * dh.y) / s->sigma[0], b = (s->u.xy * dh.x + s->u.yy * dh.y) / s->sigma[1];
	return -0.5 * (a * a + b * b) - log(2 * M_PI * s->sigma[0] * s->sigma[1]);
}
