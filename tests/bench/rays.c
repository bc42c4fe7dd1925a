/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The renderer's ray rate: an integrator against the same rays traced through worker/render/geom/accel.h alone, and
 * against Embree with a scene of its own.
 */
#include "tests/bench/bench.h"
#include "tests/bench/scenes.h"
#include "tests/bench/subject.h"

#include <stdio.h>

/* ratio: the least share of Embree's rate that is required; 0: none. The world stays the caller's. */
static void measure(struct world *w, const char *integrator, double least_share)
{
	struct subject s;
	struct series share = {0}, rate = {0}, door = {0}, raw = {0}, door_cost = {0}, outside = {0};
	subject_make(&s, w, integrator, NULL);
	subject_record(&s);
	double n = (double)s.count;
	for (int i = 0; i < BENCH_REPEATS; i++) {
		double begin = bench_cpu_seconds();
		uint64_t traced = subject_render(&s);
		double whole = (bench_cpu_seconds() - begin) * n / (double)traced, through = subject_replay_door(&s);
		double alone = subject_replay_raw(&s);
		series_add(&rate, 1e-6 * n / whole);
		series_add(&door, 1e-6 * n / through);
		series_add(&raw, 1e-6 * n / alone);
		series_add(&share, alone / whole);
		series_add(&door_cost, 1e9 * (through - alone) / n);
		series_add(&outside, 1e9 * (whole - alone) / n);
	}
	char name[64];
	snprintf(name, sizeof name, "%s", integrator);
	bench_row(name, &rate, "million rays/s", BENCH_INFORMS, 0);
	snprintf(name, sizeof name, "%s: its rays through the door alone", integrator);
	bench_row(name, &door, "million rays/s", BENCH_INFORMS, 0);
	snprintf(name, sizeof name, "%s: its rays by Embree alone", integrator);
	bench_row(name, &raw, "million rays/s", BENCH_INFORMS, 0);
	snprintf(name, sizeof name, "%s: share of Embree's rate", integrator);
	bench_row(name, &share, "", least_share > 0 ? BENCH_AT_LEAST : BENCH_INFORMS, least_share);
	snprintf(name, sizeof name, "%s: the door's own cost", integrator);
	bench_row(name, &door_cost, "ns/ray", BENCH_INFORMS, 0);
	snprintf(name, sizeof name, "%s: outside Embree", integrator);
	bench_row(name, &outside, "ns/ray", BENCH_INFORMS, 0);
	subject_release(&s);
}

void bench_rays(const char *bin)
{
	(void)bin;
	struct render_summary summary;
	struct world *w = bench_world_million();
	world_summary(w, &summary);
	char says[96];
	snprintf(says, sizeof says, "%.2f million triangles, diffuse and glossy, area lights",
		 1e-6 * (double)summary.triangles);
	bench_group("million", says);
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
