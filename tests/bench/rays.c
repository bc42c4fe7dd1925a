/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The renderer's ray rate: an integrator against the same rays traced through worker/render/geom/accel.h alone, and
 * against Embree with a scene of its own.
 */
#include "tests/bench/bench.h"
#include "tests/bench/scenes.h"
#include "tests/bench/subject.h"

#include <stdio.h>

/* min_share: the least share of Embree's rate that is required; 0: none. The world stays the caller's. */
static void measure(struct world *w, const char *integrator, double min_share)
{
	struct subject s;
	struct series share = {0}, integrator_rate = {0}, accel_rate = {0}, embree_rate = {0}, accel_cost = {0},
		      outside = {0};
	subject_init(&s, w, integrator, NULL);
	subject_record(&s);
	double n = (double)s.ray_count;
	for (int i = 0; i < BENCH_REPEATS; i++) {
		double begin = bench_cpu_seconds();
		uint64_t traced = subject_render(&s);
		double render_seconds = (bench_cpu_seconds() - begin) * n / (double)traced,
		       accel_seconds = subject_replay_accel(&s);
		double embree_seconds = subject_replay_embree(&s);
		series_add(&integrator_rate, 1e-6 * n / render_seconds);
		series_add(&accel_rate, 1e-6 * n / accel_seconds);
		series_add(&embree_rate, 1e-6 * n / embree_seconds);
		series_add(&share, embree_seconds / render_seconds);
		series_add(&accel_cost, 1e9 * (accel_seconds - embree_seconds) / n);
		series_add(&outside, 1e9 * (render_seconds - embree_seconds) / n);
	}
	char name[64];
	snprintf(name, sizeof name, "%s", integrator);
	bench_row(name, &integrator_rate, "million rays/s", BENCH_NO_TARGET, 0);
	snprintf(name, sizeof name, "%s: its rays through the door alone", integrator);
	bench_row(name, &accel_rate, "million rays/s", BENCH_NO_TARGET, 0);
	snprintf(name, sizeof name, "%s: its rays by Embree alone", integrator);
	bench_row(name, &embree_rate, "million rays/s", BENCH_NO_TARGET, 0);
	snprintf(name, sizeof name, "%s: share of Embree's rate", integrator);
	bench_row(name, &share, "", min_share > 0 ? BENCH_AT_LEAST : BENCH_NO_TARGET, min_share);
	snprintf(name, sizeof name, "%s: the door's own cost", integrator);
	bench_row(name, &accel_cost, "ns/ray", BENCH_NO_TARGET, 0);
	snprintf(name, sizeof name, "%s: outside Embree", integrator);
	bench_row(name, &outside, "ns/ray", BENCH_NO_TARGET, 0);
	subject_fini(&s);
}

void bench_rays(const char *bin)
{
	(void)bin;
	struct render_summary summary;
	struct world *w = bench_world_million();
	world_summary(w, &summary);
	char description[96];
	snprintf(description, sizeof description, "%.2f million triangles, diffuse and glossy, area lights",
		 1e-6 * (double)summary.triangles);
	bench_group("million", description);
	measure(w, "path", 0.6);
	world_free(w);

	const char *name;
	w = bench_world_box(&name);
	bench_group("box", name);
	measure(w, "path", 0);
	measure(w, "bdpt", 0);
	measure(w, "pssmlt", 0);
	world_free(w);
}
