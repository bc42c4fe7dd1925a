/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Leases: a result depends only on the plan and the key, in any order; a lease can be stopped; bad input is refused;
 * a crop has the pixels of the whole image, and borders keep their energy; memory may run out.
 */
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "tests/support/dice.h"
#include "tests/support/failing_memory.h"
#include "tests/support/leases.h"
#include "tests/support/worlds.h"
#include "worker/render/path/integrator.h"
#include "worker/render/render.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { PARTS = 2, GROUPS = 2, CHAINS = 8 };

static struct world *small_world(const char *filter)
{
	/* clang-format off */
	return world_from_text(80, 70,
		"<sensor type='perspective'>"
			"<float name='fov' value='50'/>"
			"<transform name='to_world'><lookat origin='0,1,5' target='0,0.5,0' up='0,1,0'/></transform>"
			"<film type='hdrfilm'><rfilter type='%s'/></film>"
		"</sensor>"
		"<shape type='rectangle'>"
			"<transform name='to_world'><scale value='3'/><rotate x='1' angle='-90'/></transform>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='0' y='.6' z='0'/>"
			"<float name='radius' value='.6'/>"
			"<bsdf type='dielectric'/>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='1' y='2' z='1'/>"
			"<float name='radius' value='.3'/>"
			"<emitter type='area'><rgb name='radiance' value='4,3,2'/></emitter>"
		"</shape>",
		filter);
	/* clang-format on */
}

static struct plan plan_of(const struct world *w, const char *integrator)
{
	const struct integrator_properties *i = render_integrator_find(integrator);
	struct plan p = {.kind = i->kind,
			 .width = w->settings.width,
			 .height = w->settings.height,
			 .crop_width = w->settings.width,
			 .crop_height = w->settings.height,
			 .border = w->settings.border,
			 .seed = 3,
			 .groups = GROUPS,
			 .parts = PARTS,
			 .chains = i->kind == PLAN_CHAINS ? CHAINS : 0,
			 .bootstrap = 512,
			 .epoch = i->kind == PLAN_CHAINS ? 300 : 1,
			 .rounds = 3,
			 .min_depth = 1,
			 .max_depth = 6};
	snprintf(p.integrator, sizeof p.integrator, "%s", integrator);
	struct render_summary summary;
	struct error e = {""};
	world_summary(w, &summary);
	if (render_integrator_find(integrator)->has_mutations &&
	    render_canonical_mutations(NULL, &summary, p.mutations, &e))
		fail_msg("%s", e.text);
	if (plan_check(&p, &e))
		fail_msg("%s", e.text);
	return p;
}

static void assert_same(const struct batch *a, const struct batch *b)
{
	assert_memory_equal(a->counters, b->counters, sizeof a->counters);
	assert_true(a->independent_sum == b->independent_sum && a->independent_square == b->independent_square);
	assert_true(a->overlong_sum == b->overlong_sum);
	assert_int_equal(a->tile_count, b->tile_count);
	for (uint32_t i = 0; i < a->tile_count; i++) {
		const struct tile *s = &a->tiles[i], *t = &b->tiles[i];
		assert_true(s->x == t->x && s->y == t->y && s->width == t->width && s->height == t->height);
		assert_memory_equal(s->xyz, t->xyz, (size_t)s->width * s->height * 3 * sizeof *s->xyz);
	}
	assert_int_equal(a->state_count, b->state_count);
	for (uint32_t i = 0; i < a->state_count; i++) {
		assert_int_equal(a->states[i].size, b->states[i].size);
		assert_memory_equal(a->states[i].bytes, b->states[i].bytes, a->states[i].size);
	}
	assert_int_equal(a->weight_count, b->weight_count);
	if (a->weight_count)
		assert_memory_equal(a->weights, b->weights, a->weight_count * sizeof *a->weights);
}

static struct lease_key make_key(enum lease_kind kind, uint32_t group, uint32_t part, uint64_t epoch)
{
	return (struct lease_key){1, kind, group, part, epoch};
}

/* Finds seeds that carry light, for one lease of chains. */
static void find_seeds(const struct world *w, const struct plan *p, uint32_t group, uint64_t *seeds, uint32_t count)
{
	struct batch b = leases_run(w, p, make_key(LEASE_BOOTSTRAP, group, 0, 0), NULL);
	uint64_t first = plan_bootstrap_range(p, group, 0).begin;
	uint32_t n = 0;
	for (uint64_t i = 0; i < b.weight_count && n < count; i++)
		if (b.weights[i] > 0)
			seeds[n++] = first + i;
	assert_int_equal(n, count);
	batch_fini(&b);
}

/* All leases of a job of samples or bootstraps, forwards and backwards: the same bytes for each. */
static void results_do_not_depend_on_the_order_of_leases(void **state)
{
	(void)state;
	struct world *w = small_world("gaussian");
	const char *names[] = {"path", "bdpt", "bdpt8", "erpt", "erpt4", "pssmlt"};
	for (int n = 0; n < 6; n++) {
		struct plan p = plan_of(w, names[n]);
		enum lease_kind kind = p.kind == PLAN_CHAINS ? LEASE_BOOTSTRAP : LEASE_RENDER;
		struct batch b[GROUPS * PARTS];
		for (uint32_t i = 0; i < GROUPS * PARTS; i++)
			b[i] = leases_run(w, &p, make_key(kind, i % GROUPS, i / GROUPS, 0), NULL);
		for (uint32_t i = GROUPS * PARTS; i-- > 0;) {
			struct batch again = leases_run(w, &p, make_key(kind, i % GROUPS, i / GROUPS, 0), NULL);
			assert_same(&b[i], &again);
			batch_fini(&again);
			batch_fini(&b[i]);
		}
	}
	world_free(w);
}

/* Chains from seeds, and from states saved by another run. */
static void chain_results_depend_only_on_seeds_and_states(void **state)
{
	(void)state;
	struct world *w = small_world("box");
	for (size_t n = 0; render_integrator_at(n); n++) {
		if (render_integrator_at(n)->kind != PLAN_CHAINS)
			continue;
		struct plan p = plan_of(w, render_integrator_at(n)->name);
		uint64_t seeds[2];
		find_seeds(w, &p, 1, seeds, 2);
		struct lease_input in = {.chain_count = 2, .seeds = seeds};
		struct batch a = leases_run(w, &p, make_key(LEASE_RENDER, 1, 1, 0), &in),
			     b = leases_run(w, &p, make_key(LEASE_RENDER, 1, 1, 0), &in);
		assert_same(&a, &b);
		assert_true(a.counters[COUNT_SAMPLES] == 2 * p.epoch && a.tile_count > 0);
		struct lease_input next = {.chain_count = 2, .states = a.states},
				   copy = {.chain_count = 2, .states = b.states};
		struct batch c = leases_run(w, &p, make_key(LEASE_RENDER, 1, 1, 1), &next),
			     d = leases_run(w, &p, make_key(LEASE_RENDER, 1, 1, 1), &copy);
		assert_same(&c, &d);
		batch_fini(&a);
		batch_fini(&b);
		batch_fini(&c);
		batch_fini(&d);
	}
	world_free(w);
}

/* Light so weak that contributions are denormal or zero, and light as strong as a scene may have: every lease gives a
 * batch that passes its checks (leases_run() verifies them), with each integrator. */
static void extreme_light_passes_the_batch_checks(void **state)
{
	(void)state;
	const char *radiance[] = {"1e-320", "1e-306", "1e-293", "1e-290", "1e-160", "1e30"};
	for (size_t n = 0; n < sizeof radiance / sizeof *radiance; n++) {
		/* clang-format off */
		struct world *w = world_from_text(16, 16,
			SENSOR("0,0,5", "0,0,0")
			"<shape type='sphere'><bsdf type='diffuse'/></shape>"
			"<shape type='cube'>"
				"<transform name='to_world'><scale value='7'/></transform>"
				"<bsdf type='twosided'><bsdf type='diffuse'/></bsdf>"
			"</shape>"
			"<shape type='rectangle'>"
				"<transform name='to_world'><rotate y='1' angle='180'/><translate z='6'/></transform>"
				"<emitter type='area'><rgb name='radiance' value='%s'/></emitter>"
			"</shape>",
			radiance[n]);
		/* clang-format on */
		for (size_t i = 0; render_integrator_at(i); i++) {
			struct plan p = plan_of(w, render_integrator_at(i)->name);
			uint64_t seeds[2] = {UINT64_MAX, UINT64_MAX};
			struct lease_input in = {.chain_count = 2, .seeds = seeds};
			bool chains = p.kind == PLAN_CHAINS;
			p.bootstrap = 4096;
			struct batch a = leases_run(w, &p, make_key(LEASE_BOOTSTRAP, 1, 0, 0), NULL);
			batch_fini(&a);
			struct batch b = leases_run(w, &p, make_key(LEASE_RENDER, 1, 0, 0), chains ? &in : NULL);
			batch_fini(&b);
		}
		world_free(w);
	}
}

static int lease_result_code(const struct world *w, const struct plan *p, struct lease_key k,
			     const struct lease_input *in)
{
	struct batch b;
	struct error e = {""};
	enum lease_outcome end;
	int rc = render_lease(w, p, &k, in, NULL, &end, &b, &e);
	assert_true(rc == 0 || e.text[0]);
	batch_fini(&b);
	return rc;
}

static void invalid_leases_are_refused(void **state)
{
	(void)state;
	struct world *w = small_world("box");
	struct plan p = plan_of(w, "pssmlt"), other;
	uint64_t seeds[3];
	find_seeds(w, &p, 0, seeds, 3);
	struct lease_key k0 = make_key(LEASE_RENDER, 0, 0, 0), k1 = make_key(LEASE_RENDER, 0, 0, 1);
	struct lease_input in = {.chain_count = 2, .seeds = seeds};
	struct batch b = leases_run(w, &p, k0, &in);
	/* Wrong counts, and no input at all. */
	assert_int_equal(lease_result_code(w, &p, k0, NULL), -EINVAL);
	for (uint32_t n = 0; n < 4; n++)
		if (n != 2)
			assert_int_equal(
				lease_result_code(w, &p, k0, &(struct lease_input){.chain_count = n, .seeds = seeds}),
				-EINVAL);
	assert_int_equal(lease_result_code(w, &p, k0, &(struct lease_input){.chain_count = 2}), -EINVAL);
	/* States: of another chain, truncated, too long, random bytes. */
	struct chain_state s[2] = {b.states[1], b.states[0]};
	assert_int_equal(lease_result_code(w, &p, k1, &(struct lease_input){.chain_count = 2, .states = s}), -EILSEQ);
	struct dice d = dice_for_test("hostile states");
	size_t good = 0;
	for (size_t i = 0; i < dice_scaled_count(300); i++) {
		uint8_t *bytes = malloc(b.states[0].size + 64);
		uint32_t size = b.states[0].size;
		memset(bytes, 0, size + 64);
		memcpy(bytes, b.states[0].bytes, size);
		if (i % 3 == 0)
			size = dice_below(&d, size);
		else if (i % 3 == 1)
			size += 1 + dice_below(&d, 63);
		else
			for (int n = 0; n < 4; n++)
				bytes[24 + dice_below(&d, size - 24)] ^= (uint8_t)(1 + dice_below(&d, 255));
		uint8_t *exact = malloc(size ? size : 1);
		memcpy(exact, bytes, size);
		struct chain_state hostile[2] = {{exact, size}, b.states[1]};
		int rc = lease_result_code(w, &p, k1, &(struct lease_input){.chain_count = 2, .states = hostile});
		/* Other numbers in [0,1) may give another path that carries light: a valid state. */
		assert_true(rc == -EILSEQ || (rc == 0 && i % 3 == 2));
		good += rc == 0;
		free(exact);
		free(bytes);
	}
	print_message("%zu of the noisy states are states\n", good);
	/* Dark seeds: such a chain searches for light. */
	struct batch boot = leases_run(w, &p, make_key(LEASE_BOOTSTRAP, 0, 0, 0), NULL);
	for (uint64_t i = 0; i < boot.weight_count; i++)
		if (!(boot.weights[i] > 0)) {
			assert_int_equal(lease_result_code(w, &p, k0,
							   &(struct lease_input){.chain_count = 2,
										 .seeds = (uint64_t[]){seeds[0], i}}),
					 0);
			break;
		}
	batch_fini(&boot);
	/* Plans that do not belong to this world. */
	other = p;
	other.width++;
	assert_int_equal(lease_result_code(w, &other, k0, &in), -EINVAL);
	other = p;
	other.border = 3;
	assert_int_equal(lease_result_code(w, &other, k0, &in), -EINVAL);
	other = p;
	strcpy(other.integrator, "none");
	assert_int_equal(lease_result_code(w, &other, k0, &in), -EINVAL);
	other = p;
	strcpy(other.integrator, "path");
	assert_int_equal(lease_result_code(w, &other, k0, &in), -EINVAL);
	other = p;
	other.max_depth = 0;
	assert_int_equal(lease_result_code(w, &other, k0, &in), -EINVAL);
	other.max_depth = PATH_EDGES_MAX + 1;
	assert_int_equal(lease_result_code(w, &other, k0, &in), -EINVAL);
	batch_fini(&b);
	world_free(w);
	/* A scene with scattering media. */
	w = world_from_text(
		8, 8,
		SENSOR("0,0,5", "0,0,0") "<emitter type='constant'/><shape type='sphere'><bsdf type='null'/>"
					 "<medium type='homogeneous' name='interior'/></shape>");
	for (size_t i = 0; render_integrator_at(i); i++) {
		p = plan_of(w, render_integrator_at(i)->name);
		assert_int_equal(lease_result_code(w, &p, make_key(LEASE_BOOTSTRAP, 0, 0, 0), NULL), 0);
	}
	world_free(w);
}

/* A camera without a direction computes 0/0 in the first path of every kind of lease: an error names the place, and
 * neither the thread nor the world keeps any effect of it. */
static void invalid_operation_fails_only_its_lease(void **state)
{
	(void)state;
#if defined(__x86_64__)
	struct world *w = small_world("box");
	const double center = w->camera.center_x;
	for (size_t n = 0; render_integrator_at(n); n++) {
		struct plan p = plan_of(w, render_integrator_at(n)->name);
		uint64_t seeds[2];
		find_seeds(w, &p, 0, seeds, 2);
		struct lease_input in = {.chain_count = 2, .seeds = seeds};
		for (int kind = LEASE_BOOTSTRAP; kind <= LEASE_RENDER; kind++) {
			struct lease_key k = make_key((enum lease_kind)kind, 0, 0, 0);
			struct batch good = leases_run(w, &p, k, &in), b;
			struct error e = {""};
			enum lease_outcome end;
			w->camera.center_x = INFINITY;
			assert_int_equal(render_lease(w, &p, &k, &in, NULL, &end, &b, &e), -EDOM);
			assert_true(strstr(e.text, "invalid floating-point operation (SIGFPE)") &&
				    strstr(e.text, p.integrator));
			const char *where = p.kind == PLAN_SAMPLES ? "row 0, column 0" : "mutation";
			if (integrator_find(p.integrator)->redistributes)
				where = "map of brightness";
			if (kind == LEASE_BOOTSTRAP)
				where = "bootstrap sample";
			assert_true(strstr(e.text, where));
			assert_true(!b.tiles && !b.states && !b.weights && !b.moments);
			w->camera.center_x = center;
			struct batch again = leases_run(w, &p, k, &in);
			assert_same(&good, &again);
			batch_fini(&good);
			batch_fini(&again);
		}
	}
	world_free(w);
#endif
}

static void leases_can_be_stopped(void **state)
{
	(void)state;
	struct world *w = small_world("box");
	const char *names[] = {"path", "bdpt", "pssmlt"};
	for (int n = 0; n < 3; n++) {
		struct plan p = plan_of(w, names[n]);
		uint64_t seeds[2];
		find_seeds(w, &p, 0, seeds, 2);
		struct lease_input in = {.chain_count = 2, .seeds = seeds};
		for (int kind = LEASE_BOOTSTRAP; kind <= LEASE_RENDER; kind++) {
			atomic_bool stop = true;
			enum lease_outcome end = LEASE_DONE;
			struct batch b;
			struct lease_key k = make_key((enum lease_kind)kind, 0, 0, 0);
			assert_int_equal(
				render_lease(w, &p, &k, p.kind == PLAN_CHAINS ? &in : NULL, &stop, &end, &b, NULL), 0);
			assert_int_equal(end, LEASE_STOPPED);
			assert_true(!b.tiles && !b.states && !b.weights && b.tile_count == 0 && b.state_count == 0 &&
				    b.weight_count == 0);
			batch_fini(&b);
			atomic_store(&stop, false);
			assert_int_equal(
				render_lease(w, &p, &k, p.kind == PLAN_CHAINS ? &in : NULL, &stop, &end, &b, NULL), 0);
			assert_int_equal(end, LEASE_DONE);
			batch_fini(&b);
		}
	}
	world_free(w);
}

/* A lease ticks however few pixels there are: a worker whose lease does not tick for long counts as hung, and one
 * that does not poll stops late. */
static void every_lease_ticks(void **state)
{
	(void)state;
	enum { TICK = 16 };
	static atomic_ullong ticks;
	struct world *w = small_world("box");
	const char *names[] = {"path", "bdpt", "erpt", "pssmlt", "hslt"};
	for (int n = 0; n < 5; n++) {
		struct plan p = plan_of(w, names[n]);
		uint64_t seeds[2];
		find_seeds(w, &p, 1, seeds, 2);
		p.epoch = p.kind == PLAN_CHAINS ? 256 : 50;
		struct lease_input in = {.chain_count = 2, .seeds = seeds};
		for (int kind = LEASE_BOOTSTRAP; kind <= LEASE_RENDER; kind++) {
			struct lease_key k = make_key((enum lease_kind)kind, 1, 0, 0);
			atomic_store(&ticks, 0);
			liveness_counter = &ticks;
			struct batch b = leases_run(w, &p, k, p.kind == PLAN_CHAINS ? &in : NULL);
			liveness_counter = NULL;
			assert_true(b.counters[COUNT_SAMPLES] >= TICK);
			assert_true(atomic_load(&ticks) >= b.counters[COUNT_SAMPLES] / TICK);
			batch_fini(&b);
		}
	}
	world_free(w);
}

static float *render_film(const struct world *w, const struct plan *p)
{
	float *film = calloc((size_t)p->width * p->height * 3, sizeof *film);
	double *sum = calloc((size_t)p->width * p->height * 3, sizeof *sum);
	for (uint32_t g = 0; g < p->groups; g++)
		for (uint32_t part = 0; part < p->parts; part++) {
			struct batch b = leases_run(w, p, make_key(LEASE_RENDER, g, part, 0), NULL);
			for (uint32_t t = 0; t < b.tile_count; t++)
				for (uint32_t i = 0; i < b.tiles[t].width * b.tiles[t].height * 3; i++) {
					uint32_t x = b.tiles[t].x + i / 3 % b.tiles[t].width,
						 y = b.tiles[t].y + i / 3 / b.tiles[t].width;
					sum[((size_t)y * p->width + x) * 3 + i % 3] += (double)b.tiles[t].xyz[i];
				}
			batch_fini(&b);
		}
	for (size_t i = 0; i < (size_t)p->width * p->height * 3; i++)
		film[i] = (float)sum[i];
	free(sum);
	return film;
}

/* A crop draws the samples of the full render. Film points are computed from the crop's own corner: they differ by
 * roundings of double, which a path through glass can magnify, and sums are rounded to float in other strips. */
static void crop_has_the_pixels_of_the_whole_film(void **state)
{
	(void)state;
	const char *filters[] = {"box", "tent", "gaussian"};
	for (int f = 0; f < 3; f++) {
		struct world *w = small_world(filters[f]);
		struct plan p = plan_of(w, "path"), crop = p;
		crop.crop_x = 13;
		crop.crop_y = 9;
		crop.crop_width = 50;
		crop.crop_height = 31;
		float *whole = render_film(w, &p), *part = render_film(w, &crop);
		size_t differ = 0;
		double light = 0;
		for (uint32_t y = 0; y < p.height; y++)
			for (uint32_t x = 0; x < p.width; x++)
				for (int k = 0; k < 3; k++) {
					bool inside =
						x - crop.crop_x < crop.crop_width && y - crop.crop_y < crop.crop_height;
					double a = (double)whole[(y * p.width + x) * 3 + (uint32_t)k],
					       b = (double)part[(y * p.width + x) * 3 + (uint32_t)k];
					light += inside ? a : 0;
					differ += inside ? !(fabs(a - b) <= 1e-6 * (a + b)) : b != 0;
				}
		print_message("%s: %zu of %u values differ\n", filters[f], differ,
			      crop.crop_width * crop.crop_height * 3);
		assert_true(light > 0);
		assert_true(differ <= 12); /* one edge crossed by a rounding */
		free(whole);
		free(part);
		world_free(w);
	}
}

/* Constant light remains constant to the border with every filter, because sampling extends beyond the film. Each
 * pixel's mean must lie within the noise of its samples, since the kernel's weights vary; a border that lost energy
 * would be darker by at least 10 %. */
static void constant_light_is_constant_to_the_border(void **state)
{
	(void)state;
	const char *filters[] = {"box", "tent", "gaussian"};
	for (int f = 0; f < 3; f++) {
		struct world *w = world_from_text(
			24, 20,
			"<sensor type='perspective'><film type='hdrfilm'><rfilter type='%s'/></film></sensor>"
			"<emitter type='constant'><float name='radiance' value='2'/></emitter>",
			filters[f]);
		struct plan p = plan_of(w, "path");
		p.epoch = 512;
		float *film = render_film(w, &p);
		double expected = 2 * w->grey_xyz[1] * (double)(p.epoch * p.groups), border = 0, inner = 0;
		size_t borders = 0, inners = 0;
		for (uint32_t y = 0; y < p.height; y++)
			for (uint32_t x = 0; x < p.width; x++) {
				double v = (double)film[(y * p.width + x) * 3 + 1] / expected;
				bool edge = x == 0 || y == 0 || x + 1 == p.width || y + 1 == p.height;
				*(edge ? &border : &inner) += v;
				*(edge ? &borders : &inners) += 1;
				/* Weights k / mean k of 1024 stratified samples: standard deviation below 3 %; the
				 * limit is seven of them. */
				assert_true(fabs(v - 1) < 0.2);
			}
		print_message("%s: border %.5f, inside %.5f\n", filters[f], border / (double)borders,
			      inner / (double)inners);
		assert_true(fabs(border / (double)borders - 1) < 0.01);
		assert_true(fabs(inner / (double)inners - 1) < 0.005);
		free(film);
		world_free(w);
	}
}

/* The n-th allocation fails, for each n: an error or a result, nothing else; the sanitizer finds leaks. */
static void failed_allocation_is_an_error_without_leaks(void **state)
{
	(void)state;
	struct world *w = small_world("tent");
	const char *names[] = {"path", "pssmlt"};
	for (int n = 0; n < 2; n++) {
		struct plan p = plan_of(w, names[n]);
		p.epoch = 1;
		uint64_t seeds[2];
		find_seeds(w, &p, 0, seeds, 2);
		struct lease_input in = {.chain_count = 2, .seeds = seeds};
		for (int kind = LEASE_BOOTSTRAP; kind <= LEASE_RENDER; kind++) {
			int failed = 0;
			for (long i = 0;; i++) {
				struct error e = {""};
				struct batch b;
				enum lease_outcome end;
				struct lease_key k = make_key((enum lease_kind)kind, 0, 0, 0);
				mem_fail_after(i);
				int rc =
					render_lease(w, &p, &k, p.kind == PLAN_CHAINS ? &in : NULL, NULL, &end, &b, &e);
				mem_fail_after(-1);
				assert_true(rc == 0 || (rc == -ENOMEM && e.text[0]));
				if (rc)
					assert_true(!b.tiles && !b.states && !b.weights);
				batch_fini(&b);
				if (rc == 0)
					break;
				failed++;
			}
			assert_true(failed >= 2 && failed < 50);
		}
	}
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(results_do_not_depend_on_the_order_of_leases),
		cmocka_unit_test(chain_results_depend_only_on_seeds_and_states),
		cmocka_unit_test(extreme_light_passes_the_batch_checks),
		cmocka_unit_test(invalid_leases_are_refused),
		cmocka_unit_test(invalid_operation_fails_only_its_lease),
		cmocka_unit_test(leases_can_be_stopped),
		cmocka_unit_test(every_lease_ticks),
		cmocka_unit_test(crop_has_the_pixels_of_the_whole_film),
		cmocka_unit_test(constant_light_is_constant_to_the_border),
		cmocka_unit_test(failed_allocation_is_an_error_without_leaks),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
