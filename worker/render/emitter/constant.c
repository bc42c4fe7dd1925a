/* SPDX-License-Identifier: Apache-2.0 */
/* An environment with the same radiance from all directions. */
#include "worker/render/emitter/emitter.h"
#include "worker/render/emitter/uniform.h"

#define UNIFORM_PDF (1 / (4 * M_PI))

static spectrum constant_radiance(const struct emitter *em, const struct emitter_point *x, vec3 w,
				  const struct wavelengths *wl)
{
	(void)x, (void)w;
	return color_eval(em->data, wl);
}

static bool constant_sample_point(const struct emitter *em, const double u[2], struct emitter_point *x,
				  double *pdf_point)
{
	(void)em;
	*x = (struct emitter_point){.p = vec3_normalize(sphere_from_square(u)), .is_infinite = true};
	*pdf_point = UNIFORM_PDF;
	return true;
}

static double constant_pdf_point(const struct emitter *em, const struct emitter_point *x)
{
	(void)em, (void)x;
	return UNIFORM_PDF;
}

static void constant_point_inverse(const struct emitter *em, const struct emitter_point *x, double u[2])
{
	(void)em;
	square_from_sphere(x->p, u);
}

static int constant_create(struct emitter *em, const struct scene_node *n, const struct emitter_build *build,
			   struct error *e)
{
	struct texture radiance;
	int code = emitter_read_texture(&radiance, n, "radiance", COLOR_ILLUMINANT, build, e);
	if (code)
		return code;
	struct color *c = em->data;
	*c = radiance.color;
	em->is_infinite = true;
	em->color_kind = c->kind;
	em->power = 4 * M_PI * color_mean(c);
	em->brightness_bound = color_max(c);
	return 0;
}

const struct emitter_ops emitter_ops_constant = {
	.decl = PLUGIN(EMITTER, "constant", {.name = "radiance", .types = VALUE_COLOR, .max = PARAM_LIGHT_MAX},
		       {.name = "sampling_weight", .types = VALUE_FLOAT | VALUE_INT, .status = PARAM_IGNORED}),
	.data_size = sizeof(struct color),
	.create = constant_create,
	.radiance = constant_radiance,
	.sample_point = constant_sample_point,
	.pdf_point = constant_pdf_point,
	.point_inverse = constant_point_inverse,
};
