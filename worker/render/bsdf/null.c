/* SPDX-License-Identifier: Apache-2.0 */
/* Light passes straight through. A path counts one more edge for it, and next event estimation does not look
 * through. */
#include "worker/render/bsdf/create.h"
#include "worker/render/bsdf/straight.h"

static spectrum null_eval(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p, (void)wo, (void)wi;
	return spectrum_of(0);
}

static double null_pdf(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)p, (void)wo, (void)wi;
	return 0;
}

static spectrum null_eval_delta(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, unsigned mode, vec3 *wi,
				double *chance)
{
	(void)b, (void)p;
	if (!(mode & BSDF_TRANSMIT) || !straight_direction(wo, wi))
		return spectrum_of(0);
	*chance = 1;
	return spectrum_of(1);
}

static bool null_sample(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, const double u[3],
			struct bsdf_sample *out)
{
	(void)b, (void)p, (void)u;
	*out = (struct bsdf_sample){.mode = BSDF_TRANSMIT | BSDF_DELTA, .pdf = 1, .eta = 1};
	if (!straight_direction(wo, &out->wi))
		return false;
	out->f = spectrum_of(1 / fabs(wo.z));
	return true;
}

static int null_create(struct bsdf *b, const struct scene_node *n, const struct bsdf_build *build, struct error *e)
{
	(void)n, (void)build, (void)e;
	b->modes = BSDF_TRANSMIT | BSDF_DELTA;
	b->has_delta = true;
	b->two_sided = true;
	b->alpha = b->alpha_mean = 0;
	return 0;
}

static const struct param null_params[] = {{.name = NULL}};

const struct bsdf_ops bsdf_ops_null = {
	.type = "null",
	.params = null_params,
	.create = null_create,
	.eval = null_eval,
	.pdf_solid = null_pdf,
	.eval_delta = null_eval_delta,
	.sample = null_sample,
};
