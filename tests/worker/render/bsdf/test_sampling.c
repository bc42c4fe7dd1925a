/* SPDX-License-Identifier: Apache-2.0 */
/*
 * sample() is compared with pdf_solid(), by a chi-square test over the sphere for every BSDF, from 16 directions each.
 *
 * Level: 1e-7 per test, about 350 tests, so below 1e-4 for all. Power: a separate test shows that a roughness wrong by
 * 10 % is found with certainty. Seeds: the name of the test.
 */
#include "tests/support/test_length.h"
#include "tests/support/stats.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/math/rng.h"

#define PI 3.14159265358979323846
#define LEVEL 1e-7

enum { DIRECTIONS = 16, SAMPLES = 20000, POLAR = 24, AZIMUTH = 16, CELLS = 2 * POLAR * AZIMUTH };

static const struct wavelengths wavelengths = {.nm = {400, 500, 600, 700}};
static const struct bsdf_point point = {
	.texture_point = {.u = 0.3, .v = 0.7}, .wavelengths = &wavelengths, .transport = TRANSPORT_RADIANCE};

/* Directions from the normal to 1 degree above the plane; half of them from below if light can arrive from there. */
static vec3 direction(int i, bool two_sided)
{
	static const double z[] = {1, 0.999, 0.95, 0.8, 0.6, 0.4, 0.2, 0.02};
	double c = z[i % 8], s = sqrt((1 - c) * (1 + c)), phi = 0.7 + 2.4 * i;
	return (vec3){s * cos(phi), s * sin(phi), two_sided && i >= 8 ? -c : c};
}

/*
 * Each side of the surface is a disc (by the equal-area map: solid angle = 2 x area), cut into cells by polar
 * coordinates around the direction of the reflected or of the refracted ray: radius = rho^2 x the distance to the rim,
 * so that cells are small where lobes are narrow and no cell crosses the horizon.
 */
struct chart {
	double center[2][2]; /* on wo's side, on the other side */
	double side;	     /* sign of wo.z */
};

static struct chart chart_of(const struct bsdf *b, vec3 wo)
{
	struct chart c = {.side = wo.z > 0 ? 1 : -1};
	double below = bsdf_eta(b, &wavelengths), eta = wo.z > 0 ? below : 1 / below,
	       s = sqrt(wo.x * wo.x + wo.y * wo.y);
	for (int other = 0; other < 2; other++) {
		double sine = fmin(other ? s / eta : s, 1), radius = sqrt(1 - sqrt(1 - sine * sine));
		c.center[other][0] = s > 0 ? -wo.x / s * radius : 0;
		c.center[other][1] = s > 0 ? -wo.y / s * radius : 0;
	}
	return c;
}

static double to_rim(const double center[2], double phi)
{
	double along = center[0] * cos(phi) + center[1] * sin(phi);
	return -along + sqrt(fmax(0, along * along + 1 - center[0] * center[0] - center[1] * center[1]));
}

static int cell_of(const struct chart *c, vec3 wi)
{
	int other = wi.z * c->side < 0;
	double scale = 1 / sqrt(1 + fabs(wi.z)), x = wi.x * scale - c->center[other][0],
	       y = wi.y * scale - c->center[other][1];
	double phi = atan2(y, x), rho = sqrt(hypot(x, y) / to_rim(c->center[other], phi));
	int polar = (int)(POLAR * rho), azimuth = (int)(AZIMUTH * (phi / (2 * PI) + 0.5));
	polar = polar >= POLAR ? POLAR - 1 : polar;
	azimuth = azimuth >= AZIMUTH ? AZIMUTH - 1 : azimuth;
	return (other * POLAR + polar) * AZIMUTH + azimuth;
}

struct integrand {
	const struct bsdf *b;
	const struct chart *chart;
	vec3 wo;
	int other;
};

static double density(const struct integrand *f, double rho, double phi)
{
	const double *center = f->chart->center[f->other];
	double rim = to_rim(center, phi), r = rho * rho * rim;
	double x = center[0] + r * cos(phi), y = center[1] + r * sin(phi), q = fmin(x * x + y * y, 1);
	double scale = sqrt(2 - q), z = (f->other ? -1 : 1) * f->chart->side * (1 - q);
	double p = f->b->ops->pdf_solid(f->b, &point, f->wo, vec3_normalize((vec3){x * scale, y * scale, z}));
	return p * 2 * r * 2 * rho * rim;
}

static double gauss9(const struct integrand *f, double r0, double r1, double p0, double p1)
{
	static const double x[3] = {-0.7745966692414834, 0, 0.7745966692414834}, w[3] = {5. / 18, 8. / 18, 5. / 18};
	double sum = 0;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			sum += w[i] * w[j] *
			       density(f, (r0 + r1 + x[i] * (r1 - r0)) / 2, (p0 + p1 + x[j] * (p1 - p0)) / 2);
	return sum * (r1 - r0) * (p1 - p0);
}

static double integrate_adaptively(const struct integrand *f, double r0, double r1, double p0, double p1, double whole,
				   int depth)
{
	double r = (r0 + r1) / 2, p = (p0 + p1) / 2;
	double q[4] = {gauss9(f, r0, r, p0, p), gauss9(f, r, r1, p0, p), gauss9(f, r0, r, p, p1),
		       gauss9(f, r, r1, p, p1)};
	double sum = q[0] + q[1] + q[2] + q[3];
	if (depth == 0 || fabs(sum - whole) < 1e-6)
		return sum;
	return integrate_adaptively(f, r0, r, p0, p, q[0], depth - 1) +
	       integrate_adaptively(f, r, r1, p0, p, q[1], depth - 1) +
	       integrate_adaptively(f, r0, r, p, p1, q[2], depth - 1) +
	       integrate_adaptively(f, r, r1, p, p1, q[3], depth - 1);
}

/* Computes the integral of the density over each cell; returns the sum. */
static double integrate(const struct bsdf *b, const struct chart *c, vec3 wo, double *cells)
{
	double total = 0;
	for (int cell = 0; cell < CELLS; cell++) {
		int polar = cell / AZIMUTH % POLAR, azimuth = cell % AZIMUTH;
		struct integrand f = {b, c, wo, cell / (AZIMUTH * POLAR)};
		double r0 = (double)polar / POLAR, r1 = (polar + 1.0) / POLAR;
		double p0 = 2 * PI * ((double)azimuth / AZIMUTH - 0.5), p1 = p0 + 2 * PI / AZIMUTH;
		cells[cell] = integrate_adaptively(&f, r0, r1, p0, p1, gauss9(&f, r0, r1, p0, p1), 8);
		total += cells[cell];
	}
	return total;
}

static bool close_to(double a, double b)
{
	return fabs(a - b) <= 1e-12 * fabs(b);
}

static void check_sample(const struct bsdf *b, vec3 wo, const struct bsdf_sample *s)
{
	assert_true(fabs(vec3_length(s->wi) - 1) < 1e-12);
	assert_int_equal(s->mode & ~b->modes, 0);
	assert_true(s->mode & (s->wi.z * wo.z > 0 ? BSDF_REFLECT : BSDF_TRANSMIT));
	bool bent = s->wi.z * wo.z < 0 && !(s->mode & BSDF_STRAIGHT);
	double below = bsdf_eta(b, &wavelengths), eta = !bent ? 1 : wo.z > 0 ? below : 1 / below;
	assert_true(close_to(s->eta, eta));
	assert_true(spectrum_is_valid(s->f));
	if (s->mode & BSDF_DELTA) {
		assert_true(b->has_delta && s->pdf > 0 && s->pdf <= 1);
		return;
	}
	assert_true(b->has_smooth);
	assert_true(close_to(s->pdf, b->ops->pdf_solid(b, &point, wo, s->wi)));
	spectrum f = b->ops->eval(b, &point, wo, s->wi);
	for (int i = 0; i < SPECTRUM_LANES; i++)
		assert_true(close_to(s->f.v[i], f.v[i]));
}

/* Returns the p-value of the samples of b for the density of `model`, which is the same BSDF except in the test of the
 * test. */
static double chi_square(const struct bsdf *b, const struct bsdf *model, vec3 wo, uint64_t seed, double *integral)
{
	static uint64_t observed[CELLS + 1];
	static double expected[CELLS + 1];
	memset(observed, 0, sizeof observed);
	memset(expected, 0, sizeof expected);
	struct chart c = chart_of(b, wo);
	*integral = integrate(model, &c, wo, expected);
	for (int i = 0; i < CELLS; i++)
		expected[i] *= SAMPLES;
	expected[CELLS] = fmax(0, 1 - *integral) * SAMPLES;
	for (uint64_t i = 0; i < SAMPLES; i++) {
		double u[4];
		struct bsdf_sample s;
		rng_uniform4(seed, RNG_TEST, i, 0, 0, u);
		if (!b->ops->sample(b, &point, wo, u, &s)) {
			observed[CELLS]++;
			continue;
		}
		check_sample(b, wo, &s);
		observed[s.mode & BSDF_DELTA ? CELLS : cell_of(&c, s.wi)]++;
	}
	/* The quadrature misses far tails: a cell with a count never has an expectation of 0. */
	for (int i = 0; i <= CELLS; i++)
		expected[i] += 1e-6;
	return stats_counts_p(observed, expected, CELLS + 1);
}

static void test_samples_follow_the_density(void **state)
{
	(void)state;
	double min_p = 1, widest = 0;
	for (int k = 0; k < BSDF_CASES; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, bsdf_cases[k], &b);
		for (int i = 0; i < DIRECTIONS; i += test_is_scaled() ? 5 : 1) {
			vec3 wo = direction(i, b.is_two_sided);
			double integral, p = chi_square(&b, &b, wo, stats_seed(bsdf_cases[k]) + (uint64_t)i, &integral);
			if (!(p > LEVEL) || !(integral < 1 + 2e-3))
				fail_msg("%s, direction %d: p = %g, integral = %g", bsdf_cases[k], i, p, integral);
			if (b.has_smooth)
				widest = fmax(widest, integral);
			min_p = fmin(min_p, p);
		}
		arena_fini(&a);
	}
	print_message("least p %.2e, largest integral of a density %.6f\n", min_p, widest);
}

static void test_a_wrong_density_is_found(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b, wrong;
	static const char *const pairs[][2] = {
		{"roughconductor material=none alpha=0.3", "roughconductor material=none alpha=0.33"},
		{"roughconductor material=none alpha=0.3 distribution=ggx",
		 "roughconductor material=none alpha=0.33 distribution=ggx"},
		{"roughdielectric alpha=0.3", "roughdielectric alpha=0.33"},
		{"phong exponent=300 diffuse_reflectance=0", "phong exponent=248 diffuse_reflectance=0"},
	};
	for (size_t k = 0; k < sizeof pairs / sizeof *pairs; k++) {
		double integral;
		bsdf_make_or_fail(&a, pairs[k][0], &b);
		bsdf_make_or_fail(&a, pairs[k][1], &wrong);
		double p = chi_square(&b, &wrong, direction(3, false), stats_seed(__func__), &integral);
		if (p > LEVEL)
			fail_msg("%s for %s is not noticed: p = %g", pairs[k][1], pairs[k][0], p);
	}
	arena_fini(&a);
}

static void test_every_bsdf_has_a_case(void **state)
{
	(void)state;
	for (const struct bsdf_ops *const *ops = bsdf_registry; *ops; ops++) {
		size_t n = strlen((*ops)->decl.type);
		bool found = false;
		for (int k = 0; k < BSDF_CASES; k++)
			found |= strncmp(bsdf_cases[k], (*ops)->decl.type, n) == 0 && strchr(" ", bsdf_cases[k][n]);
		if (!found)
			fail_msg("no parameter set for \"%s\"", (*ops)->decl.type);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_every_bsdf_has_a_case),
		cmocka_unit_test(test_samples_follow_the_density),
		cmocka_unit_test(test_a_wrong_density_is_found),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
