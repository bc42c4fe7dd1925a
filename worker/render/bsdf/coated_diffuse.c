/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/bsdf/coated_diffuse.h"

#include "worker/render/bsdf/warp.h"

int coated_diffuse_read(struct coated_diffuse *c, struct bsdf *b, const struct scene_node *n,
			const struct bsdf_build *build, struct error *e)
{
	double inside, outside;
	int code = ior_read(n, "int_ior", COATED_DIFFUSE_IOR_DEFAULT, &inside, e);
	if (!code)
		code = ior_read(n, "ext_ior", IOR_AIR_DEFAULT, &outside, e);
	if (!code)
		code = bsdf_read_texture(b, &c->diffuse, n, "diffuse_reflectance", 0.5, build, e);
	if (!code)
		code = bsdf_read_texture(b, &c->specular, n, "specular_reflectance", 1, build, e);
	if (code)
		return code;
	c->eta = inside / outside;
	c->is_nonlinear = node_bool(n, "nonlinear", false);
	double d = texture_max(&c->diffuse), s = texture_max(&c->specular);
	b->is_black = d + s == 0;
	c->specular_weight = d + s > 0 ? s / (d + s) : 0;
	b->modes = BSDF_REFLECT;
	b->has_smooth = true;
	return 0;
}

/* The denominator is written with E eta^2 = escape: eta^2 (1 - rho' (1 - E)) = eta^2 (1 - rho') + rho' E eta^2. */
spectrum coated_diffuse_eval(const struct coated_diffuse *c, const struct bsdf_point *p, double escape,
			     double transmitted_o, double transmitted_i)
{
	spectrum rho = texture_eval(&c->diffuse, &p->texture_point, p->wavelengths);
	double common = transmitted_o * transmitted_i / WARP_PI;
	if (!(common > 0)) /* escape is 0, too, if no light at all enters the coating */
		return spectrum_constant(0);
	for (int i = 0; i < SPECTRUM_LANES; i++) {
		double bounce_reflectance = c->is_nonlinear ? rho.v[i] : 1;
		rho.v[i] *= common / (c->eta * c->eta * (1 - bounce_reflectance) + bounce_reflectance * escape);
	}
	return rho;
}

double coated_diffuse_specular_probability(const struct coated_diffuse *c, double reflected)
{
	double s = reflected * c->specular_weight, d = (1 - reflected) * (1 - c->specular_weight);
	return s + d > 0 ? s / (s + d) : 0;
}
