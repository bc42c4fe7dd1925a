/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What HSLT's mutations cost: the number of mutations made in the CPU time in which Embree alone casts a million rays;
 * rays, acceptance and failing walks; the share of time inside Embree; the breakup against its two parts unbroken.
 */
#include "tests/bench/bench.h"
#include "tests/bench/scenes.h"
#include "tests/bench/subject.h"
#include "worker/render/world/world.h"

#include <stdio.h>

/* Figures of the method's reference renderer on these scenes, measured in the same way. */
struct reference {
	const char *file;
	double mutations, rays, failed_percent;
};
static const struct reference references[] = {
	{"three-spheres.xml", 25300, 5.2, 15.6},
	{"half-sunk.xml", 19600, 6.3, 7.6},
	{"half-sunk-rough.xml", 13700, 9.6, 19.3},
};

/* Only half-vector proposals, except for the few others without which chains could not move everywhere. */
#define HSLT_ALONE "hslt=1,bidirectional=0.000001"
#define BREAKUP "hslt=0.95,bidirectional=0.05"
#define UNBROKEN "halfvec=0.475,multichain=0.475,bidirectional=0.05"

struct figures {
	double seconds, mutations, rays, accepted;
	/* occluded_walks: they arrived, but an edge of the path is occluded */
	double walks, failed_walks, occluded_walks, walks_back, failed_walks_back;
};

static double sum_range(const uint64_t *n, unsigned first, unsigned last)
{
	double s = 0;
	for (unsigned i = first; i <= last; i++)
		s += (double)n[i];
	return s;
}

static struct figures run_subject(const struct subject *s)
{
	struct batch b;
	record_walks = (struct recorded_walks){.occluded = 0};
	double begin = bench_cpu_seconds();
	subject_run(s, &b);
	const uint64_t *forward = record_walks.forward, *backward = record_walks.backward;
	struct figures f = {.seconds = bench_cpu_seconds() - begin,
			    .mutations = (double)b.counters[COUNT_SAMPLES],
			    .rays = (double)batch_ray_count(b.counters),
			    .accepted = (double)b.counters[COUNT_ACCEPTED],
			    .walks = sum_range(forward, WALK_OK, WALK_ITERATION_LIMIT),
			    .failed_walks = sum_range(forward, WALK_OK + 1, WALK_ITERATION_LIMIT),
			    .occluded_walks = (double)record_walks.occluded,
			    .walks_back = sum_range(backward, WALK_OK, WALK_ITERATION_LIMIT),
			    .failed_walks_back = sum_range(backward, WALK_OK + 1, WALK_ITERATION_LIMIT)};
	batch_fini(&b);
	return f;
}

static void measure_rate(struct world *w, const struct reference *r)
{
	struct subject mixture, hslt_alone;
	struct series rate = {0}, alone_rate = {0}, embree = {0}, rays = {0}, accepted = {0}, failed = {0},
		      occluded = {0}, back = {0}, microseconds = {0};
	subject_init(&mixture, w, "hslt", NULL);
	subject_init(&hslt_alone, w, "hslt", HSLT_ALONE);
	for (unsigned i = 0; i < BENCH_REPEATS; i++) {
		subject_reseed(&mixture, i);
		subject_reseed(&hslt_alone, i);
		double million = subject_million_rays();
		struct figures f = run_subject(&mixture), p = run_subject(&hslt_alone);
		series_add(&embree, 1 / million);
		series_add(&rate, f.mutations / f.seconds * million);
		series_add(&alone_rate, p.mutations / p.seconds * million);
		series_add(&microseconds, 1e6 * f.seconds / f.mutations);
		series_add(&rays, f.rays / f.mutations);
		series_add(&accepted, 100 * f.accepted / f.mutations);
		series_add(&failed, 100 * f.failed_walks / f.walks);
		series_add(&occluded, 100 * f.occluded_walks / f.walks);
		series_add(&back, 100 * f.failed_walks_back / f.walks_back);
	}
	printf("  %s\n  reference renderer: %.0f mutations in the time of a million rays, %.1f rays each, %.1f %% of walks fail\n",
	       mixture.plan.mutations, r->mutations, r->rays, r->failed_percent);
	bench_row("Embree alone", &embree, "million rays/s", BENCH_NO_TARGET, 0);
	bench_row("mutations in the time of a million rays", &rate, "", BENCH_AT_LEAST, 2 * r->mutations);
	bench_row("of hslt alone", &alone_rate, "", BENCH_NO_TARGET, 0);
	bench_row("a mutation", &microseconds, "us", BENCH_NO_TARGET, 0);
	bench_row("rays", &rays, "/mutation", BENCH_NO_TARGET, 0);
	bench_row("accepted", &accepted, "%", BENCH_NO_TARGET, 0);
	bench_row("walks that fail", &failed, "%", BENCH_AT_MOST, r->failed_percent);
	bench_row("of all walks, arrived but occluded", &occluded, "%", BENCH_NO_TARGET, 0);
	bench_row("walks back that fail", &back, "%", BENCH_NO_TARGET, 0);
	subject_fini(&mixture);
	subject_fini(&hslt_alone);
}

/* Share of the time that Embree alone takes for the same rays, and the rest divided by mutations. */
static void measure_share(struct world *w, double min_share)
{
	struct subject s;
	struct series share = {0}, outside = {0}, rays = {0};
	subject_init(&s, w, "hslt", NULL);
	subject_record(&s);
	for (unsigned i = 0; i < BENCH_REPEATS; i++) {
		struct figures f = run_subject(&s);
		double embree_seconds = subject_replay_embree(&s) * f.rays / (double)s.ray_count;
		series_add(&share, embree_seconds / f.seconds);
		series_add(&outside, 1e6 * (f.seconds - embree_seconds) / f.mutations);
		series_add(&rays, f.rays / f.mutations);
	}
	bench_row("share of the time inside Embree", &share, "", min_share > 0 ? BENCH_AT_LEAST : BENCH_NO_TARGET,
		  min_share);
	bench_row("outside Embree", &outside, "us/mutation", BENCH_NO_TARGET, 0);
	if (min_share > 0)
		bench_row("rays", &rays, "/mutation", BENCH_NO_TARGET, 0);
	subject_fini(&s);
}

static void measure_breakup(struct world *w)
{
	struct subject broken, unbroken;
	struct series rays = {0}, unbroken_rays = {0}, fewer = {0}, faster = {0};
	subject_init(&broken, w, "hslt", BREAKUP);
	subject_init(&unbroken, w, "hslt", UNBROKEN);
	for (unsigned i = 0; i < BENCH_REPEATS; i++) {
		subject_reseed(&broken, i);
		subject_reseed(&unbroken, i);
		struct figures b = run_subject(&broken), u = run_subject(&unbroken);
		series_add(&rays, b.rays / b.mutations);
		series_add(&unbroken_rays, u.rays / u.mutations);
		series_add(&fewer, 100 * (1 - b.rays / b.mutations / (u.rays / u.mutations)));
		series_add(&faster, b.mutations / b.seconds / (u.mutations / u.seconds));
	}
	bench_row("rays, breakup", &rays, "/mutation", BENCH_NO_TARGET, 0);
	bench_row("rays, half of them halfvec, half multichain", &unbroken_rays, "/mutation", BENCH_NO_TARGET, 0);
	bench_row("fewer rays by breaking up", &fewer, "%", BENCH_AT_LEAST, 40);
	bench_row("more mutations in the same time", &faster, "x", BENCH_NO_TARGET, 0);
	subject_fini(&broken);
	subject_fini(&unbroken);
}

void bench_hslt(const char *bin)
{
	(void)bin;
	for (size_t i = 0; i < sizeof references / sizeof *references; i++) {
		bench_group("hslt", references[i].file);
		struct world *w = bench_world(references[i].file, false, NULL);
		if (!w) {
			bench_skip("HSLT_SCENES does not name a folder with this scene");
			continue;
		}
		measure_rate(w, &references[i]);
		measure_share(w, 0);
		measure_breakup(w);
		world_free(w);
	}
	struct render_summary summary;
	struct world *w = bench_world_displaced();
	world_summary(w, &summary);
	char description[96];
	snprintf(description, sizeof description, "tests/scenes/displaced, %.2f million triangles",
		 1e-6 * (double)summary.triangles);
	bench_group("hslt", description);
	measure_share(w, 0.5);
	measure_breakup(w);
	world_free(w);
}
