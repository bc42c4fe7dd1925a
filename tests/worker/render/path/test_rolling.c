/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A rolling shutter. The time of a path follows from its position on the film: each line is exposed for the share e
 * of the time, the first line from the beginning and the last up to the end. Samples of `path` must equal, bit by
 * bit, those of the same world with a global shutter whose random number for the time is set to that time; and in
 * each cell of the film, a sliding card must be visible for its share of the cell's own exposure. The command line
 * and leases refuse integrators that do not draw the film position first.
 */
#include "tests/support/dice.h"
#include "tests/support/worlds.h"
#include "worker/cli/base/options.h"
#include "worker/render/path/integrate_path.h"
#include "worker/render/path/path.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 12, HEIGHT = 8 };

/* The film spans 2 x 4/3 around the origin. */
#define SCENE                                                                                                       \
	"<integrator type='path'><integer name='max_depth' value='4'/></integrator>"                                \
	"<sensor type='orthographic'><float name='shutter_open' value='2'/><float name='shutter_close' value='3'/>" \
	"%s<transform name='to_world'><lookat origin='0,0,5' target='0,0,0' up='0,1,0'/></transform>"               \
	"<film type='hdrfilm'>%s</film></sensor>"                                                                   \
	"<shape type='rectangle'><animation name='to_world'>"                                                       \
	"<transform time='2'><scale x='0.2' y='0.9'/><translate x='-0.6'/></transform>"                             \
	"<transform time='3'><scale x='0.2' y='0.9'/><translate x='0.4'/></transform></animation></shape>"
#define LIT                                                                                                 \
	"<shape type='sphere'><point name='center' x='0.3' y='1' z='1'/><float name='radius' value='0.2'/>" \
	"<emitter type='area'/></shape><emitter type='constant'><float name='radiance' value='0.3'/></emitter>"
#define ROLL(type, duration)                                     \
	"<string name='rolling_shutter_type' value='" type "'/>" \
	"<float name='rolling_shutter_duration' value='" duration "'/>"
#define BOX_FILTER "<rfilter type='box'/>"

static struct world *make_rolling_world(const char *roll, const char *filter)
{
	return world_from_text(WIDTH, HEIGHT, SCENE LIT, roll, filter);
}

/* Returns the line's position from 0, the first line, to 1, the last. */
typedef double line_fn(double x, double y);

static double line_of_no_roll(double x, double y)
{
	(void)x, (void)y;
	return 0;
}

static double line_from_top(double x, double y)
{
	(void)x;
	return y / HEIGHT;
}

static double line_from_bottom(double x, double y)
{
	(void)x;
	return 1 - y / HEIGHT;
}

static double line_from_left(double x, double y)
{
	(void)y;
	return x / WIDTH;
}

static double line_from_right(double x, double y)
{
	(void)y;
	return 1 - x / WIDTH;
}

static const struct roll {
	const char *xml;
	line_fn *line;
	double exposure;
} rolls[] = {
	{"", line_of_no_roll, 1},
	{ROLL("none", "0.2"), line_of_no_roll, 1},
	{ROLL("top", "0.5"), line_from_top, 0.5},
	{ROLL("top", "0"), line_from_top, 0},
	{ROLL("top", "1"), line_from_top, 1},
	{ROLL("bottom", "0.25"), line_from_bottom, 0.25},
	{ROLL("left", "0.125"), line_from_left, 0.125},
	{ROLL("right", "0.7"), line_from_right, 0.7},
};
enum { ROLLS = sizeof rolls / sizeof *rolls };

static double time_of(const struct roll *r, const double film[2], double u)
{
	double line = fmin(fmax(r->line(film[0], film[1]), 0), 1);
	return fmin((1 - r->exposure) * line + r->exposure * u, 1 - 0x1p-53);
}

/* ---- samples ---- */

/* Random numbers with a fixed number for the time. */
struct fixed_time_sampler {
	struct sampler base;
	struct sampler_random random;
	double time;
};

static const double *fixed_time_block(struct sampler *base, enum sampler_side side, unsigned vertex)
{
	static double block[SAMPLER_BLOCK_SIZE];
	struct fixed_time_sampler *s = (struct fixed_time_sampler *)base;
	const double *u = s->random.base.block(&s->random.base, side, vertex);
	if (side != SIDE_LIGHT || vertex != 0)
		return u;
	memcpy(block, u, sizeof block);
	block[DIM_TIME] = s->time;
	return block;
}

static void begin(struct path_context *c, struct world *w)
{
	static uint64_t counters[BATCH_COUNTERS];
	const struct plan p = {.width = WIDTH,
			       .height = HEIGHT,
			       .border = w->settings.border,
			       .crop_width = WIDTH,
			       .crop_height = HEIGHT,
			       .max_depth = 4};
	path_context_init_for_samples(c, w, &p, counters);
}

static void check_samples(const struct roll *r, const char *filter)
{
	static struct path_context rolling, still;
	static struct path_sample a, b;
	struct world *w = make_rolling_world(r->xml, filter), *open = make_rolling_world("", filter);
	unsigned lit = 0, beyond = 0;
	assert_true(w->effects.motion && world_has_rolling_shutter(w) == (r->line != line_of_no_roll));
	begin(&rolling, w);
	begin(&still, open);
	for (uint64_t i = 0; i < 4000; i++) {
		struct sampler_random s;
		struct fixed_time_sampler t = {{fixed_time_block}, .time = 0};
		double film[2];
		sampler_random_init(&s, 5, RNG_TEST, i, 0);
		sampler_random_init(&t.random, 5, RNG_TEST, i, 0);
		path_walk_camera(&rolling, &s.base, 2, film);
		t.time = time_of(r, film, s.base.block(&s.base, SIDE_LIGHT, 0)[DIM_TIME]);
		assert_true(fabs(rolling.time - t.time) < 1e-15);
		t.time = rolling.time;
		beyond += film[0] < 0 || film[0] > WIDTH || film[1] < 0 || film[1] > HEIGHT;
		path_trace(&rolling, &s.base, &a);
		path_trace(&still, &t.base, &b);
		assert_true(a.splat_count == b.splat_count &&
			    memcmp(a.splats, b.splats, a.splat_count * sizeof *a.splats) == 0);
		lit += a.splat_count > 0;
	}
	assert_true(lit > 500 && (beyond > 0) == (w->settings.border > 0));
	world_free(w);
	world_free(open);
}

static void times_of_samples_follow_their_lines(void **state)
{
	(void)state;
	for (int i = 0; i < ROLLS; i++) {
		check_samples(&rolls[i], BOX_FILTER);
		check_samples(&rolls[i], "<rfilter type='gaussian'/>");
	}
}

/* ---- what the camera sees ---- */

/* Pearson's chi^2 over the 96 cells, less those in which all or none of the samples meet the card: level 1e-6. */
static void check_seen(const struct roll *r)
{
	enum { FINE = 32 };
	static double seen[HEIGHT][WIDTH], drawn[HEIGHT][WIDTH];
	static struct path_context c;
	struct world *w = world_from_text(WIDTH, HEIGHT, SCENE, r->xml, BOX_FILTER);
	size_t n = dice_scaled_count(200000), cells = 0;
	double chi2 = 0;
	begin(&c, w);
	memset(seen, 0, sizeof seen);
	memset(drawn, 0, sizeof drawn);
	for (size_t i = 0; i < n; i++) {
		struct sampler_random s;
		double film[2];
		sampler_random_init(&s, 11, RNG_TEST, i, 0);
		path_walk_camera(&c, &s.base, 2, film);
		drawn[(int)film[1]][(int)film[0]]++;
		seen[(int)film[1]][(int)film[0]] += c.camera[1].kind == VERTEX_SURFACE;
	}
	for (int k = 0; k < WIDTH * HEIGHT; k++) {
		double share = 0, seen_count = seen[k / WIDTH][k % WIDTH], drawn_count = drawn[k / WIDTH][k % WIDTH];
		for (int i = 0; i < FINE * FINE * FINE; i++) {
			const double film[2] = {k % WIDTH + (i % FINE + 0.5) / FINE,
						k / WIDTH + (i / FINE % FINE + 0.5) / FINE};
			double t = time_of(r, film, (i / FINE / FINE + 0.5) / FINE), x = 2 * film[0] / WIDTH - 1,
			       y = 2 * (0.5 - film[1] / HEIGHT) * HEIGHT / WIDTH;
			share += fabs(x - (t - 0.6)) < 0.2 && fabs(y) < 0.9;
		}
		share /= FINE * FINE * FINE;
		double variance = drawn_count * (share * (1 - share) + 1e-3); /* plus the error of the quadrature */
		chi2 += (seen_count - drawn_count * share) * (seen_count - drawn_count * share) / variance;
		cells += share > 0 && share < 1;
	}
	print_message("%s: chi^2 %.1f of %zu cells\n", *r->xml ? r->xml : "all at once", chi2, cells);
	assert_true(cells > 20 && chi2 < (double)cells + 6 * sqrt(2 * (double)cells) + 12);
	world_free(w);
}

static void rolling_shutter_sees_the_moving_card_line_by_line(void **state)
{
	(void)state;
	for (int i = 0; i < ROLLS; i++)
		check_seen(&rolls[i]);
}

/* ---- who renders it ---- */

static int lease_of(const struct world *w, const char *integrator, struct error *e)
{
	struct plan p;
	struct batch b;
	struct plan_request r = {
		.width = WIDTH, .height = HEIGHT, .border = w->settings.border, .spp = 4, .max_depth = 4};
	const struct lease_key key = {.kind = LEASE_RENDER};
	enum lease_outcome end;
	snprintf(r.integrator, sizeof r.integrator, "%s", integrator);
	r.kind = render_integrator_find(integrator)->kind;
	accuracy_settings_print(&w->accuracy, r.accuracy);
	assert_int_equal(plan_make(&r, &p, e), 0);
	return render_lease(w, &p, &key, NULL, NULL, &end, &b, e);
}

static void integrators_without_rolling_shutter_refuse_it(void **state)
{
	(void)state;
	struct world *w = make_rolling_world(ROLL("top", "0.5"), BOX_FILTER);
	struct render_summary summary;
	world_summary(w, &summary);
	assert_true(summary.has_rolling_shutter);
	for (size_t i = 0; render_integrator_at(i); i++) {
		const char *name = render_integrator_at(i)->name;
		struct render_arguments a = {.plan = {.spp = 4}};
		struct error e = {""};
		bool path = strcmp(name, "path") == 0;
		snprintf(a.plan.integrator, sizeof a.plan.integrator, "%s", name);
		assert_int_equal(render_plan_from_scene(&a, &summary, &e), path ? 0 : -EINVAL);
		if (path)
			continue;
		assert_non_null(strstr(e.text, name));
		assert_non_null(strstr(e.text, "cannot render a rolling shutter"));
		e = (struct error){""};
		assert_int_equal(lease_of(w, name, &e), -EINVAL);
		assert_non_null(strstr(e.text, "cannot render a rolling shutter"));
	}
	struct render_arguments open = {.plan = {.spp = 4}}, chains = {.plan = {.spp = 4, .chains = 8}};
	struct error e = {""};
	assert_int_equal(render_plan_from_scene(&open, &summary, &e), 0);
	assert_string_equal(open.plan.integrator, "path");
	assert_int_equal(render_plan_from_scene(&chains, &summary, &e), -EINVAL);
	world_free(w);
	/* Where nothing moves, every integrator can render. */
	worlds_effects = "-motion";
	w = make_rolling_world(ROLL("top", "0.5"), BOX_FILTER);
	worlds_effects = NULL;
	world_summary(w, &summary);
	assert_false(summary.has_rolling_shutter);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(times_of_samples_follow_their_lines),
		cmocka_unit_test(rolling_shutter_sees_the_moving_card_line_by_line),
		cmocka_unit_test(integrators_without_rolling_shutter_refuse_it),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
