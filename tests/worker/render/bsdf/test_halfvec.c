/* SPDX-License-Identifier: Apache-2.0 */
/*
 * eval_halfvec is compared with the product of f, cosine and Jacobian (which bsdf.c computes for BSDFs without an
 * eval_halfvec of their own); that Jacobian with finite differences of the map from half vectors to directions; and
 * microfacets with the same product computed here, in long double and in textbook form. Deterministic. Where formulas
 * are ill-conditioned, the bound is in units of the effect of rounding directions and index to double.
 */
#include "tests/support/dice.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"

#include <float.h>

#define PI 3.14159265358979323846L

static const struct wavelengths wavelengths = {.nm = {550, 500, 600, 700}};
static const struct bsdf_point point = {
	.texture_point = {.u = 0.3, .v = 0.7}, .wavelengths = &wavelengths, .transport = TRANSPORT_IMPORTANCE};

typedef struct {
	long double x, y, z;
} wide;

static wide vec3_to_wide(vec3 v)
{
	wide w = {v.x, v.y, v.z};
	long double l = sqrtl(w.x * w.x + w.y * w.y + w.z * w.z);
	return (wide){w.x / l, w.y / l, w.z / l};
}

static vec3 wide_to_vec3(wide w)
{
	return (vec3){(double)w.x, (double)w.y, (double)w.z};
}

static long double dot(wide a, wide b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

static wide cross(wide a, wide b)
{
	return (wide){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static wide slope_normal(long double x, long double y)
{
	long double l = sqrtl(1 + x * x + y * y);
	return (wide){x / l, y / l, 1 / l};
}

/* Finds wi for half vector h with wo held fixed; eta: index beyond over index on wo's side. Returns false if there is
 * none. */
static bool direction_of_halfvec(wide wo, wide h, bool reflect, long double eta, wide *wi)
{
	long double c = dot(wo, h);
	if (c < 0) {
		h = (wide){-h.x, -h.y, -h.z};
		c = -c;
	}
	long double k = 2 * c, scale = -1;
	if (!reflect) {
		long double t2 = 1 - (1 - c * c) / (eta * eta);
		if (!(t2 > 0))
			return false;
		k = c / eta - sqrtl(t2);
		scale = -1 / eta;
	}
	*wi = (wide){scale * wo.x + k * h.x, scale * wo.y + k * h.y, scale * wo.z + k * h.z};
	return reflect ? wi->z * wo.z > 0 : wi->z * wo.z < 0;
}

static spectrum eval_one(const struct bsdf *b, const struct bsdf_point *p, vec3 wo, vec3 wi)
{
	(void)b, (void)wo, (void)wi;
	assert_int_equal(p->transport, TRANSPORT_RADIANCE);
	return spectrum_constant(1);
}

/* Central differences of the slope: together, truncation and rounding of long double (next to eta = 1) are below
 * 1e-5. */
static void test_the_jacobian_is_the_derivative(void **state)
{
	(void)state;
	static const double indices[] = {1.5, 1 / 1.5, 2.4, 1.01, 1 + 1e-3, 1 - 1e-3, 1 + 1e-6, 1 - 1e-6};
	static const struct bsdf_ops ops = {.decl.type = "one", .eval = eval_one};
	struct dice d = dice_for_test(__func__);
	double worst = 0;
	size_t checked_count[2] = {0, 0};
	for (int i = 0; i < 40000; i++) {
		struct bsdf b = {.ops = &ops, .eta = indices[i % 8]};
		bool reflect = i & 8;
		wide wo = vec3_to_wide(dice_direction(&d)), wi, side[4];
		long double eta = wo.z > 0 ? (long double)b.eta : 1 / (long double)b.eta,
			    wideness = powl(10, dice_between(&d, -3, 1));
		long double x = wideness * dice_between(&d, -1, 1), y = wideness * dice_between(&d, -1, 1),
			    step = 1e-6L;
		wide h = slope_normal(x, y);
		if (!direction_of_halfvec(wo, h, reflect, eta, &wi) || fabsl(dot(wi, h)) < 0.05L ||
		    fabsl(dot(wo, h)) < 0.05L || fabsl(wi.z) < 1e-2L)
			continue;
		bool ok = direction_of_halfvec(wo, slope_normal(x + step, y), reflect, eta, &side[0]) &&
			  direction_of_halfvec(wo, slope_normal(x - step, y), reflect, eta, &side[1]) &&
			  direction_of_halfvec(wo, slope_normal(x, y + step), reflect, eta, &side[2]) &&
			  direction_of_halfvec(wo, slope_normal(x, y - step), reflect, eta, &side[3]);
		if (!ok)
			continue;
		wide dx = {side[0].x - side[1].x, side[0].y - side[1].y, side[0].z - side[1].z};
		wide dy = {side[2].x - side[3].x, side[2].y - side[3].y, side[2].z - side[3].z}, n = cross(dx, dy);
		double solid = (double)(sqrtl(dot(n, n)) / (4 * step * step));
		double actual =
			bsdf_eval_halfvec(&b, &point, wide_to_vec3(wo), wide_to_vec3(wi)).v[1] / fabs((double)wi.z);
		worst = fmax(worst, fabs(actual / solid - 1));
		checked_count[reflect]++;
	}
	print_message("%zu reflections, %zu refractions: largest relative difference %.1e\n", checked_count[1],
		      checked_count[0], worst);
	assert_true(checked_count[0] > 3000 && checked_count[1] > 3000 && worst < 1e-5);
}

/* Between equal indices the half vector is (wo + wi)_xy: the same differences. */
static void test_the_jacobian_between_equal_indices(void **state)
{
	(void)state;
	static const struct bsdf_ops ops = {.decl.type = "one", .eval = eval_one};
	const struct bsdf b = {.ops = &ops, .eta = 1};
	struct dice d = dice_for_test(__func__);
	size_t checked_count = 0;
	for (int i = 0; i < 2000; i++) {
		wide wo = vec3_to_wide(dice_direction(&d)), wi = vec3_to_wide(dice_direction(&d)), side[4];
		long double step = 1e-6L;
		if (wo.z * wi.z > 0)
			wi.z = -wi.z;
		if (fabsl(wi.z) < 0.05L)
			continue;
		for (int k = 0; k < 4; k++) {
			long double x = wi.x + (k == 0	 ? step
						: k == 1 ? -step
							 : 0),
				    y = wi.y + (k == 2	 ? step
						: k == 3 ? -step
							 : 0);
			side[k] = (wide){x, y, copysignl(sqrtl(1 - x * x - y * y), wi.z)};
		}
		wide dx = {side[0].x - side[1].x, side[0].y - side[1].y, side[0].z - side[1].z};
		wide dy = {side[2].x - side[3].x, side[2].y - side[3].y, side[2].z - side[3].z}, n = cross(dx, dy);
		double solid = (double)(sqrtl(dot(n, n)) / (4 * step * step));
		double actual =
			bsdf_eval_halfvec(&b, &point, wide_to_vec3(wo), wide_to_vec3(wi)).v[1] / fabs((double)wi.z);
		assert_true(fabs(actual / solid - 1) < 1e-5);
		checked_count++;
	}
	assert_true(checked_count > 1500);
}

/* For BSDFs that cancel factors themselves, the product with the outer cosine is used instead. */
static double product(const struct bsdf *b, vec3 wo, vec3 wi, int lane)
{
	struct bsdf_ops ops = *b->ops;
	struct bsdf plain = *b;
	ops.eval_halfvec = NULL;
	plain.ops = &ops;
	return bsdf_eval_halfvec(&plain, &point, wo, wi).v[lane];
}

static void test_every_bsdf_against_its_product(void **state)
{
	(void)state;
	double worst = 0;
	size_t positive = 0;
	for (int k = 0; k < BSDF_CASES; k++) {
		struct dice d = dice_for_test(bsdf_cases[k]);
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, bsdf_cases[k], &b);
		for (int i = 0; i < 3000; i++) {
			struct bsdf_sample s;
			vec3 wo = dice_direction(&d), wi = dice_direction(&d);
			double u[3] = {dice_uniform(&d), dice_uniform(&d), dice_uniform(&d)};
			if (i % 2 && b.ops->sample(&b, &point, wo, u, &s))
				wi = s.wi;
			spectrum x = bsdf_eval_halfvec(&b, &point, wo, wi);
			for (int l = 0; l < SPECTRUM_LANES; l++) {
				double expected = product(&b, wo, wi, l), off = fabs(x.v[l] - expected);
				worst = fmax(worst, expected > 0 ? off / expected : off);
			}
			positive += x.v[0] > 0;
		}
		arena_fini(&a);
	}
	print_message("%zu pairs, largest relative difference %.1e\n", positive, worst);
	assert_true(positive > BSDF_CASES * 500 && worst < 1e-11);
}

/* One configuration of the microfacet test. */
struct microfacet_case {
	bool is_ggx, is_metal;
	double alpha, eta; /* eta: index below over index above */
	double anisotropy; /* roughness along v over that along u */
};

static long double g1(const struct microfacet_case *s, wide v)
{
	long double along_v = v.y * (long double)s->anisotropy, tan2 = (v.x * v.x + along_v * along_v) / (v.z * v.z),
		    at = s->alpha * sqrtl(tan2);
	if (s->is_ggx)
		return 2 / (1 + sqrtl(1 + at * at));
	if (!(at > 0))
		return 1;
	return 2 / (1 + erfl(1 / at) + at * expl(-1 / (at * at)) / sqrtl(PI));
}

static long double distribution(const struct microfacet_case *s, wide h)
{
	long double a2 = (long double)s->alpha * s->alpha, c2 = h.z * h.z, along_v = h.y / (long double)s->anisotropy;
	long double slope2 = (h.x * h.x + along_v * along_v) / c2 / a2;
	long double p22 = s->is_ggx ? 1 / (1 + slope2) / (1 + slope2) : expl(-slope2);
	return p22 / (PI * a2 * (long double)s->anisotropy * c2 * c2);
}

/* Returns Walter's f times cosine times the Jacobian, term by term; 0 if there is no facet. */
static long double textbook_value(const struct microfacet_case *s, wide wo, wide wi)
{
	bool reflect = wo.z * wi.z > 0;
	long double eta = wo.z > 0 ? (long double)s->eta : 1 / (long double)s->eta, eta_h = reflect ? 1 : eta;
	wide un = {wo.x + eta_h * wi.x, wo.y + eta_h * wi.y, wo.z + eta_h * wi.z};
	long double l = sqrtl(dot(un, un)), sign = un.z * wo.z > 0 ? 1 : -1;
	wide h = {sign * un.x / l, sign * un.y / l, sign * un.z / l};
	long double co = dot(wo, h), ci = dot(wi, h);
	if (!(l > 0) || co <= 0 || (reflect ? ci <= 0 : ci >= 0))
		return 0;
	long double t = reflect ? sqrtl(fmaxl(0, 1 - (1 - co * co) / (eta * eta))) : -ci;
	long double rs = (co - eta * t) / (co + eta * t), rp = (eta * co - t) / (eta * co + t),
		    f = (rs * rs + rp * rp) / 2;
	if (s->is_metal)
		f = 1;
	long double common = distribution(s, h) * g1(s, wo) * g1(s, wi) / fabsl(wo.z * wi.z);
	long double outer = fabsl(wi.z) * fabsl(h.z * h.z * h.z), root = co + eta * ci;
	if (reflect)
		return common * f / 4 * outer * 4 * ci;
	/* Walter's eq. 21 for importance, over eta^2 for radiance; 1 - F is computed from both cosines. */
	long double transmitted =
		2 * co * eta * t * (1 / ((co + eta * t) * (co + eta * t)) + 1 / ((eta * co + t) * (eta * co + t)));
	long double btdf = common * transmitted * co * -ci * eta * eta / (root * root) / (eta * eta);
	return btdf * outer * root * root / (eta * eta * -ci);
}

/* Returns the change of the value if each coordinate, both lengths and the index change by half a unit in the last
 * place. The index counts because the inverse of an index next to 1 is itself rounded. */
static long double rounding_error(const struct microfacet_case *s, wide wo, wide wi)
{
	long double here = textbook_value(s, wo, wi), sum = 0;
	for (int i = 0; i < 12; i++) {
		wide o = wo, in = wi;
		long double *coordinate[6] = {&o.x, &o.y, &o.z, &in.x, &in.y, &in.z}, *x = coordinate[i / 2];
		*x *= i % 2 ? 1 + 0x1p-53L : 1 - 0x1p-53L;
		sum += fabsl(textbook_value(s, o, in) - here);
	}
	struct microfacet_case up = *s, down = *s;
	up.eta *= 1 + 0x1p-52;
	down.eta *= 1 - 0x1p-53;
	return sum + fabsl(textbook_value(&up, wo, wi) - here) + fabsl(textbook_value(&down, wo, wi) - here);
}

/* Chooses a pair of directions near corner cases: grazing wo, steep half vectors, close to total reflection. */
static bool draw_corner_case(struct dice *d, const struct microfacet_case *s, vec3 *from, vec3 *to)
{
	wide wo = vec3_to_wide(dice_direction(d)), wi;
	uint32_t kind = dice_below(d, 5);
	bool reflect = s->is_metal || dice_uniform(d) < 0.3;
	if (s->is_metal)
		wo.z = fabsl(wo.z);
	long double eta = wo.z > 0 ? (long double)s->eta : 1 / (long double)s->eta;
	if (kind == 1) {
		wo.z *= powl(10, -dice_between(d, 1, 9));
		wo = vec3_to_wide(wide_to_vec3(wo));
	}
	double phi = dice_between(d, 0, 6.3), slope = s->alpha * dice_between(d, 0, 4);
	if (kind == 2)
		slope = pow(10, dice_between(d, 0, 5));
	wide h = slope_normal(slope * cos(phi), slope * sin(phi));
	if (kind == 3 && eta < 1) {
		/* Facets that wo meets just inside the critical angle, wherever these facets are. */
		long double c = sqrtl(1 - eta * eta) * (1 + powl(10, -dice_between(d, 1, 12)));
		wide x = vec3_to_wide(dice_direction(d));
		long double along = dot(x, wo), l = sqrtl(1 - along * along), r = sqrtl(1 - c * c);
		h = (wide){c * wo.x + r * (x.x - along * wo.x) / l, c * wo.y + r * (x.y - along * wo.y) / l,
			   c * wo.z + r * (x.z - along * wo.z) / l};
	}
	*from = wide_to_vec3(wo);
	wo = vec3_to_wide(*from);
	if (!direction_of_halfvec(wo, h, reflect, eta, &wi))
		return false;
	*to = wide_to_vec3(wi);
	return true;
}

struct error_bounds {
	/* Largest error: relative, of well-conditioned pairs; in units of max_scaled_error + rounding, of all. */
	double max_calm_error, max_scaled_error;
	size_t calm_count, count;
};

static void check_microfacet_case(const struct microfacet_case *s, struct dice *d, struct error_bounds *out)
{
	char text[192], alpha[64];
	snprintf(alpha, sizeof alpha, "alpha_u=%.17g alpha_v=%.17g", s->alpha, s->alpha * s->anisotropy);
	const char *name = s->is_ggx ? "ggx" : "beckmann";
	if (s->is_metal)
		snprintf(text, sizeof text, "roughconductor material=none %s distribution=%s", alpha, name);
	else
		snprintf(text, sizeof text, "roughdielectric int_ior=%.17g ext_ior=1 %s distribution=%s", s->eta, alpha,
			 name);
	struct arena a = {0};
	struct bsdf b;
	bsdf_make_or_fail(&a, text, &b);
	for (int i = 0; i < 1500; i++) {
		vec3 wo, wi;
		if (!draw_corner_case(d, s, &wo, &wi))
			continue;
		long double expected = textbook_value(s, vec3_to_wide(wo), vec3_to_wide(wi));
		double actual = bsdf_eval_halfvec(&b, &point, wo, wi).v[3];
		assert_true(isfinite(actual) && actual >= 0);
		if (expected < 1e-280L)
			continue;
		long double noise = rounding_error(s, vec3_to_wide(wo), vec3_to_wide(wi)),
			    off = fabsl(actual - expected);
		out->max_scaled_error = fmax(out->max_scaled_error, (double)(off / (noise + 0x1p-49L * expected)));
		out->count++;
		if (noise < 1e-13L * expected) {
			out->max_calm_error = fmax(out->max_calm_error, (double)(off / expected));
			out->calm_count++;
		}
		if (off > 4 * (noise + 0x1p-49L * expected))
			fail_msg("%s: from (%g,%g,%g) to (%g,%g,%g): %.17g is not %.17Lg +- %.2Lg", text, wo.x, wo.y,
				 wo.z, wi.x, wi.y, wi.z, actual, expected, noise);
	}
	arena_fini(&a);
}

static void test_microfacets_against_the_textbook(void **state)
{
	(void)state;
	static const double alphas[] = {1e-6, 1e-4, 1e-2, 0.1, 0.5, 1};
	static const double ratios[] = {1, 0.125, 4};
	static const double indices[] = {1.5, 1 / 1.5, 2.4, 1.01, 0.99, 1 + 1e-3, 1 - 1e-3, 1 + 1e-6, 1 - 1e-6};
	struct dice d = dice_for_test(__func__);
	struct error_bounds e = {0};
	for (size_t i = 0; i < sizeof alphas / sizeof *alphas; i++)
		for (int ggx = 0; ggx < 2; ggx++) {
			double ratio = alphas[i] < 1e-4 ? 1 : ratios[(i + (size_t)ggx) % 3]; /* powers of two: exact */
			struct microfacet_case metal = {ggx, true, alphas[i], 1, ratio};
			check_microfacet_case(&metal, &d, &e);
			for (size_t k = 0; k < sizeof indices / sizeof *indices; k++) {
				struct microfacet_case glass = {ggx, false, alphas[i], indices[k], ratio};
				check_microfacet_case(&glass, &d, &e);
			}
		}
	print_message(
		"%zu pairs: error at most %.2f of what rounding directions and index does; %zu well-conditioned: %.1e relative\n",
		e.count, e.max_scaled_error, e.calm_count, e.max_calm_error);
	assert_true(e.count > 50000 && e.calm_count > 10000 && e.max_calm_error < 1e-12);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_the_jacobian_is_the_derivative),
		cmocka_unit_test(test_the_jacobian_between_equal_indices),
		cmocka_unit_test(test_every_bsdf_against_its_product),
		cmocka_unit_test(test_microfacets_against_the_textbook),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
