/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The BSDFs of the generic tests, each with several sets of parameters, as text (see node_make_bsdf in
 * tests/support/nodes.h). The tests fail if a BSDF of the registry has no set here.
 */
#ifndef TESTS_WORKER_BSDF_BSDF_CASES_H
#define TESTS_WORKER_BSDF_BSDF_CASES_H

#include "tests/support/measured_file.h"
#include "tests/support/nodes.h"
#include "worker/render/bsdf/bsdf.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const char *const bsdf_cases[] = {
	"diffuse",
	"diffuse reflectance=rgb(0.8,0.2,0.1)",
	"conductor material=none",
	"conductor material=Au specular_reflectance=0.7",
	"roughconductor material=none alpha=0.3",
	"roughconductor material=none alpha=0.3 distribution=ggx",
	"roughconductor material=Au alpha=0.05",
	"roughconductor material=Ag alpha=0.05 distribution=ggx specular_reflectance=rgb(0.5,0.6,0.7)",
	"roughconductor alpha=1 eta=rgb(0.2,0.9,1.1) k=rgb(3.9,2.4,2.1)",
	"roughconductor alpha=1 eta=0.2 k=3 distribution=ggx",
	"roughconductor alpha=0.4 k=3 | @eta checkerboard color0=0.3 color1=rgb(0.2,0.9,1.4)",
	"conductor eta=0.2 ext_eta=1.3 | @k checkerboard color0=rgb(2,2.5,3) color1=4",
	"roughconductor material=none alpha_u=0.1 alpha_v=0.4",
	"roughconductor material=Au alpha_u=0.6 alpha_v=0.05 distribution=ggx",
	"roughconductor material=Au | @alpha checkerboard color0=0.3 color1=0.3",
	"roughconductor material=none alpha_u=0.2 distribution=ggx | @alpha_v checkerboard color0=0.4 color1=0.4",
	"roughdielectric int_ior=1.5 ext_ior=1 | @alpha checkerboard color0=0.25 color1=0.25",
	"roughdielectric int_ior=1.5 ext_ior=1 alpha_u=0.1 alpha_v=0.5",
	"roughdielectric int_ior=1 ext_ior=1.5 alpha_u=0.4 alpha_v=0.15 distribution=ggx",
	"dielectric",
	"dielectric int_ior=water ext_ior=diamond specular_transmittance=rgb(0.9,0.8,0.7)",
	"roughdielectric int_ior=1.5 ext_ior=1 alpha=0.3",
	"roughdielectric int_ior=1.5 ext_ior=1 alpha=0.3 distribution=ggx",
	"roughdielectric int_ior=1 ext_ior=1.5 alpha=0.1 distribution=ggx",
	"roughdielectric int_ior=2.4 ext_ior=1 alpha=1",
	"roughdielectric int_ior=2.4 ext_ior=1 alpha=1 distribution=ggx specular_transmittance=rgb(0.9,0.8,0.7)",
	"roughdielectric int_ior=1.1 ext_ior=1 alpha=0.5",
	"dielectric int_ior=sf11 dispersion=true",
	"dielectric int_cauchy_b=0.01 ext_cauchy_b=-0.002 ext_ior=1.2 specular_reflectance=0.9",
	"roughdielectric int_ior=diamond ext_ior=water dispersion=true alpha=0.3",
	"roughdielectric int_ior=1 ext_sellmeier=1.0396,0.2318,1.0105,0.006,0.02,103.56 alpha=0.2 distribution=ggx",
	"roughdielectric int_ior=1.5 ext_ior=1.5 int_cauchy_b=0.02 alpha=0.4", /* eta is 1 only at IOR_REFERENCE_NM */
	"roughdiffuse reflectance=0.9",
	"roughdiffuse alpha=1 reflectance=rgb(1,0.3,0.1)",
	"roughdiffuse alpha=0.7 use_fast_approx=true",
	"roughdiffuse reflectance=0.9 | @alpha checkerboard color0=0.6 color1=0.6",
	"phong",
	"phong exponent=0 specular_reflectance=0.9 diffuse_reflectance=0.4",
	"phong exponent=300 diffuse_reflectance=0 specular_reflectance=1",
	"phong exponent=5 diffuse_reflectance=rgb(0.1,0.3,0.2)",
	"phong specular_reflectance=0.6 diffuse_reflectance=0.3 | @exponent checkerboard color0=20 color1=90",
	"thindielectric",
	"thindielectric int_ior=2.4 specular_transmittance=rgb(0.9,0.8,0.7) specular_reflectance=0.9",
	"plastic",
	"plastic int_ior=1.9 diffuse_reflectance=rgb(0.9,0.2,0.5) nonlinear=true",
	"plastic diffuse_reflectance=1 specular_reflectance=rgb(0.5,0.4,0.3)",
	"roughplastic",
	"roughplastic alpha=0.3 distribution=ggx diffuse_reflectance=rgb(0.9,0.2,0.5) nonlinear=true",
	"roughplastic alpha=1 int_ior=2.4 diffuse_reflectance=1",
	"roughplastic alpha=0.02 diffuse_reflectance=0 specular_reflectance=0.7",
	"pplastic",
	"pplastic alpha_u=0.1 alpha_v=0.4 distribution=ggx int_ior=1.9 diffuse_reflectance=rgb(0.9,0.2,0.5)",
	"pplastic alpha=0.02 diffuse_reflectance=0 specular_reflectance=0.7",
	"pplastic diffuse_reflectance=1 specular_reflectance=rgb(0.5,0.4,0.3) | @alpha checkerboard color0=0.3 color1=0.3",
	"principled",
	"principled base_color=rgb(0.8,0.3,0.1) roughness=0.2 metallic=0.7 anisotropic=0.6",
	"principled base_color=rgb(0.8,0.3,0.1) roughness=0.3 spec_tint=0.8 sheen=0.5 sheen_tint=0.7 flatness=0.5 specular=0.9",
	"principled base_color=0.4 roughness=0.6 clearcoat=1 clearcoat_gloss=0.1",
	"principled base_color=0.9 roughness=0.6 coat=1 coat_roughness=0.3",
	"principled base_color=0.3 roughness=0.4 metallic=0.3 eta=3 specular_color=rgb(0.9,0.2,0.6)",
	"principled base_color=rgb(0.8,0.3,0.1) roughness=0.4 metallic=0.2 lambertian=true eta=1.7",
	"principled base_color=0.9 roughness=0.7 lambertian=true specular_color=rgb(0.9,0.2,0.6) sheen=0.3 spec_trans=0.4",
	"principled base_color=rgb(0.2,0.8,0.7) roughness=0.5 spec_trans=0.9 coat=0.7 coat_roughness=0.5",
	"principled base_color=rgb(0.8,0.3,0.1) roughness=0.4 spec_trans=0.3 | @metallic checkerboard color0=0.2 color1=0.9",
	"principled base_color=rgb(0.9,0.8,0.7) roughness=0.4 spec_trans=1 eta=1.6",
	"principled base_color=rgb(0.2,0.8,0.7) roughness=0.5 spec_trans=0.6 metallic=0.2 clearcoat=0.5 anisotropic=0.4",
	"principled base_color=rgb(0.8,0.3,0.1) roughness=0.4 lambertian=true specular_strength=0.3 coat=0.4",
	"principled base_color=rgb(0.9,0.8,0.7) roughness=0.4 spec_trans=1 eta=1.6 specular_strength=0",
	"principled base_color=0.9 roughness=0.5 spec_trans=0.7 specular_color=rgb(0.9,0.2,0.6) | @specular_strength "
	"checkerboard color0=0.1 color1=0.8",
	"principledthin",
	"principledthin base_color=rgb(0.8,0.3,0.1) roughness=0.4 spec_trans=0.6 diff_trans=1.2 anisotropic=0.3",
	"principledthin base_color=0.9 roughness=0.5 spec_trans=1 eta=1.8",
	"principledthin base_color=0.9 roughness=0.5 spec_trans=0.8 | @eta checkerboard color0=1.3 color1=1.9",
	"principledthin base_color=rgb(0.8,0.3,0.1) | @spec_trans checkerboard color0=0 color1=0.7 "
	"| @diff_trans checkerboard color0=0.2 color1=1.8",
	"principledthin base_color=rgb(0.8,0.3,0.1) sheen=0.5 sheen_tint=0.7 flatness=0.5 diff_trans=2 spec_tint=0.5",
	"principled base_color=rgb(0.9,0.8,0.7) roughness=0.4 | @spec_trans checkerboard color0=0 color1=0.6",
	"null",
	"polarizer",
	"polarizer transmittance=rgb(0.9,0.5,0.2) theta=30",
	"circular transmittance=0.8 left_handed=true",
	"circular | @transmittance checkerboard color0=0.6 color1=0.6",
	"retarder delta=180",
	"mask | diffuse reflectance=0.9",
	"mask opacity=0.3 | plastic",
	"mask opacity=0.8 | roughconductor alpha=0.2",
	"mask opacity=1 | conductor material=none",
	"mask opacity=0.6 | difftrans transmittance=rgb(0.9,0.5,0.2)",
	"mask opacity=0.7 | thindielectric",
	"mask opacity=0.4 | principledthin spec_trans=0.5 diff_trans=1 roughness=0.4",
	"mask opacity=0.6 | dielectric int_ior=1.5 ext_ior=1",
	"mask opacity=0.7 | roughdielectric int_ior=1.5 ext_ior=1 alpha=0.3 distribution=ggx",
	"mask opacity=0.5 | principled base_color=rgb(0.9,0.8,0.7) roughness=0.4 spec_trans=0.7",
	"blendbsdf weight=0.4 | thindielectric | dielectric int_ior=1.5 ext_ior=1",
	"blendbsdf weight=0.3 | diffuse reflectance=0.8 | roughconductor alpha=0.2 material=Au",
	"blendbsdf weight=0.6 | plastic | conductor material=Ag",
	"blendbsdf weight=0.4 | diffuse | roughplastic alpha=0.3", /* reuses the rest of the random number that chose
								      the part */
	"blendbsdf weight=0 | phong | diffuse",
	"blendbsdf weight=0.7 | diffuse reflectance=0.8 | difftrans transmittance=rgb(0.9,0.5,0.2)",
	"blendbsdf weight=0.5 | thindielectric | difftrans",
	"blendbsdf weight=0.2 | diffuse | roughdielectric int_ior=1.5 ext_ior=1 alpha=0.3",
	"mixturebsdf weights=0.2,0.3,0.4 | diffuse reflectance=0.9 | roughconductor alpha=0.2 | plastic",
	"mixturebsdf weights=3,1 | conductor material=none | phong",
	"roughplastic int_ior=1.7 diffuse_reflectance=rgb(0.9,0.5,0.2) | @alpha checkerboard color0=0.1 color1=0.3",
	"coating | diffuse reflectance=0.8",
	"coating int_ior=1.8 thickness=2 sigma_a=rgb(0.1,0.3,0.05) | roughconductor material=Cu alpha=0.2",
	"coating specular_reflectance=0.5 | conductor material=Al",
	"coating thickness=0.5 | roughconductor material=Cu alpha=0.2 | @sigma_a checkerboard color0=0.3 "
	"color1=rgb(0.1,0.9,0.4)",
	"coating int_ior=1 ext_ior=1.3 | diffuse",
	"coating | plastic",
	"roughcoating alpha=0.2 | diffuse reflectance=rgb(0.9,0.5,0.2)",
	"roughcoating alpha=0.3 distribution=ggx int_ior=1.9 sigma_a=0.2 | roughconductor material=Au alpha=0.3",
	"roughcoating alpha=0.2 | conductor material=Al",
	"roughcoating alpha=0.2 | diffuse reflectance=0.8 | @sigma_a checkerboard color0=rgb(0.1,0.9,0.4) color1=0.3",
	"difftrans",
	"difftrans transmittance=rgb(1,0.4,0.2)",
	"hk",
	"hk sigma_s=2 sigma_a=0.1 thickness=0.1",
	"hk sigma_s=rgb(1,3,0.5) sigma_a=rgb(0.2,0,1) | phase hg g=0.6",
	"hk sigma_t=4 albedo=1 thickness=20 | phase rayleigh",
	"hk sigma_t=0.3 | @albedo checkerboard color0=0.4 color1=rgb(0.9,0.5,0.1)",
	"mask opacity=0.6 | hk sigma_t=1 albedo=rgb(0.9,0.5,0.7)",
	"blendbsdf weight=0.4 | hk sigma_s=1 sigma_a=0.3 | difftrans",
	"ward",
	"ward variant=ward alpha_u=0.1 alpha_v=0.3 diffuse_reflectance=0.2 specular_reflectance=rgb(0.3,0.4,0.5)",
	"ward variant=ward-duer alpha=0.15 diffuse_reflectance=0.1 specular_reflectance=0.3",
	"ward alpha_u=0.5 alpha_v=0.2 diffuse_reflectance=0 specular_reflectance=0.6",
	"ward specular_reflectance=0.5 | @alpha_u checkerboard color0=0.3 color1=0.3",
	"twosided | plastic | roughplastic alpha=0.2",
	"twosided | diffuse reflectance=0.9",
	"twosided | roughconductor alpha=0.2 material=Cu | phong exponent=10",
	"twosided | diffuse | conductor material=Cr",
	"bumpmap scale=0.1 | roughconductor alpha=0.2 | texture checkerboard",
	"normalmap | texture scale scale=0.5 texture checkerboard | roughdielectric alpha=0.3",
	"normalmap normalmap=rgb(0.7,0.45,0.9) | roughconductor alpha=0.2",
	"hair",
	"hair longitudinal_roughness=0.7 azimuthal_roughness=0.9 eumelanin=0.3 pheomelanin=1",
	"hair sigma_a=0 longitudinal_roughness=0.2 azimuthal_roughness=0.6 scale_tilt=-5 int_ior=1.8 ext_ior=1",
	"hair int_ior=1 ext_ior=1.3 longitudinal_roughness=0.4 sigma_a=rgb(0.1,0.4,0.9)",
	"hair scale=3 scale_tilt=20 | @sigma_a checkerboard color0=0.1 color1=rgb(0.5,0.2,0.1)",
	"measured filename=isotropic.bsdf",
	"measured filename=anisotropic.bsdf",
	"measured filename=rgb.bsdf",
	"twosided | measured filename=isotropic.bsdf",
	"measured_polarized filename=polarized.pbsdf alpha_sample=0.4",
	"measured_polarized filename=polarized.pbsdf wavelength=520",
	"blendbsdf weight=0.4 | measured_polarized filename=polarized.pbsdf | roughconductor alpha=0.2",
	"coating | measured filename=rgb.bsdf",
	"blendbsdf weight=0.4 | measured filename=anisotropic.bsdf | roughconductor alpha=0.2",
	"mask opacity=0.7 | hair sigma_a=0.3",
	"blendbsdf weight=0.4 | hair azimuthal_roughness=0.5 | difftrans",
	/* Parts with different normals, which differ only if there is a surface. */
	"blendbsdf weight=0.4 | normalmap / roughplastic alpha=0.2 / texture checkerboard color0=rgb(0.7,0.5,0.9) "
	"color1=rgb(0.4,0.35,0.9) | roughconductor alpha=0.1",
	"blendbsdf weight=0.7 | conductor | normalmap / difftrans / texture checkerboard color0=rgb(0.7,0.5,0.9)",
	"twosided | normalmap / diffuse / texture checkerboard color0=rgb(0.3,0.3,0.8) | roughconductor alpha=0.2",
	"blendbsdf weight=0.5 | roughdielectric alpha=0.1 | blendbsdf weight=0.4 / normalmap ; diffuse ; texture "
	"checkerboard color0=rgb(0.4,0.7,0.9) / normalmap ; roughconductor alpha=0.3 ; texture checkerboard "
	"color1=rgb(0.6,0.3,0.8)",
};
enum { BSDF_CASES = sizeof bsdf_cases / sizeof *bsdf_cases };

static inline int bsdf_try(struct arena *a, const char *text, bool dialect_3, struct bsdf *b, struct error *e)
{
	const struct asset_source assets = memory_assets(measured_file_all());
	const struct bsdf_build build = {.arena = a, .is_dialect_3 = dialect_3, .assets = &assets};
	return bsdf_create(b, node_make_bsdf(a, text), &build, e);
}

static inline void bsdf_make_or_fail(struct arena *a, const char *text, struct bsdf *b)
{
	struct error e;
	if (bsdf_try(a, text, true, b, &e))
		fail_msg("%s: %s", text, e.text);
}

#endif
