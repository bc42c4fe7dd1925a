/* SPDX-License-Identifier: Apache-2.0 */
/*
 * All results are finite: at grazing angles, with roughness from 0 to 2, indices next to 1 and far from it, and random
 * numbers at the ends of their range; likewise for the cases of the other tests. Invalid operations trap.
 */
#include "tests/support/stats.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/math/rng.h"

#include <fenv.h>

static const char *const extremes[] = {
	"diffuse reflectance=1",
	"conductor material=K",
	"conductor eta=0 k=0",
	"roughconductor material=Al distribution=beckmann alpha=",
	"roughconductor material=none distribution=ggx alpha=",
	"roughconductor eta=1e-9 k=1e9 distribution=ggx alpha=",
	"dielectric int_ior=1.000000001 ext_ior=1",
	"dielectric int_ior=1000 ext_ior=1",
	"roughdielectric int_ior=1.000000001 ext_ior=1 distribution=beckmann alpha=",
	"roughdielectric int_ior=1.0001 ext_ior=1 distribution=ggx alpha=",
	"roughdielectric int_ior=1.5 ext_ior=1 distribution=beckmann alpha=",
	"roughdielectric int_ior=1.5 ext_ior=1 distribution=ggx alpha=",
	"roughdielectric int_ior=1 ext_ior=100 distribution=beckmann alpha=",
	"roughdielectric int_ior=1 ext_ior=100 distribution=ggx alpha=",
	"dielectric int_ior=1 ext_ior=1 int_cauchy_b=1e-9",
	"roughdielectric int_ior=1 ext_ior=1 int_cauchy_b=1e-9 distribution=ggx alpha=",
	"roughdielectric int_sellmeier=9,0.05,0.12,0.7 distribution=beckmann alpha=",
	"phong exponent=0",
	"phong exponent=1e9 diffuse_reflectance=0 specular_reflectance=1",
	"twosided | roughconductor material=Al alpha=",
	"difftrans transmittance=1",
	"principledthin roughness=0 spec_trans=1 eta=10",
	"principledthin roughness=0.01 spec_trans=0.5 eta=1 diff_trans=2 sheen=1 flatness=1",
	"coating int_ior=1000 | diffuse reflectance=1",
	"coating int_ior=1 ext_ior=1.000000001 sigma_a=1e9 thickness=1e9 | conductor material=Al",
	"coating int_ior=1 ext_ior=1.5 | roughconductor material=Al alpha=",
	"roughcoating int_ior=1 ext_ior=1.5 | diffuse | @alpha checkerboard color0=1e-5 color1=1",
	"roughcoating int_ior=1.5 sigma_a=1e-9 | conductor material=Al",
	"ward variant=balanced alpha=",
	"ward variant=ward alpha=",
	"ward variant=ward-duer alpha=",
	"hair longitudinal_roughness=0 azimuthal_roughness=0 scale_tilt=90",
	"hair longitudinal_roughness=0.01 azimuthal_roughness=0.01 sigma_a=0",
	"hair longitudinal_roughness=1 azimuthal_roughness=1 sigma_a=1e9 scale=1e9",
	"hair int_ior=1.000000001 ext_ior=1 longitudinal_roughness=1 azimuthal_roughness=0 sigma_a=0",
	"hair int_ior=1 ext_ior=1.000000001 longitudinal_roughness=0.01 eumelanin=1e9",
	"hair int_ior=1000 ext_ior=1 sigma_a=1e-9",
	"hair int_ior=1 ext_ior=1000 longitudinal_roughness=0 azimuthal_roughness=1 sigma_a=0",
	"thindielectric int_ior=1000 ext_ior=1",
	"thindielectric int_ior=1.000000001 ext_ior=1 specular_reflectance=0",
	"plastic int_ior=1000 diffuse_reflectance=1 nonlinear=true",
	"plastic int_ior=1.000000001 ext_ior=1 specular_reflectance=0",
	"plastic int_ior=1 ext_ior=1.5 diffuse_reflectance=1 nonlinear=true",
	"roughplastic int_ior=1000 diffuse_reflectance=1 nonlinear=true alpha=",
	"roughplastic int_ior=1.000000001 ext_ior=1 distribution=ggx alpha=",
	"roughplastic int_ior=1 ext_ior=1.5 diffuse_reflectance=0 alpha=",
	"pplastic int_ior=1000 diffuse_reflectance=1 alpha=",
	"pplastic int_ior=1.000000001 ext_ior=1 distribution=ggx alpha=",
	"roughdiffuse reflectance=1 alpha=",
	"roughdiffuse reflectance=1 use_fast_approx=true alpha=",
	"principled metallic=1 anisotropic=1 specular_color=0 roughness=",
	"principled spec_trans=1 eta=1 base_color=1 roughness=",
	"principled spec_trans=0.5 eta=10 anisotropic=1 clearcoat=1 clearcoat_gloss=1 sheen=1 roughness=",
	"principled base_color=0 spec_tint=1 sheen=1 sheen_tint=1 flatness=1 clearcoat=1 clearcoat_gloss=0 roughness=",
	"principled lambertian=true coat=1 coat_roughness=0 roughness=",
	"mask opacity=0 | roughdielectric alpha=",
	"mask opacity=0.5 | dielectric int_ior=1000 ext_ior=1",
	"mask opacity=1 | plastic int_ior=1000",
	"blendbsdf weight=0 | conductor material=Al | roughconductor material=Al alpha=",
	"blendbsdf weight=1 | thindielectric | dielectric int_ior=1.000000001 ext_ior=1",
	"mixturebsdf weights=0,1 | diffuse reflectance=1 | roughconductor material=none alpha=",
	"bumpmap scale=1e9 | texture checkerboard | roughconductor material=none alpha=",
	"normalmap normalmap=rgb(1,0.5,0.5) | roughconductor material=none alpha=",
	"normalmap normalmap=rgb(0.5,0.5,0) | roughdielectric int_ior=1.5 ext_ior=1 alpha=",
	"hk sigma_s=0 sigma_a=0",
	"hk sigma_s=1e9 sigma_a=0 thickness=1e9",
	"hk sigma_t=1e-9 albedo=1 thickness=1e-9",
};
/* Each of these is appended to a text that ends in "=". */
static const double alphas[] = {0, 1e-5, 1e-3, 0.1, 1, 2};

static vec3 corner_direction(uint64_t i, const double u[4])
{
	static const double heights[] = {1, 0x1p-1074, 1e-300, 1e-160, 1e-16, 1e-8, 1e-3, 0.5, 1 - 0x1p-53, 0};
	double z = heights[(uint64_t)(u[0] * 10) % 10], phi = i % 3 ? 6.3 * u[1] : 0,
	       r = sqrt(fmax(0, (1 - z) * (1 + z)));
	if (i % 4 == 0)
		z = u[0], r = sqrt(fmax(0, (1 - z) * (1 + z)));
	return (vec3){r * cos(phi), r * sin(phi), i & 1 ? -z : z};
}

static double end_of_range(double u, double x)
{
	return x < 0.2 ? 0 : x < 0.4 ? 1 - 0x1p-53 : x < 0.5 ? 0x1p-53 : u;
}

static void check_finite_results(const char *text, const struct bsdf *b, const struct bsdf_point *p, uint64_t i)
{
	double u[4], v[4], x[4];
	rng_uniform4(7, RNG_TEST, i, 0, 0, u);
	rng_uniform4(7, RNG_TEST, i, 1, 0, v);
	rng_uniform4(7, RNG_TEST, i, 2, 0, x);
	vec3 wo = corner_direction(i, u), wi = i % 5 == 0 ? (vec3){-wo.x, -wo.y, wo.z} : corner_direction(i / 2, v);
	spectrum f = b->ops->eval(b, p, wo, wi);
	double pdf = b->ops->pdf_solid(b, p, wo, wi);
	if (!spectrum_is_valid(bsdf_eval_halfvec(b, p, wo, wi)))
		fail_msg("%s: half vector form from z = %g to %g", text, wo.z, wi.z);
	if (!spectrum_is_valid(f) || !(pdf >= 0) || !isfinite(pdf))
		fail_msg("%s: f %g, pdf %g from z = %g to %g", text, f.v[0], pdf, wo.z, wi.z);
	const double numbers[3] = {end_of_range(u[2], x[0]), end_of_range(u[3], x[1]), end_of_range(v[2], x[2])};
	struct bsdf_sample s;
	if (!b->ops->sample(b, p, wo, numbers, &s))
		return;
	if (!spectrum_is_valid(s.f) || !(s.pdf > 0) || !isfinite(s.pdf) || !(fabs(vec3_length(s.wi) - 1) < 1e-12) ||
	    !isfinite(spectrum_max(s.f) * fabs(s.wi.z) / s.pdf))
		fail_msg("%s: sample f %g, pdf %g from z = %g to %g", text, s.f.v[0], s.pdf, wo.z, s.wi.z);
	if (!(s.mode & BSDF_DELTA) && s.pdf != b->ops->pdf_solid(b, p, wo, s.wi))
		fail_msg("%s: sample's density %g is not pdf's", text, s.pdf);
}

static void check_bsdf(const char *text)
{
	const struct wavelengths w = {.nm = {360, 477.5, 595, 830}};
	struct arena a = {0};
	struct bsdf b;
	bsdf_make_or_fail(&a, text, &b);
	for (uint64_t i = 0; i < 10000; i++) {
		const struct bsdf_point p = {.wavelengths = &w,
					     .transport = i % 7 < 3 ? TRANSPORT_RADIANCE : TRANSPORT_IMPORTANCE};
		check_finite_results(text, &b, &p, i);
	}
	arena_fini(&a);
}

static void test_everything_stays_finite(void **state)
{
	(void)state;
	feenableexcept(FE_INVALID);
	for (size_t k = 0; k < sizeof extremes / sizeof *extremes; k++)
		for (size_t n = 0; n < sizeof alphas / sizeof *alphas; n++) {
			char text[256];
			bool rough = extremes[k][strlen(extremes[k]) - 1] == '=';
			bool to_one = rough && strstr(extremes[k], " roughness="); /* principled's range */
			if ((!rough && n > 0) || (to_one && alphas[n] > 1))
				break;
			if (rough)
				snprintf(text, sizeof text, "%s%g", extremes[k], alphas[n]);
			else
				snprintf(text, sizeof text, "%s", extremes[k]);
			check_bsdf(text);
		}
	for (int k = 0; k < BSDF_CASES; k++)
		check_bsdf(bsdf_cases[k]);
	fedisableexcept(FE_INVALID);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_everything_stays_finite),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
