/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The diffuse base that stands in for a dipole. The reflectance of a flat medium is compared with the integral of the
 * dipole's profile over the surface, and that of the plastic with the sum over all reflections below its boundary.
 */
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"
#include "worker/render/scene/node.h"
#include "worker/render/scene/subsurface.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* Returns Fresnel's reflectance from inside, integrated over directions. */
static double diffuse_fresnel(double eta)
{
	enum { N = 20000 };
	double sum = 0;
	for (int i = 0; i < N; i++) {
		double sine2 = (i + 0.5) / N, out2 = 1 - sine2 * eta * eta, in = sqrt(1 - sine2);
		double out = out2 > 0 ? sqrt(out2) : 0, s = (eta * in - out) / (eta * in + out),
		       p = (in - eta * out) / (in + eta * out);
		sum += out2 > 0 ? (s * s + p * p) / 2 : 1;
	}
	return sum / N;
}

/* Returns the integral of Jensen et al. 2001, equation 4, over the plane, for an extinction of 1. */
static double integrated_dipole(double albedo, double inside)
{
	enum { N = 200000 };
	double real = 1, mirrored = 1 + 4.0 / 3 * (1 + inside) / (1 - inside), k = sqrt(3 * (1 - albedo)), sum = 0;
	for (int i = 0; i < N; i++) {
		double u = (i + 0.5) / N, r = u / (1 - u), dr = hypot(r, real), dv = hypot(r, mirrored);
		double profile = real * (k * dr + 1) * exp(-k * dr) / (dr * dr * dr) +
				 mirrored * (k * dv + 1) * exp(-k * dv) / (dv * dv * dv);
		sum += albedo / 2 * r * profile / ((1 - u) * (1 - u)) / N;
	}
	return sum;
}

static void test_reflectance_matches_the_integrated_dipole(void **state)
{
	(void)state;
	static const double albedos[] = {0.1, 0.5, 0.9, 0.99, 0.999}, etas[] = {1.1, 1.33, 1.5046};
	for (size_t k = 0; k < sizeof etas / sizeof *etas; k++) {
		/* base = r / (1 - inside + r inside) */
		double inside = (1 - 0.5 / subsurface_base_reflectance(0.5, etas[k])) / 0.5;
		assert_true(fabs(inside / diffuse_fresnel(etas[k]) - 1) < 0.05);
		for (size_t i = 0; i < sizeof albedos / sizeof *albedos; i++) {
			double there = integrated_dipole(albedos[i], inside),
			       here = subsurface_reflectance(albedos[i], etas[k]);
			if (!(fabs(here / there - 1) < 1e-4))
				fail_msg("albedo %g, eta %g: %g, integrated %g", albedos[i], etas[k], here, there);
		}
	}
	assert_true(subsurface_reflectance(0, 1.5) == 0 && subsurface_reflectance(1, 1.5) == 1);
}

static void test_base_colour_reproduces_the_albedo(void **state)
{
	(void)state;
	for (double r = 0.05; r < 1; r += 0.1) {
		double base = subsurface_base_reflectance(r, 1.5),
		       inside = (1 - 0.5 / subsurface_base_reflectance(0.5, 1.5)) / 0.5, light = base, out = 0;
		for (int i = 0; i < 1000; i++, light *= inside * base)
			out += (1 - inside) * light;
		assert_true(fabs(out / r - 1) < 1e-9);
	}
	assert_true(subsurface_base_reflectance(0, 1.5) == 0 && fabs(subsurface_base_reflectance(1, 1.5) - 1) < 1e-15);
}

static struct scene read_leniently(const char *xml)
{
	const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {0}};
	struct asset_source assets = memory_assets(files);
	struct scene s;
	struct error e;
	if (scene_read_lenient(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
		fail_msg("%s", e.text);
	return s;
}

/* Returns the colour of the BSDF of the i-th object. */
static const double *base_colour(const struct scene *s, unsigned i)
{
	const struct property *p = node_find_property(node_child(s->objects[i], PLUGIN_BSDF, 0), "diffuse_reflectance");
	assert_non_null(p);
	return p->value.as.rgb;
}

static void assert_base_colour(const double *rgb, int k, double albedo, double eta)
{
	double want = subsurface_base_reflectance(subsurface_reflectance(albedo, eta), eta);
	if (!(fabs(rgb[k] / want - 1) < 1e-12))
		fail_msg("%d: %g, not %g", k, rgb[k], want);
}

/* clang-format off */
#define SPHERE(inside) \
	"<shape type='sphere'><bsdf type='plastic'><float name='intIOR' value='1.4'/></bsdf>" inside "</shape>"

static const char scene_xml[] =
	"<scene version='0.6.0'><bsdf type='roughplastic' id='skin'><spectrum name='diffuseReflectance' value='0'/>"
	"<float name='alpha' value='0.3'/></bsdf>"
	"<shape type='sphere'><ref id='skin'/><subsurface type='dipole'><string name='material' value='skimmilk'/>"
	"<float name='scale' value='.002'/></subsurface></shape>" /* 1 */
	SPHERE("<subsurface type='dipole'><rgb name='sigmaS' value='9, 3, 1'/><rgb name='sigmaA' value='1'/>"
	       "<float name='intIOR' value='1.3'/><float name='extIOR' value='1'/></subsurface>") /* 2 */
	SPHERE("<subsurface type='dipole'><spectrum name='sigmaT' value='10'/><spectrum name='albedo' value='0.9'/>"
	       "<float name='g' value='0.5'/></subsurface>") /* 3 */
	SPHERE("<subsurface type='dipole'/>")	     /* 4 */
	SPHERE("<subsurface type='dipole'><rgb name='sigmaS' value='1'/></subsurface>") /* 5 */
	"<shape type='sphere'><bsdf type='diffuse'/><subsurface type='dipole'/></shape>"
	"<shape type='sphere'><ref id='skin'/></shape>" /* 7 */
	SPHERE("<subsurface type='dipole'><rgb name='sigmaS' value='1'/><rgb name='sigmaT' value='2'/></subsurface>")
	"<emitter type='constant'/></scene>";
/* clang-format on */

static void test_subsurface_scenes_get_base_colours(void **state)
{
	(void)state;
	struct scene s = read_leniently(scene_xml);
	const double eta = 1.5046 / 1.000277;
	assert_base_colour(base_colour(&s, 1), 0, 0.70 / 0.7014, eta); /* skim milk: Jensen et al. 2001, figure 5 */
	assert_base_colour(base_colour(&s, 1), 2, 1.90 / 1.9142, eta);
	assert_true(node_float(node_child(s.objects[1], PLUGIN_BSDF, 0), "alpha", 0) == 0.3);
	for (int k = 0; k < 3; k++)
		assert_base_colour(base_colour(&s, 2), k, (const double[]){0.9, 0.75, 0.5}[k], 1.3);
	assert_base_colour(base_colour(&s, 3), 1, 4.5 / 5.5, eta);
	assert_base_colour(base_colour(&s, 4), 0, 0.74 / 0.772, eta); /* skin1 */
	/* The coefficients are incomplete, or the BSDF has no base: no stand-in. Other shapes that refer to the same
	 * BSDF keep it unchanged. */
	assert_null(node_find_property(node_child(s.objects[5], PLUGIN_BSDF, 0), "diffuse_reflectance"));
	assert_null(node_find_property(node_child(s.objects[8], PLUGIN_BSDF, 0), "diffuse_reflectance"));
	assert_string_equal(node_child(s.objects[6], PLUGIN_BSDF, 0)->type, "diffuse");
	assert_true(node_float(node_child(s.objects[7], PLUGIN_BSDF, 0), "diffuse_reflectance", 1) == 0);
	unsigned said = 0;
	for (uint32_t i = 0; i < s.note_count; i++)
		said += strstr(s.notes[i], "a diffuse base of the same reflectance stands in") != NULL;
	assert_int_equal(said, 1);
	scene_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_reflectance_matches_the_integrated_dipole),
		cmocka_unit_test(test_base_colour_reproduces_the_albedo),
		cmocka_unit_test(test_subsurface_scenes_get_base_colours),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
