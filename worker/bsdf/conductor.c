/* A smooth metal on the side of the normal. */
#include "worker/bsdf/metal.h"

#include <float.h>

static spectrum conductor_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p, (void)wo, (void)wi;
	return spectrum_of(0);
}

static double conductor_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p, (void)wo, (void)wi;
	return 0;
}

static bool conductor_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			     struct bsdf_sample *out)
{
	(void)u;
	if (!(wo.z >= DBL_MIN)) /* 1 / wo.z must be finite */
		return false;
	*out = (struct bsdf_sample){.wi = {-wo.x, -wo.y, wo.z}, .mode = BSDF_REFLECT | BSDF_DELTA, .pdf = 1,
				    .f = spectrum_scale(1 / wo.z, metal_fresnel(b->data, p, wo.z)), .eta = 1};
	return true;
}

static int conductor_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	struct metal *m = bsdf_data(b, n, build, sizeof *m, e);
	if (!m)
		return -ENOMEM;
	b->modes = BSDF_REFLECT | BSDF_DELTA;
	b->has_delta = true;
	b->alpha = 0;
	return metal_read(m, b, n, build, e);
}

static const struct param conductor_params[] = {METAL_PARAMS, {.name = NULL}};

const struct bsdf_ops bsdf_ops_conductor = {
	.type = "conductor",
	.params = conductor_params,
	.create = conductor_create,
	.eval = conductor_eval,
	.pdf_solid = conductor_pdf,
	.sample = conductor_sample,
};
