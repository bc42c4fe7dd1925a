/* SPDX-License-Identifier: Apache-2.0 */
/* The principled BSDF is compared with other plug-ins where it is equal to them, and each lobe by itself with its
 * formula. */
#include "tests/worker/render/bsdf/bsdf_cases.h"

#include <errno.h>
#include <math.h>

#define PI 3.14159265358979323846

static const struct wavelengths wavelengths = {.nm = {430, 500, 570, 640}};
static const struct bsdf_point point = {
	.texture_point = {.u = 0.3, .v = 0.7}, .wavelengths = &wavelengths, .transport = TRANSPORT_RADIANCE};

static vec3 direction(double z, double phi)
{
	double s = sqrt((1 - z) * (1 + z));
	return (vec3){s * cos(phi), s * sin(phi), z};
}

static void expect_equal(const char *a, const char *b, double below, double factor)
{
	struct arena arena = {0};
	struct bsdf x, y;
	bsdf_make_or_fail(&arena, a, &x);
	bsdf_make_or_fail(&arena, b, &y);
	size_t positive = 0;
	for (int i = 0; i < 400; i++) {
		vec3 wo = direction(0.03 + 0.96 * (i % 20) / 20, 0.4),
		     wi = direction(0.02 + 0.97 * (i / 20) / 20, 0.3 * i);
		if (below > 0 && i % 3)
			wi.z = -wi.z;
		if (below > 0 && i % 2)
			wo.z = -wo.z;
		spectrum p = x.ops->eval(&x, &point, wo, wi), q = y.ops->eval(&y, &point, wo, wi);
		for (int l = 0; l < SPECTRUM_LANES; l++)
			if (fabs(p.v[l] - factor * q.v[l]) > 1e-9 * (p.v[l] + q.v[l]))
				fail_msg("%s is %g, %s %g, from z = %g to %g", a, p.v[l], b, q.v[l], wo.z, wi.z);
		positive += p.v[0] > 0;
	}
	assert_true(positive > 100);
	arena_fini(&arena);
}

/* Glass of the same roughness: alpha is its square. */
static void test_glass_is_roughdielectric(void **state)
{
	(void)state;
	expect_equal("principled base_color=1 roughness=0.5 spec_trans=1 eta=1.6",
		     "roughdielectric alpha=0.25 distribution=ggx int_ior=1.6 ext_ior=1", 1, 1);
}

/* With an index of 1 the boundary vanishes, up to the minimum index; a black metal has only Schlick's term at grazing
 * angles. */
static void test_metal_is_schlick_over_ggx(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf metal, mirror;
	bsdf_make_or_fail(&a, "principled base_color=0.3 roughness=0.6 metallic=1 anisotropic=0.5", &metal);
	double aspect = sqrt(1 - 0.9 * 0.5);
	char text[128];
	snprintf(text, sizeof text, "roughconductor material=none distribution=ggx alpha_u=%.17g alpha_v=%.17g",
		 0.36 / aspect, 0.36 * aspect);
	bsdf_make_or_fail(&a, text, &mirror);
	for (int i = 0; i < 300; i++) {
		vec3 wo = direction(0.05 + 0.9 * (i % 15) / 15, 1),
		     wi = direction(0.05 + 0.9 * (i / 15) / 20, 0.37 * i);
		double cos_d = sqrt((1 + vec3_dot(wo, wi)) / 2), f = 0.3 + 0.7 * pow(1 - cos_d, 5);
		double expected = f * mirror.ops->eval(&mirror, &point, wo, wi).v[2],
		       told = metal.ops->eval(&metal, &point, wo, wi).v[2];
		assert_true(fabs(told - expected) <= 1e-9 * expected);
	}
	arena_fini(&a);
}

/* Returns the diffuse lobe of a base of 0.6, over 0.6 / pi, as the difference to a black base. */
static void check_diffuse(const char *parameters, double (*expected)(vec3 wo, vec3 wi))
{
	struct arena a = {0};
	struct bsdf full, black;
	char text[128];
	snprintf(text, sizeof text, "principled base_color=0.6 %s", parameters);
	bsdf_make_or_fail(&a, text, &full);
	snprintf(text, sizeof text, "principled base_color=0 %s", parameters);
	bsdf_make_or_fail(&a, text, &black);
	for (int i = 0; i < 300; i++) {
		vec3 wo = direction(0.05 + 0.9 * (i % 15) / 15, 1),
		     wi = direction(0.05 + 0.9 * (i / 15) / 20, 0.37 * i);
		double even = 0.6 / PI * expected(wo, wi);
		double actual =
			full.ops->eval(&full, &point, wo, wi).v[1] - black.ops->eval(&black, &point, wo, wi).v[1];
		assert_true(fabs(actual - even) <= 1e-9 * even);
	}
	arena_fini(&a);
}

/* At roughness r = 0.7, F_D90 = 0.5 + 2 r cos^2. */
static double burley_factor(vec3 wo, vec3 wi)
{
	double cos2 = (1 + vec3_dot(wo, wi)) / 2, f90 = 0.5 + 2 * 0.7 * cos2;
	return (1 + (f90 - 1) * pow(1 - wo.z, 5)) * (1 + (f90 - 1) * pow(1 - wi.z, 5));
}

/* As in the glTF specification (B.3.5): light not reflected at the half vector is scattered evenly. Fresnel's formulas
 * with eta 1.5. */
static double lambert_factor(vec3 wo, vec3 wi)
{
	double c = sqrt((1 + vec3_dot(wo, wi)) / 2), t = sqrt(1 - (1 - c * c) / (1.5 * 1.5));
	double s = (c - 1.5 * t) / (c + 1.5 * t), p = (t - 1.5 * c) / (t + 1.5 * c);
	return 1 - 0.5 * (s * s + p * p);
}

/* A coloured reflection, with eta 3: Schlick's factor for each wavelength. */
static double lambert_below_coloured_reflection(vec3 wo, vec3 wi)
{
	double c = sqrt((1 + vec3_dot(wo, wi)) / 2), f0 = 0.5 * 0.25;
	return 1 - (f0 + (1 - f0) * pow(1 - c, 5));
}

static void diffuse_lobes_follow_their_formulas(void **state)
{
	(void)state;
	check_diffuse("roughness=0.7", burley_factor);
	check_diffuse("roughness=0.7 eta=1.5 lambertian=true", lambert_factor);
	check_diffuse("roughness=0.7 eta=3 lambertian=true specular_color=0.5", lambert_below_coloured_reflection);
}

/* The half vectors of the clearcoat are a distribution: the integral of D cos over the hemisphere is 1. The value that
 * the clearcoat adds is computed by hand for one pair. */
static void clearcoat_is_a_normalised_distribution(void **state)
{
	(void)state;
	enum { STEPS = 200000 };
	struct arena a = {0};
	struct bsdf coated, bare;
	bsdf_make_or_fail(&a, "principled base_color=0.2 clearcoat=1 clearcoat_gloss=0.5", &coated);
	bsdf_make_or_fail(&a, "principled base_color=0.2", &bare);
	double alpha = 0.5 * (0.1 + 0.001), sum = 0;
	for (int i = 0; i < STEPS;
	     i++) { /* mirrored pairs with half vector h at cosine c: f = F D G1 G1 / 4 with wo = wi = h */
		double c = (i + 0.5) / STEPS, a2 = alpha * alpha;
		vec3 h = direction(c, 0.2);
		double actual = coated.ops->eval(&coated, &point, h, h).v[0] - bare.ops->eval(&bare, &point, h, h).v[0];
		double tan2 = (1 - c * c) / (c * c), g1 = 2 / (1 + sqrt(1 + 0.0625 * tan2));
		double d = actual * 4 / (0.04 * g1 * g1);
		double gtr1 = (a2 - 1) / (PI * log(a2)) / (1 + (a2 - 1) * c * c);
		if (d > 1e-6 && fabs(d / gtr1 - 1) > 1e-4)
			fail_msg("at cosine %g: D = %g, GTR1 %g", c, d, gtr1);
		sum += gtr1 * c * 2 * PI / STEPS;
	}
	assert_true(fabs(sum - 1) < 1e-3);
	arena_fini(&a);
}

/* A coat over a metal, whose lobe is known without the coat: the coat adds GGX with Schlick's factor, as in
 * `roughconductor`, and the metal loses the reflected share on the way in and on the way out. */
static void clearcoat_adds_ggx_and_dims_the_metal(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf coated, bare, layer;
	bsdf_make_or_fail(&a, "principled base_color=0.3 metallic=1 roughness=0.8 coat=0.6 coat_roughness=0.5",
			  &coated);
	bsdf_make_or_fail(&a, "principled base_color=0.3 metallic=1 roughness=0.8", &bare);
	bsdf_make_or_fail(&a, "roughconductor material=none distribution=ggx alpha=0.25", &layer);
	for (int i = 0; i < 300; i++) {
		vec3 wo = direction(0.05 + 0.9 * (i % 15) / 15, 1),
		     wi = direction(0.05 + 0.9 * (i / 15) / 20, 0.37 * i);
		double cos_d = sqrt((1 + vec3_dot(wo, wi)) / 2);
		double at[3] = {wo.z, wi.z, cos_d}, reflects[3];
		for (int k = 0; k < 3; k++)
			reflects[k] = 0.6 * (0.04 + 0.96 * pow(1 - at[k], 5));
		double expected = (1 - reflects[0]) * (1 - reflects[1]) * bare.ops->eval(&bare, &point, wo, wi).v[0] +
				  reflects[2] * layer.ops->eval(&layer, &point, wo, wi).v[0];
		double actual = coated.ops->eval(&coated, &point, wo, wi).v[0];
		assert_true(fabs(actual - expected) <= 1e-9 * expected);
	}
	arena_fini(&a);
}

/* Light that enters or leaves glass crosses the coat once, above the surface. */
static void light_through_glass_crosses_the_coat_once(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf coated, bare;
	int pass = 0;
	bsdf_make_or_fail(&a, "principled base_color=1 spec_trans=1 roughness=0.9 coat=0.6 coat_roughness=0.5",
			  &coated);
	bsdf_make_or_fail(&a, "principled base_color=1 spec_trans=1 roughness=0.9", &bare);
	for (int i = 0; i < 100; i++) {
		vec3 above = direction(0.1 + 0.8 * (i % 10) / 10, 1),
		     below = vec3_neg(direction(0.15 + 0.08 * (i / 10), 0.7));
		double passes = 1 - 0.6 * (0.04 + 0.96 * pow(1 - above.z, 5));
		for (int k = 0; k < 2; k++) {
			vec3 wo = k ? below : above, wi = k ? above : below;
			double expected = passes * bare.ops->eval(&bare, &point, wo, wi).v[0],
			       told = coated.ops->eval(&coated, &point, wo, wi).v[0];
			assert_true(fabs(told - expected) <= 1e-9 * expected);
			pass += expected > 0;
		}
	}
	assert_true(pass > 100);
	arena_fini(&a);
}

static void specular_parameter_is_an_index(void **state)
{
	(void)state;
	/* 0.08 x 0.5 at normal incidence is an index of 1.5. */
	expect_equal("principled base_color=0 specular=0.5", "principled base_color=0 eta=1.5", 0, 1);
	/* Exporters write values slightly above 1, and Mitsuba accepts any. */
	expect_equal("principled base_color=0 specular=2", "principled base_color=0 eta=2.3333333333333335", 0, 1);
}

/* A coloured reflection scales Schlick's factor at normal incidence, like that of a metal. */
static void test_specular_color(void **state)
{
	(void)state;
	expect_equal("principled base_color=0 roughness=0.4 eta=1.5 specular_color=0.5",
		     "principled base_color=0.02 roughness=0.4 metallic=1", 0, 1);
	expect_equal("principled base_color=0.7 roughness=0.4 spec_tint=1 sheen=0.4 sheen_tint=0.5",
		     "principled base_color=0.7 roughness=0.4 specular_color=1 sheen=0.4 sheen_tint=0.5", 0, 1);
	expect_equal("principled base_color=0.7 roughness=0.4 | @specular_color checkerboard color0=0.3 color1=0.3",
		     "principled base_color=0.7 roughness=0.4 specular_color=0.3", 0, 1);
}

static double eval_value(const char *text, vec3 wo, vec3 wi);

/* Returns F of KHR_materials_specular for an index of 1.6, a strength of 0.4 and a colour of 0.5. */
static double scaled_schlick(double cosine)
{
	double f0 = 0.5 * (0.6 / 2.6) * (0.6 / 2.6);
	return 0.4 * (f0 + (1 - f0) * pow(1 - cosine, 5));
}

static double unscaled_reflectance(double cosine)
{
	double t = sqrt(1 - (1 - cosine * cosine) / (1.6 * 1.6));
	double s = (cosine - 1.6 * t) / (cosine + 1.6 * t), p = (t - 1.6 * cosine) / (t + 1.6 * cosine);
	return 0.5 * (s * s + p * p);
}

/* Compares reflection and refraction by glass, on either side, with those of `roughdielectric`: reflection is
 * multiplied by F over Fresnel's factor, refraction by 1 - F over 1 minus that factor, both at the outer cosine to the
 * half vector. Reflection is total where that cosine does not exist. */
static void test_specular_strength_of_glass(void **state)
{
	(void)state;
	static const char scaled[] =
		"principled base_color=1 roughness=0.5 spec_trans=1 eta=1.6 specular_strength=0.4 specular_color=0.5",
			  glass[] = "roughdielectric alpha=0.25 distribution=ggx int_ior=1.6 ext_ior=1";
	int total = 0, passed = 0, inside = 0;
	for (int i = 0; i < 400; i++) {
		vec3 wo = direction(0.05 + 0.9 * (i % 20) / 20, 0.4),
		     wi = direction(0.05 + 0.9 * (i / 20) / 20, 0.2 + 2.7 * i);
		bool below = i % 2, refracts = i % 3 == 0;
		wo.z = below ? -wo.z : wo.z;
		wi.z = below != refracts ? -wi.z : wi.z;
		double bare = eval_value(glass, wo, wi), got = eval_value(scaled, wo, wi), cosine;
		if (refracts) {
			vec3 out = below ? wi : wo, in = below ? wo : wi,
			     h = vec3_normalize(vec3_madd(vec3_scale(1.6, in), 1, out));
			cosine = fabs(vec3_dot(out, h));
		} else {
			double c2 = (1 + vec3_dot(wo, wi)) / 2, s2 = (1 - c2) * (below ? 1.6 * 1.6 : 1);
			cosine = s2 < 1 ? sqrt(1 - s2) : -1;
		}
		double f = cosine < 0 ? 1 : scaled_schlick(cosine),
		       of_glass = cosine < 0 ? 1 : unscaled_reflectance(cosine);
		double want = bare * (refracts ? (1 - f) / (1 - of_glass) : f / of_glass);
		if (!(fabs(got - want) <= 1e-9 * want))
			fail_msg("from %g to %g: %.17g is not %.17g", wo.z, wi.z, got, want);
		total += cosine < 0 && bare > 0;
		passed += refracts && bare > 0;
		inside += below && !refracts && cosine >= 0 && bare > 0;
	}
	assert_true(total > 10 && passed > 10 && inside > 10);
}

/* Facets that reflect totally are sampled even if the boundary reflects no light otherwise, and so often that no sample
 * weighs much more than others. */
static void test_total_reflection_is_sampled(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	int seen = 0;
	bsdf_make_or_fail(&a, "principled base_color=1 roughness=0.9 spec_trans=1 eta=1.6 specular_strength=0", &b);
	for (int i = 0; i < 400; i++) {
		vec3 wo = direction(-0.81 - 0.009 * (i % 20), 0.4), wi = direction(-0.05 - 0.04 * (i / 20), 3.5);
		double f = b.ops->eval(&b, &point, wo, wi).v[0], pdf = b.ops->pdf_solid(&b, &point, wo, wi);
		assert_true(f == 0 || pdf > 0.05 * f);
		seen += f > 0;
	}
	assert_true(seen > 20);
	seen = 0;
	arena_fini(&a);
	/* Mirrored near the critical angle, whose cosine is 0.866: half of the facets or fewer reflect totally. */
	a = (struct arena){0};
	bsdf_make_or_fail(&a, "principled base_color=1 roughness=0.4 spec_trans=1 eta=2 specular_strength=0", &b);
	for (int i = 0; i < 20; i++) {
		vec3 wo = direction(-0.87 - 0.004 * i, 0.4), wi = direction(-0.83 + 0.02 * i / 20, 0.4 + PI);
		double f = b.ops->eval(&b, &point, wo, wi).v[0], pdf = b.ops->pdf_solid(&b, &point, wo, wi);
		if (f > 0 && !(pdf > 0.1 * f))
			fail_msg("at a cosine of %g: %g of %g", wo.z, pdf, f);
		seen += f > 0;
	}
	assert_true(seen > 5);
	arena_fini(&a);
}

/* Above a black base only the boundary reflects: the strength multiplies its values. */
static void test_specular_strength(void **state)
{
	(void)state;
	expect_equal("principled base_color=0 roughness=0.4 eta=1.7 specular_strength=0.3",
		     "principled base_color=0 roughness=0.4 eta=1.7", 0, 0.3);
	expect_equal("principled base_color=0.7 roughness=0.4 lambertian=true specular_strength=0",
		     "diffuse reflectance=0.7", 0, 1);
	expect_equal("principled base_color=0.7 metallic=1 specular_strength=0", "principled base_color=0.7 metallic=1",
		     0, 1);
	expect_equal("principled spec_trans=0.5 roughness=0.4 | @specular_strength checkerboard color0=0.25 color1=1",
		     "principled spec_trans=0.5 roughness=0.4 specular_strength=0.25", 1, 1);
}

/* A texture with one value is equivalent to the number, and a varying one to the number at each point. */
static void textured_metallic_equals_its_number(void **state)
{
	(void)state;
	expect_equal(
		"principled base_color=rgb(0.8,0.3,0.1) roughness=0.4 | @metallic checkerboard color0=0.7 color1=0.7",
		"principled base_color=rgb(0.8,0.3,0.1) roughness=0.4 metallic=0.7", 0, 1);
	/* each of the shares, and the roughness of the facets used with it */
	static const char *const shares[] = {
		"spec_trans",	   "spec_tint",	  "sheen", "sheen_tint",     "flatness",	 "clearcoat",
		"clearcoat_gloss", "anisotropic", "coat",  "coat_roughness", "specular_strength"};
	for (size_t i = 0; i < sizeof shares / sizeof *shares; i++) {
		static const char base[] = "base_color=rgb(0.8,0.3,0.1) roughness=0.4";
		const char *with = strcmp(shares[i], "sheen_tint") == 0	       ? "sheen=0.5"
				   : strcmp(shares[i], "clearcoat_gloss") == 0 ? "clearcoat=0.5"
				   : strcmp(shares[i], "coat_roughness") == 0  ? "coat=0.5"
									       : "";
		char map[256], number[256];
		snprintf(map, sizeof map, "principled %s %s | @%s checkerboard color0=0.25 color1=1", base, with,
			 shares[i]);
		snprintf(number, sizeof number, "principled %s %s %s=0.25", base, with, shares[i]);
		expect_equal(map, number, i == 0, 1);
	}
	expect_equal("principled spec_trans=0.5 specular=0", "principled spec_trans=0.5 specular=0.001", 1, 1);
	/* (0.3, 0.7) lies on a square of color0 where the colours are numbers */
	expect_equal(
		"principled base_color=rgb(0.8,0.3,0.1) spec_trans=0.5 | @metallic checkerboard color0=0.25 color1=1",
		"principled base_color=rgb(0.8,0.3,0.1) spec_trans=0.5 metallic=0.25", 1, 1);
}

/* A colour in the place of a number is the mean of its components, whatever the wavelengths. */
static void colour_in_place_of_a_number_is_its_mean(void **state)
{
	(void)state;
	expect_equal("principled base_color=0.7 roughness=rgb(0.2,0.3,0.7) metallic=rgb(0.6,0.5,0.4)",
		     "principled base_color=0.7 roughness=0.4 metallic=0.5", 0, 1);
	expect_equal("principled base_color=0.7 roughness=rgb(0.3,0.3,0.3)", "principled base_color=0.7 roughness=0.3",
		     0, 1);
	expect_equal("phong exponent=rgb(6,5,1)", "phong exponent=4", 0, 1);
	expect_equal("principledthin spec_trans=1 roughness=0.3 eta=rgb(1.2,1.4,1.9)",
		     "principledthin spec_trans=1 roughness=0.3 eta=1.5", 1, 1);
	expect_equal("principled base_color=0.7 | @roughness checkerboard color0=rgb(0.2,0.3,0.7) color1=0.9",
		     "principled base_color=0.7 roughness=0.4", 0, 1);
}

static double eval_value(const char *text, vec3 wo, vec3 wi)
{
	struct arena a = {0};
	struct bsdf b;
	bsdf_make_or_fail(&a, text, &b);
	double f = b.ops->eval(&b, &point, wo, wi).v[0];
	arena_fini(&a);
	return f;
}

/* The thin sheet reflects like the rough boundary, transmits like a boundary of another roughness reflects (with
 * Fresnel's transmittance), and scatters the rest diffusely to both sides; likewise from below. */
static void thin_sheet_has_reflection_transmission_and_diffusion(void **state)
{
	(void)state;
	const vec3 wo = direction(0.7, 0.3), wi = direction(0.5, 2.9), through = {wi.x, wi.y, -wi.z};
	const double narrow = 0.36 * (0.65 * 1.5 - 0.35) * (0.65 * 1.5 - 0.35); /* alpha of roughness 0.6, scaled */
	char text[160];
	double mirror = eval_value("roughconductor material=none distribution=ggx alpha=0.36", wo, wi),
	       boundary = eval_value("roughdielectric int_ior=1.5 ext_ior=1 distribution=ggx alpha=0.36", wo, wi);
	snprintf(text, sizeof text, "roughconductor material=none distribution=ggx alpha=%.17g", narrow);
	double turned = eval_value(text, wo, wi);
	double sheet = eval_value("principledthin spec_trans=1 roughness=0.6 base_color=0.8", wo, wi),
	       passed = eval_value("principledthin spec_trans=1 roughness=0.6 base_color=0.8", wo, through);
	assert_true(fabs(sheet / boundary - 1) < 1e-12);
	assert_true(fabs(passed / (0.8 * turned * (1 - boundary / mirror)) - 1) < 1e-12);
	assert_true(fabs(eval_value("principledthin diff_trans=2 base_color=0.8", wo, through) / (0.8 / PI) - 1) <
		    1e-12);
	assert_true(eval_value("principledthin diff_trans=2 base_color=0.8", wo, wi) == 0);
	double all = eval_value("principledthin spec_trans=0.3 diff_trans=0.5 roughness=0.6 base_color=0.8 sheen=0.5",
				wo, wi);
	double thick = eval_value("principled roughness=0.6 base_color=0.8 sheen=0.5 eta=1.5", wo, wi) -
		       eval_value("principled roughness=0.6 base_color=0 eta=1.5", wo, wi);
	assert_true(fabs(all / (0.3 * boundary + 0.7 * 0.75 * thick) - 1) < 1e-9);
	assert_true(fabs(eval_value("principledthin spec_trans=1 roughness=0.6 base_color=0.8", vec3_neg(wo),
				    vec3_neg(through)) /
				 passed -
			 1) < 1e-13);
}

/* Textures with the same value everywhere are equivalent to numbers. */
static void constant_textures_of_a_thin_sheet_equal_numbers(void **state)
{
	(void)state;
	expect_equal(
		"principledthin roughness=0.6 base_color=rgb(0.8,0.3,0.1) | @spec_trans checkerboard color0=0.3 color1=0.3 | "
		"@diff_trans checkerboard color0=0.9 color1=0.9",
		"principledthin roughness=0.6 base_color=rgb(0.8,0.3,0.1) spec_trans=0.3 diff_trans=0.9", 1, 1);
	/* Up to 2, like the number. */
	expect_equal("principledthin base_color=rgb(0.8,0.3,0.1) | @diff_trans checkerboard color0=1.7 color1=1.7",
		     "principledthin base_color=rgb(0.8,0.3,0.1) diff_trans=1.7", 1, 1);
	struct arena a = {0};
	struct bsdf b;
	struct error e;
	assert_int_equal(bsdf_try(&a, "principledthin | @diff_trans checkerboard color0=0.1 color1=2.1", true, &b, &e),
			 -ERANGE);
	arena_fini(&a);
}

struct principled_parameters {
	bool is_thin;
	double eta, metallic, spec_tint, anisotropic, clearcoat, clearcoat_gloss, sheen, spec_trans, flatness,
		diff_trans;
};

static double schlick_factor(double c)
{
	return pow(fmin(fmax(1 - c, 0), 1), 5);
}

static double fresnel_factor(double c, double eta)
{
	double t = sqrt(1 - (1 - c * c) / (eta * eta)), s = (c - eta * t) / (c + eta * t),
	       p = (t - eta * c) / (t + eta * c);
	return 0.5 * (s * s + p * p);
}

static double ggx_g1(vec3 v, double ax, double ay)
{
	return 2 / (1 + sqrt(1 + (ax * ax * v.x * v.x + ay * ay * v.y * v.y) / (v.z * v.z)));
}

/* Returns f times the cosine of wi for light reflected above the surface, with base_color 0.5 and roughness 0.5,
 * written out from Mitsuba 3's documentation and Burley. wo need not be a unit vector. */
static double principled_formula(const struct principled_parameters *r, vec3 wo, vec3 wi)
{
	double aspect = sqrt(1 - 0.9 * r->anisotropic), ax = 0.25 / aspect, ay = 0.25 * aspect;
	vec3 h = vec3_normalize(vec3_add(wo, wi));
	double c = vec3_dot(wo, h), cd = vec3_dot(wi, h), root = (r->eta - 1) / (r->eta + 1), f0 = root * root;
	double x = h.x / ax, y = h.y / ay, d = 1 / (PI * ax * ay * pow(x * x + y * y + h.z * h.z, 2));
	double fresnel = (1 - r->metallic) * ((1 - r->spec_tint) * fresnel_factor(c, r->eta) +
					      r->spec_tint * (f0 + (1 - f0) * schlick_factor(c))) +
			 r->metallic * (0.5 + 0.5 * schlick_factor(c));
	double facets = fresnel * d * ggx_g1(wo, ax, ay) * ggx_g1(wi, ax, ay) / (4 * wo.z);
	double fo = schlick_factor(wi.z), fi = schlick_factor(wo.z), rr = cd * cd,
	       retro = rr * (fo + fi + fo * fi * (rr - 1));
	double fss = (1 + (0.5 * rr - 1) * fo) * (1 + (0.5 * rr - 1) * fi),
	       flat = 1.25 * (fss * (1 / (wo.z + wi.z) - 0.5) + 0.5), round = (1 - 0.5 * fi) * (1 - 0.5 * fo) + retro;
	double diffuse = wi.z * 0.5 / PI * (round + r->flatness * (flat - round)),
	       sheen = r->sheen * schlick_factor(cd) * wi.z;
	if (r->is_thin)
		return r->spec_trans * facets + (1 - r->spec_trans) * (1 - 0.5 * r->diff_trans) * (diffuse + sheen);
	double a = 0.1 + (0.001 - 0.1) * r->clearcoat_gloss,
	       gtr1 = (a * a - 1) / (PI * log(a * a) * (1 + (a * a - 1) * h.z * h.z));
	double far = 0.25 * sqrt(1 - wi.z * wi.z), near = 0.25 * sqrt(fmax(1 - wo.z * wo.z, 0));
	double coat = 0.25 * r->clearcoat * (0.04 + 0.96 * schlick_factor(c)) * gtr1 *
		      ggx_g1((vec3){near, 0, wo.z}, 1, 1) * ggx_g1((vec3){far, 0, wi.z}, 1, 1) * wi.z;
	return facets + coat + (1 - r->metallic) * ((1 - r->spec_trans) * diffuse + sheen);
}

/* The formula gives the values that Mitsuba 3's tests of these plug-ins expect for wo = (1, 0, 1), which is not
 * normalised there; the plug-ins give the values of the formula. */
static void plugins_agree_with_the_whole_formula(void **state)
{
	(void)state;
	const struct {
		const char *text;
		struct principled_parameters r;
		double mitsubas[4]; /* for wi at 0, 6, 12 and 18 nineteenths of 90 degrees */
	} cases[] = {
		{"principled base_color=0.5 metallic=0.3 spec_tint=0.6 specular=0.4 anisotropic=0.3 clearcoat=0.3 "
		 "clearcoat_gloss=0.5 sheen=0.9 sheen_tint=0.9 spec_trans=0.5 flatness=0.5",
		 {.eta = 2 / (1 - sqrt(0.08 * 0.4)) - 1,
		  .metallic = 0.3,
		  .spec_tint = 0.6,
		  .anisotropic = 0.3,
		  .clearcoat = 0.3,
		  .clearcoat_gloss = 0.5,
		  .sheen = 0.9,
		  .spec_trans = 0.5,
		  .flatness = 0.5},
		 {0.06804995983839, 0.04951376467943, 0.03173548728228, 0.00609156163409}},
		{"principledthin base_color=0.5 eta=1.5 anisotropic=0.5 sheen=0.5 sheen_tint=0.2 spec_trans=0.5 flatness=0.5 "
		 "diff_trans=0.6",
		 {.is_thin = true,
		  .eta = 1.5,
		  .anisotropic = 0.5,
		  .sheen = 0.5,
		  .spec_trans = 0.5,
		  .flatness = 0.5,
		  .diff_trans = 0.6},
		 {0.04944333806634, 0.04255124926567, 0.02851359918714, 0.00521619664505}},
	};
	for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, cases[k].text, &b);
		for (int i = 0; i < 4; i++) {
			double t = 6 * i * PI / 38,
			       got = principled_formula(&cases[k].r, (vec3){1, 0, 1}, (vec3){sin(t), 0, cos(t)});
			assert_true(fabs(got / cases[k].mitsubas[i] - 1) < 1e-5);
		}
		for (int i = 0; i < 400; i++) {
			vec3 wo = direction(0.05 + 0.9 * (i % 20) / 20, 0.4),
			     wi = direction(0.05 + 0.9 * (i / 20) / 20, 0.3 * i);
			double got = b.ops->eval(&b, &point, wo, wi).v[0] * wi.z,
			       want = principled_formula(&cases[k].r, wo, wi);
			if (fabs(got - want) > 1e-9 * want)
				fail_msg("%s: %.12g is not %.12g", cases[k].text, got, want);
		}
		arena_fini(&a);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_glass_is_roughdielectric),
		cmocka_unit_test(test_metal_is_schlick_over_ggx),
		cmocka_unit_test(diffuse_lobes_follow_their_formulas),
		cmocka_unit_test(clearcoat_is_a_normalised_distribution),
		cmocka_unit_test(plugins_agree_with_the_whole_formula),
		cmocka_unit_test(test_specular_color),
		cmocka_unit_test(test_specular_strength),
		cmocka_unit_test(test_total_reflection_is_sampled),
		cmocka_unit_test(test_specular_strength_of_glass),
		cmocka_unit_test(clearcoat_adds_ggx_and_dims_the_metal),
		cmocka_unit_test(light_through_glass_crosses_the_coat_once),
		cmocka_unit_test(specular_parameter_is_an_index),
		cmocka_unit_test(textured_metallic_equals_its_number),
		cmocka_unit_test(colour_in_place_of_a_number_is_its_mean),
		cmocka_unit_test(thin_sheet_has_reflection_transmission_and_diffusion),
		cmocka_unit_test(constant_textures_of_a_thin_sheet_equal_numbers),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
