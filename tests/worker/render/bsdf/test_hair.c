/* SPDX-License-Identifier: Apache-2.0 */
/*
 * `hair`: each function of hair_lobes.h is compared with an integral, or with rays traced through a glass cylinder by
 * Snell's law in space; the whole BSDF is compared with its parts, and with the energy that may leave a fibre.
 *
 * Statistical tests: level 1e-6 each; an error of 3 % in a tested share or density is found. Seeds: the names of the
 * tests.
 */
#include "tests/support/dice.h"
#include "tests/support/stats.h"
#include "tests/worker/render/bsdf/bsdf_cases.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/hair_lobes.h"

#include <math.h>

#define PI 3.14159265358979323846
#define LEVEL 1e-6

static const struct wavelengths wavelengths = {.nm = {430, 500, 570, 640}};

static struct bsdf_point point_of(enum transport t)
{
	return (struct bsdf_point){.texture_point = {.u = 0.3, .v = 0.7}, .wavelengths = &wavelengths, .transport = t};
}

static void assert_near(double a, double b, double tolerance, const char *what)
{
	if (!(fabs(a - b) <= tolerance * fmax(fabs(a), fabs(b))))
		fail_msg("%s: %.17g is not %.17g", what, a, b);
}

static struct hair_angle hair_angle_at(double theta)
{
	return (struct hair_angle){sin(theta), cos(theta)};
}

static struct hair_fibre make_fibre(double eta, double along, double around, double tilt)
{
	struct hair_fibre f;
	hair_fibre_init(&f, eta, along, around, tilt);
	return f;
}

/* I0(x) is the mean of exp(x cos t) over a period, for which the trapezoidal rule converges exponentially. */
static void bessel_function_is_the_mean_of_an_exponential(void **state)
{
	(void)state;
	static const double x[] = {0, 1e-9, 0.3, 2, 7, 14.9999, 15, 15.0001, 33, 400, 1e5, 1e8};
	for (size_t i = 0; i < sizeof x / sizeof *x; i++) {
		int n = 100 + (int)(40 * sqrt(x[i]));
		double sum = 0;
		for (int k = 0; k < n; k++) {
			double half = sin(PI * k / n);
			sum += exp(-2 * x[i] * half * half) / n;
		}
		assert_near(hair_scaled_bessel_i0(x[i]), sum, 2e-12, "Bessel");
	}
}

/* Simpson's rule. */
static double longitudinal_integral(const struct hair_fibre *f, int p, double theta)
{
	enum { N = 40000 };
	double sum = 0;
	for (int i = 0; i <= N; i++) {
		double t = PI * ((double)i / N - 0.5);
		sum += (i == 0 || i == N ? 1
			: i % 2		 ? 4
					 : 2) *
		       hair_longitudinal_pdf(f, p, hair_angle_at(theta), hair_angle_at(t)) * fabs(cos(t));
	}
	return sum * PI / N / 3;
}

static void longitudinal_function_is_a_density(void **state)
{
	(void)state;
	static const double roughness[] = {0.01, 0.1, 0.3, 0.8, 1};
	for (size_t i = 0; i < sizeof roughness / sizeof *roughness; i++) {
		struct hair_fibre f = make_fibre(1.55, roughness[i], 0.3, 0.035);
		for (int p = 0; p < HAIR_LOBES; p++)
			for (double theta = -PI / 2; theta < 1.58; theta += PI / 8)
				assert_near(longitudinal_integral(&f, p, theta), 1, 1e-9, "along");
	}
}

/* The angle at which each lobe is brightest: turned by twice the tilt of the scales to one side, by once and four times
 * to the other, and by 0 for the last lobe. Sampled angles are distributed around the same angle with the lobe's
 * variance. */
static void longitudinal_lobes_have_their_angle_and_width(void **state)
{
	(void)state;
	static const double turns[HAIR_LOBES] = {2, -1, -4, 0}, times[HAIR_LOBES] = {1, 0.25, 4, 4};
	const double tilt = 0.05, theta = 0.3, b = 0.08;
	struct hair_fibre f = make_fibre(1.55, b, 0.3, tilt);
	struct dice d = dice_for_test(__func__);
	double root = 0.726 * b + 0.812 * b * b, v = root * root;
	for (int p = 0; p < HAIR_LOBES; p++) {
		double ideal = -theta + turns[p] * tilt, sum = 0, square = 0;
		double peak = hair_longitudinal_pdf(&f, p, hair_angle_at(theta), hair_angle_at(ideal)),
		       s = sqrt(times[p] * v);
		/* A narrow lobe is a normal distribution, except for the curvature. */
		assert_near(peak * cos(ideal), 1 / (sqrt(2 * PI) * s), 0.02, "height");
		double left = hair_longitudinal_pdf(&f, p, hair_angle_at(theta), hair_angle_at(ideal - s)),
		       right = hair_longitudinal_pdf(&f, p, hair_angle_at(theta), hair_angle_at(ideal + s));
		assert_near(sqrt(left * right) / peak, exp(-0.5), 0.02, "width");
		size_t n = dice_scaled_count(40000);
		for (size_t i = 0; i < n; i++) {
			double u[2] = {dice_uniform(&d), dice_uniform(&d)};
			double t = asin(hair_sample_longitudinal(&f, p, hair_angle_at(theta), u[0], u[1]).sin) - ideal;
			sum += t;
			square += t * t;
		}
		double error = s / sqrt((double)n);
		/* The cosine moves the mean by s^2 tan(theta) / 2. */
		assert_true(fabs(sum / (double)n) < 5 * error + s * s);
		assert_near(square / (double)n, s * s, 8 / sqrt((double)n) + 0.02, "variance");
	}
}

static void azimuthal_function_is_a_density(void **state)
{
	(void)state;
	static const double roughness[] = {0.01, 0.1, 0.3, 0.8, 1};
	for (size_t i = 0; i < sizeof roughness / sizeof *roughness; i++) {
		struct hair_fibre f = make_fibre(1.55, 0.3, roughness[i], 0);
		enum { N = 100000 };
		double sum = 0, next = 0.1;
		for (int k = 0; k < N; k++) {
			double x = PI * (2 * (k + 0.5) / N - 1);
			sum += hair_azimuthal_pdf(&f, x) * 2 * PI / N;
			if (sum > next && next < 0.95) { /* hair_sample_azimuthal is its inverse */
				double s = hair_sample_azimuthal(&f, next);
				assert_true(fabs(s - x) < 4 * PI / N);
				next += 0.1;
			}
		}
		assert_near(sum, 1, 1e-8, "around");
		assert_near(hair_azimuthal_pdf(&f, 1.3), hair_azimuthal_pdf(&f, 1.3 - 6 * PI), 1e-6, "a turn more");
	}
}

/* ---- rays through a cylinder ---- */

/* A ray in a cylinder of radius 1 around the y axis. */
struct cylinder_ray {
	vec3 p, d; /* on the surface */
};

static vec3 normal_at(vec3 p)
{
	return vec3_normalize((vec3){p.x, 0, p.z});
}

static vec3 reflected(vec3 d, vec3 n)
{
	return vec3_madd(d, -2 * vec3_dot(d, n), n);
}

/* n points against d; eta: index beyond over index here. */
static vec3 refracted(vec3 d, vec3 n, double eta)
{
	double c = -vec3_dot(d, n), t = sqrt(1 - (1 - c * c) / (eta * eta));
	return vec3_normalize(vec3_madd(vec3_scale(1 / eta, d), c / eta - t, n));
}

/* Moves the ray to the other side, inside the cylinder. Returns the length. */
static double cross_cylinder(struct cylinder_ray *r)
{
	double t = -2 * (r->p.x * r->d.x + r->p.z * r->d.z) / (r->d.x * r->d.x + r->d.z * r->d.z);
	r->p = vec3_madd(r->p, t, r->d);
	return t;
}

static void azimuths_agree_with_rays_through_a_cylinder(void **state)
{
	(void)state;
	struct dice d = dice_for_test(__func__);
	for (int i = 0; i < 300; i++) {
		double eta = dice_between(&d, 1.2, 2), theta = dice_between(&d, -1.4, 1.4),
		       gamma = dice_between(&d, -1.5, 1.5), phi = gamma + PI / 2;
		struct hair_fibre f = make_fibre(eta, 0.3, 0.3, 0);
		vec3 camera = {cos(theta) * cos(phi), sin(theta), cos(theta) * sin(phi)};
		struct hair_entry e = hair_enter(&f, camera.x, camera.z);
		struct cylinder_ray r = {{0, 0, 1}, vec3_neg(camera)};
		vec3 outside[HAIR_LOBES - 1] = {reflected(r.d, normal_at(r.p))};
		r.d = refracted(r.d, normal_at(r.p), eta);
		for (int p = 1; p < HAIR_LOBES - 1; p++) {
			assert_near(cross_cylinder(&r), e.passage_length, 1e-9, "length of a passage");
			vec3 n = normal_at(r.p);
			outside[p] = refracted(r.d, vec3_neg(n), 1 / eta);
			r.d = reflected(r.d, n);
		}
		for (int p = 0; p < HAIR_LOBES - 1; p++) {
			double to = phi + hair_azimuth_change(p, gamma, e.gamma_t);
			assert_true(fabs(outside[p].y + camera.y) < 1e-9);
			assert_true(fabs(outside[p].x - cos(theta) * cos(to)) < 1e-9);
			assert_true(fabs(outside[p].z - cos(theta) * sin(to)) < 1e-9);
		}
	}
}

/* Returns how often a photon crosses the fibre before it leaves, at most HAIR_LOBES - 1; HAIR_LOBES if it is
 * absorbed. */
static int count_passages(vec3 camera, double eta, double sigma, struct dice *d)
{
	struct cylinder_ray r = {{0, 0, 1}, vec3_neg(camera)};
	if (dice_uniform(d) < fresnel_dielectric(camera.z, eta).reflectance)
		return 0;
	r.d = refracted(r.d, normal_at(r.p), eta);
	for (int p = 1;; p++) {
		if (dice_uniform(d) > exp(-sigma * cross_cylinder(&r)))
			return HAIR_LOBES;
		vec3 n = normal_at(r.p);
		if (dice_uniform(d) >= fresnel_dielectric(vec3_dot(r.d, n), 1 / eta).reflectance)
			return p < HAIR_LOBES ? p : HAIR_LOBES - 1;
		r.d = reflected(r.d, n);
	}
}

static void lobe_shares_agree_with_simulated_photons(void **state)
{
	(void)state;
	struct dice d = dice_for_test(__func__);
	for (int i = 0; i < 12; i++) {
		double eta = 1.55, sigma = i % 3 ? dice_between(&d, 0.1, 1) : 0, theta = dice_between(&d, -1.3, 1.3),
		       gamma = dice_between(&d, -1.5, 1.5);
		struct hair_fibre f = make_fibre(eta, 0.3, 0.3, 0);
		vec3 camera = {-cos(theta) * sin(gamma), sin(theta), cos(theta) * cos(gamma)};
		struct hair_entry e = hair_enter(&f, camera.x, camera.z);
		double share[HAIR_LOBES], sum = 0, t = exp(-sigma * e.passage_length);
		hair_lobe_shares(&e, t, share);
		uint64_t n = dice_scaled_count(40000), seen[HAIR_LOBES + 1] = {0};
		for (uint64_t k = 0; k < n; k++) {
			seen[count_passages(camera, eta, sigma, &d)]++;
		}
		double expected[HAIR_LOBES + 1];
		for (int p = 0; p < HAIR_LOBES; p++) {
			expected[p] = share[p] * (double)n;
			sum += share[p];
		}
		expected[HAIR_LOBES] = fmax(0, 1 - sum) * (double)n + 1e-9;
		double all = e.reflectance + e.transmittance * e.transmittance * t / (1 - t * e.reflectance);
		assert_near(sum, all, 1e-13, "closed form");
		if (sigma == 0)
			assert_near(sum, 1, 1e-13, "nothing is lost");
		double p = stats_counts_p(seen, expected, HAIR_LOBES + 1);
		if (!(p > LEVEL))
			fail_msg("shares: p = %g at theta %g, gamma %g, sigma %g", p, theta, gamma, sigma);
	}
}

/* ---- the BSDF ---- */

/* In the direction of an ideal ray, only its own lobe contributes, with its maximum. */
static void test_lobes_lie_along_ideal_rays(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	const struct bsdf_point at = point_of(TRANSPORT_RADIANCE);
	const double m = 0.02, n = 0.02, sigma = 0.3, eta = 1.6;
	bsdf_make_or_fail(
		&a,
		"hair sigma_a=0.3 longitudinal_roughness=0.02 azimuthal_roughness=0.02 scale_tilt=0 int_ior=1.6 ext_ior=1",
		&b);
	struct hair_fibre f = make_fibre(eta, m, n, 0);
	for (int i = 0; i < 20; i++) {
		double theta = -1 + 0.1 * i, gamma = 0.3 + 0.03 * i * (i % 2 ? 1 : -1) - (i % 2 ? 0 : 0.6);
		vec3 camera = {-cos(theta) * sin(gamma), sin(theta), cos(theta) * cos(gamma)};
		struct hair_entry e = hair_enter(&f, camera.x, camera.z);
		double share[HAIR_LOBES];
		hair_lobe_shares(&e, exp(-sigma * e.passage_length), share);
		for (int p = 0; p < HAIR_LOBES - 1; p++) {
			double phi = gamma + PI / 2 + hair_azimuth_change(p, gamma, e.gamma_t);
			vec3 light = {cos(theta) * cos(phi), -sin(theta), cos(theta) * sin(phi)};
			double root = (0.726 * m + 0.812 * m * m) * (p == 1 ? 0.5 : p == 2 ? 2 : 1);
			double s = sqrt(PI / 8) * (0.265 * n + 1.194 * n * n);
			double height = share[p] / (sqrt(2 * PI) * root * cos(theta)) / (4 * s);
			double got = b.ops->eval(&b, &at, camera, light).v[0] * fabs(light.z);
			assert_near(got, height, 0.02, "height of a lobe");
		}
	}
	arena_fini(&a);
}

/* The energy that leaves, estimated by sampling, is the closed form, at each offset from the axis and for any
 * roughness. */
static void scattered_energy_has_its_closed_form(void **state)
{
	(void)state;
	static const char *const texts[] = {"hair sigma_a=0 longitudinal_roughness=0.01 azimuthal_roughness=0.01",
					    "hair sigma_a=0.4 longitudinal_roughness=0.1 azimuthal_roughness=0.9",
					    "hair sigma_a=0.4 longitudinal_roughness=1 azimuthal_roughness=0.3"};
	enum { GROUPS = 16 };
	const struct bsdf_point at = point_of(TRANSPORT_RADIANCE);
	struct hair_fibre f = make_fibre(1.55 / 1.000277, 0.3, 0.3, 0);
	struct dice d = dice_for_test(__func__);
	for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
		struct arena a = {0};
		struct bsdf b;
		bsdf_make_or_fail(&a, texts[k], &b);
		for (int i = 0; i < 12; i++) {
			vec3 camera = dice_direction(&d);
			double means[GROUPS] = {0}, least = INFINITY;
			camera.z = fabs(camera.z);
			if (i < 3) /* h = +-1, and almost along the fibre */
				camera = vec3_normalize((vec3){i == 0 ? 1 : i == 1 ? -1 : 1e-6, 0.2 * i, 1e-9});
			struct hair_entry e = hair_enter(&f, camera.x, camera.z);
			double t = exp(-(k ? 0.4 : 0) * e.passage_length),
			       all = e.reflectance +
				     e.transmittance * e.transmittance * t / (1 - t + t * e.transmittance);
			size_t n = dice_scaled_count(16000);
			for (size_t j = 0; j < n; j++) {
				double u[3] = {dice_uniform(&d), dice_uniform(&d), dice_uniform(&d)};
				struct bsdf_sample s;
				assert_true(b.ops->sample(&b, &at, camera, u, &s));
				double weight = s.f.v[0] * fabs(s.wi.z) / s.pdf;
				least = fmin(least, weight);
				means[j % GROUPS] += weight / (double)(n / GROUPS);
			}
			struct stats_mean mean = stats_mean_test(means, GROUPS, all);
			if (!(fabs(mean.mean - all) < 8 * mean.error + 1e-9))
				fail_msg("%s: %g +- %g leaves of %g", texts[k], mean.mean, mean.error, all);
			if (k == 0) /* each sample has the same value */
				assert_near(least, 1, 1e-9, "white");
		}
		arena_fini(&a);
	}
}

/* Integrates over the sphere without sampling: without absorption, the result is 1. */
static void fibre_that_absorbs_nothing_loses_nothing(void **state)
{
	(void)state;
	struct arena a = {0};
	struct bsdf b;
	const struct bsdf_point at = point_of(TRANSPORT_RADIANCE);
	bsdf_make_or_fail(&a, "hair sigma_a=0 longitudinal_roughness=0.3 azimuthal_roughness=0.4", &b);
	for (int i = 0; i < 4; i++) {
		vec3 camera = vec3_normalize((vec3){-0.9 + 0.5 * i, 0.7 - 0.3 * i, 0.4});
		enum { N = 400 };
		double sum = 0;
		for (int k = 0; k < N; k++)
			for (int l = 0; l < 2 * N; l++) {
				double y = 2 * (k + 0.5) / N - 1, c = sqrt(1 - y * y), phi = PI * (l + 0.5) / N;
				vec3 light = {c * cos(phi), y, c * sin(phi)};
				sum += b.ops->eval(&b, &at, camera, light).v[0] * fabs(light.z);
			}
		assert_near(sum * 2 / N * PI / N, 1, 1e-3, "white over the sphere");
	}
	arena_fini(&a);
}

/* Importance is sampled with its density, never towards the inside, and from outside passes straight on with
 * probability 1/2. If the back is culled, nothing passes straight on, and no light arrives from inside. */
static void importance_is_sampled_with_its_density(void **state)
{
	(void)state;
	enum { ROWS = 12, COLUMNS = 12, INNER = 24, CELLS = ROWS * COLUMNS };
	struct arena a = {0};
	struct bsdf b;
	struct dice d = dice_for_test(__func__);
	struct bsdf_point at = point_of(TRANSPORT_IMPORTANCE), to_camera = point_of(TRANSPORT_RADIANCE);
	bsdf_make_or_fail(&a, "hair longitudinal_roughness=0.5 azimuthal_roughness=0.6", &b);
	for (int i = 0; i < 12; i++) {
		vec3 light = dice_direction(&d), wi;
		at.culls_backfaces = to_camera.culls_backfaces = i >= 8;
		if (at.culls_backfaces)
			light.z = fabs(light.z);
		uint64_t seen[CELLS + 1] = {0}, n = dice_scaled_count(40000);
		double expected[CELLS + 1] = {0}, inside = 0, chance = 0;
		for (int c = 0; c < CELLS * INNER * INNER; c++) {
			int row = c / (COLUMNS * INNER * INNER), column = c / (INNER * INNER) % COLUMNS,
			    k = c % (INNER * INNER);
			double y = 2 * (row + (k / INNER + 0.5) / INNER) / ROWS - 1, s = sqrt(1 - y * y),
			       phi = PI * (column + (k % INNER + 0.5) / INNER) / COLUMNS;
			expected[row * COLUMNS + column] +=
				b.ops->pdf_solid(&b, &at, light, (vec3){s * cos(phi), y, s * sin(phi)}) * 2 / ROWS *
				PI / COLUMNS / (INNER * INNER) * (double)n;
		}
		for (int c = 0; c < CELLS; c++)
			inside += expected[c];
		expected[CELLS] = (double)n - inside;
		for (uint64_t k = 0; k < n; k++) {
			double u[3] = {dice_uniform(&d), dice_uniform(&d), dice_uniform(&d)};
			struct bsdf_sample s;
			bool is_sampled = b.ops->sample(&b, &at, light, u, &s);
			if (!is_sampled || (s.mode & BSDF_DELTA)) {
				seen[CELLS]++;
				continue;
			}
			assert_true(s.wi.z > 0);
			int row = (int)(ROWS * (s.wi.y + 1) / 2), column = (int)(COLUMNS * atan2(s.wi.z, s.wi.x) / PI);
			seen[row * COLUMNS + column]++;
			assert_near(s.f.v[1], b.ops->eval(&b, &to_camera, s.wi, light).v[1], 1e-12, "the other way");
		}
		double p = stats_counts_p(seen, expected, CELLS + 1);
		if (!(p > LEVEL))
			fail_msg("importance from z = %g: p = %g", light.z, p);
		spectrum w = bsdf_eval_delta(&b, &at, light, BSDF_TRANSMIT | BSDF_STRAIGHT, &wi, &chance);
		assert_true(light.z > 0 && !at.culls_backfaces ? w.v[0] == 1 && chance == 0.5 && wi.z == -light.z
							       : w.v[0] == 0);
		w = bsdf_eval_delta(&b, &to_camera, light, BSDF_TRANSMIT | BSDF_STRAIGHT, &wi, &chance);
		assert_true(light.z < 0 && !at.culls_backfaces ? w.v[0] == 1 && chance == 1 : w.v[0] == 0);
	}
	arena_fini(&a);
}

static spectrum eval_value(const char *text, const struct wavelengths *w, vec3 wo, vec3 wi)
{
	struct arena a = {0};
	struct bsdf b;
	const struct bsdf_point at = {.texture_point = {.u = 0.3, .v = 0.7}, .wavelengths = w};
	bsdf_make_or_fail(&a, text, &b);
	spectrum f = b.ops->eval(&b, &at, wo, wi);
	arena_fini(&a);
	return f;
}

static void hair_colours_follow_their_parameters(void **state)
{
	(void)state;
	static const struct wavelengths rgb = {.is_rgb = true, .nm = {NAN, NAN, NAN, NAN}};
	static const char *const same[][2] = {
		{"hair eumelanin=2 pheomelanin=0", "hair sigma_a=rgb(0.838,1.394,2.74)"},
		{"hair eumelanin=0 pheomelanin=0.5", "hair sigma_a=rgb(0.187,0.4,1.05) scale=0.5"},
		{"hair", "hair eumelanin=1.3 pheomelanin=0.2 longitudinal_roughness=0.3 azimuthal_roughness=0.3 "
			 "scale_tilt=2 int_ior=amber ext_ior=air"},
		{"hair sigma_a=0.6", "hair sigma_a=2 scale=0.3"},
		{"hair sigma_a=0.6", "hair | @sigma_a checkerboard color0=0.6 color1=0.6"},
	};
	const vec3 wo = vec3_normalize((vec3){0.3, 0.2, 0.8}), wi = vec3_normalize((vec3){-0.1, -0.3, -0.7});
	for (size_t k = 0; k < sizeof same / sizeof *same; k++)
		for (int mode = 0; mode < 2; mode++)
			for (int l = 0; l < SPECTRUM_LANES; l++) {
				const struct wavelengths *w = mode ? &rgb : &wavelengths;
				assert_near(eval_value(same[k][0], w, wo, wi).v[l],
					    eval_value(same[k][1], w, wo, wi).v[l], 1e-9, same[k][0]);
			}
	/* Melanin is brown: most red light passes, then green, then blue. */
	spectrum f = eval_value("hair", &rgb, wo, wi);
	assert_true(f.v[0] > 1.2 * f.v[1] && f.v[1] > 1.2 * f.v[2]);
	f = eval_value("hair", &wavelengths, wo, wi);
	assert_true(f.v[3] > f.v[2] && f.v[2] > f.v[1] && f.v[1] > f.v[0]);
}

/* Mirroring in the plane of normal and fibre changes nothing. */
static void mirroring_the_fibre_changes_nothing(void **state)
{
	(void)state;
	struct dice d = dice_for_test(__func__);
	for (int i = 0; i < 200; i++) {
		vec3 wo = dice_direction(&d), wi = dice_direction(&d);
		wo.z = fabs(wo.z);
		spectrum f = eval_value("hair", &wavelengths, wo, wi),
			 g = eval_value("hair", &wavelengths, (vec3){-wo.x, wo.y, wo.z}, (vec3){-wi.x, wi.y, wi.z});
		assert_near(f.v[2], g.v[2], 1e-9, "mirrored");
		assert_true(f.v[2] > 0);
		wo.z = -wo.z;
		assert_true(eval_value("hair", &wavelengths, wo, wi).v[2] == 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bessel_function_is_the_mean_of_an_exponential),
		cmocka_unit_test(longitudinal_function_is_a_density),
		cmocka_unit_test(longitudinal_lobes_have_their_angle_and_width),
		cmocka_unit_test(azimuthal_function_is_a_density),
		cmocka_unit_test(azimuths_agree_with_rays_through_a_cylinder),
		cmocka_unit_test(lobe_shares_agree_with_simulated_photons),
		cmocka_unit_test(test_lobes_lie_along_ideal_rays),
		cmocka_unit_test(scattered_energy_has_its_closed_form),
		cmocka_unit_test(fibre_that_absorbs_nothing_loses_nothing),
		cmocka_unit_test(importance_is_sampled_with_its_density),
		cmocka_unit_test(hair_colours_follow_their_parameters),
		cmocka_unit_test(mirroring_the_fibre_changes_nothing),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
