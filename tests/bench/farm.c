/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Benchmarks farm, memory and sending: a coordinator with workers on loopback against hslt-render on the same plan, in
 * CPU time and throughput; peak memory of coordinator and worker; bytes that hslt-submit sends the first and the second
 * time. If a program is not built, the benchmark is skipped with a message; a program that fails ends the bench.
 */
#include "common/base/mem.h"
#include "common/plan/plan.h"
#include "tests/bench/bench.h"
#include "tests/bench/process.h"
#include "tests/bench/relay.h"
#include "tests/bench/scenes.h"
#include "worker/render/world/world.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct farm_processes {
	const char *bin;
	char folder[64], log[128], address[64];
	struct process coordinator, worker[2];
};

static void start_coordinator(struct farm_processes *f)
{
	char port_file[128], port[16] = "";
	snprintf(port_file, sizeof port_file, "%s/port", f->folder);
	unlink(port_file);
	process_start(&f->coordinator, f->bin, f->log,
		      "hslt-coordinator --listen 127.0.0.1:0 --port-file %s --spool %s/spool --status-socket %s/status",
		      port_file, f->folder, f->folder);
	for (int i = 0; i < 200 && !strchr(port, '\n'); i++) {
		usleep(50000);
		FILE *file = fopen(port_file, "r");
		if (file && !fgets(port, sizeof port, file))
			port[0] = 0;
		if (file)
			fclose(file);
		if (port[0] && !strchr(port, '\n'))
			strcat(port, "\n");
	}
	port[strcspn(port, "\n")] = 0;
	snprintf(f->address, sizeof f->address, "127.0.0.1:%s", port);
}

static void farm_processes_start(struct farm_processes *f, const char *bin, int workers)
{
	*f = (struct farm_processes){.bin = bin, .folder = "/tmp/hslt-bench.XXXXXX"};
	process_make_folder(f->folder);
	snprintf(f->log, sizeof f->log, "%s/log", f->folder);
	start_coordinator(f);
	for (int i = 0; i < workers; i++)
		process_start(&f->worker[i], bin, f->log,
			      "hslt-worker --coordinator %s --threads 1 --name w%d --cache %s/cache", f->address, i,
			      f->folder);
}

static void farm_processes_stop(struct farm_processes *f)
{
	for (int i = 0; i < 2; i++)
		if (f->worker[i].pid)
			process_stop(&f->worker[i]);
	process_stop(&f->coordinator);
	process_remove_folder(f->folder);
}

static void start_submit(const struct farm_processes *f, struct process *p, const char *scene, const char *options)
{
	process_start(p, f->bin, f->log, "hslt-submit --coordinator %s %s -o %s/farm.exr --wait %s", f->address, scene,
		      f->folder, options);
}

static void submit_and_wait(const struct farm_processes *f, const char *scene, const char *options)
{
	struct process p;
	start_submit(f, &p, scene, options);
	process_wait(&p);
}

static void start_render(const struct farm_processes *f, struct process *p, const char *options, int index)
{
	process_start(p, f->bin, f->log, "hslt-render %s -o %s/render%d.exr --threads 1 %s", bench_box_path(),
		      f->folder, index, options);
}

/* 32 mutations per pixel, as for a quick preview: longer jobs send less per mutation. */
enum { MUTATIONS = 1 << 19 };
#define JOB_OPTIONS "--integrator pssmlt --size 128x128 --bootstrap 65536 --mutations 524288"
#define DOUBLE_JOB_OPTIONS "--integrator pssmlt --size 128x128 --bootstrap 131072 --mutations 1048576"

static void measure_cpu_per_mutation(const char *bin)
{
	struct farm_processes f;
	struct series worker = {0}, both = {0}, render_alone = {0};
	farm_processes_start(&f, bin, 1);
	submit_and_wait(&f, bench_box_path(), JOB_OPTIONS);
	for (int i = 0; i < BENCH_REPEATS; i++) {
		struct process render;
		start_render(&f, &render, JOB_OPTIONS, 0);
		process_wait(&render);
		double w = process_cpu_seconds(&f.worker[0]), c = process_cpu_seconds(&f.coordinator);
		submit_and_wait(&f, bench_box_path(), JOB_OPTIONS);
		w = process_cpu_seconds(&f.worker[0]) - w;
		c = process_cpu_seconds(&f.coordinator) - c;
		series_add(&render_alone, 1e6 * render.cpu_seconds / MUTATIONS);
		series_add(&worker, w / render.cpu_seconds);
		series_add(&both, (w + c) / render.cpu_seconds);
	}
	bench_row("hslt-render, with its bootstrap", &render_alone, "us/mutation", BENCH_NO_TARGET, 0);
	bench_row("CPU of one worker / hslt-render", &worker, "", BENCH_NO_TARGET, 0);
	bench_row("CPU of worker and coordinator / hslt-render", &both, "", BENCH_AT_MOST, 1.03);
	farm_processes_stop(&f);
}

static void measure_two_workers(const char *bin)
{
	struct farm_processes f;
	struct series ratio = {0};
	farm_processes_start(&f, bin, 2);
	submit_and_wait(&f, bench_box_path(), JOB_OPTIONS);
	for (int i = 0; i < BENCH_REPEATS; i++) {
		struct process render[2];
		double begin = process_wall_seconds();
		for (int k = 0; k < 2; k++)
			start_render(&f, &render[k], JOB_OPTIONS, k);
		for (int k = 0; k < 2; k++)
			process_wait(&render[k]);
		double middle = process_wall_seconds();
		submit_and_wait(&f, bench_box_path(), DOUBLE_JOB_OPTIONS);
		series_add(&ratio, (middle - begin) / (process_wall_seconds() - middle));
	}
	bench_row("two workers / two hslt-render, throughput", &ratio, "", BENCH_AT_LEAST, 0.95);
	farm_processes_stop(&f);
}

/* Returns the peak memory of a coordinator that ran one job. */
static double coordinator_peak(const char *bin, const char *options)
{
	struct farm_processes f;
	farm_processes_start(&f, bin, 1);
	submit_and_wait(&f, bench_box_path(), options);
	double peak = process_peak_bytes(&f.coordinator, NULL);
	farm_processes_stop(&f);
	return peak;
}

static void measure_coordinator_memory(const char *bin)
{
#define SMALL_JOB_OPTIONS "--integrator path --size 128x128 --groups 16 --epoch 1 "
	/* Three rounds touch all films: for each group the sum of complete rounds, and the two open rounds. */
	double films = 16 * 3 * 8.0 * 3 * 128 * 128, few = coordinator_peak(bin, SMALL_JOB_OPTIONS "--spp 48"),
	       many = coordinator_peak(bin, SMALL_JOB_OPTIONS "--spp 1536");
	bench_single("coordinator's peak, 3 rounds of leases", 1e-6 * few, "MB", BENCH_NO_TARGET, 0);
	bench_single("coordinator's peak, 96 rounds of leases", 1e-6 * many, "MB", BENCH_AT_MOST,
		     1e-6 * (100e6 + films));
	bench_single("growth from 3 to 96 rounds", 1e-6 * (many - few), "MB", BENCH_AT_MOST, 2);
}

static double mesh_bytes(const struct world *w)
{
	double sum = 0;
	for (uint32_t i = 0; i < w->shape_count; i++) {
		const struct geom_shape *g = &w->shapes[i];
		size_t vertex =
			sizeof g->position[0] + (g->normal ? sizeof g->normal[0] : 0) + (g->uv ? sizeof g->uv[0] : 0);
		sum += (double)g->vertex_count * (double)vertex + (double)g->triangle_count * sizeof g->index[0];
	}
	return sum;
}

static void measure_worker_memory(const char *bin)
{
	struct farm_processes f;
	char scene[128];
	struct world *w = bench_world_million();
	double embree = (double)accel_bytes(w->accel), building = (double)accel_peak_bytes(w->accel),
	       meshes = mesh_bytes(w);
	double pixels = (double)w->settings.width * w->settings.height, films = pixels * (24 + 12);
	world_free(w);
	farm_processes_start(&f, bin, 1);
	usleep(500000);
	double idle = process_peak_bytes(&f.worker[0], NULL);
	bench_write_million(f.folder);
	snprintf(scene, sizeof scene, "%s/million.xml", f.folder);
	struct process job;
	struct series size = {0};
	double current_bytes, peak = 0, mesh_and_film_bytes = meshes + films;
	start_submit(&f, &job, scene, "--integrator path --spp 192");
	while (process_is_running(&job)) {
		usleep(250000);
		peak = process_peak_bytes(&f.worker[0], &current_bytes);
		series_add(&size, 1e-6 * current_bytes);
	}
	process_wait(&job);
	bench_single("worker without a job", 1e-6 * idle, "MB", BENCH_NO_TARGET, 0);
	bench_row("worker on a million triangles, looked at 4/s", &size, "MB", BENCH_NO_TARGET, 0);
	bench_single("its peak, while it built the world", 1e-6 * peak, "MB", BENCH_NO_TARGET, 0);
	bench_single("of it: Embree's own", 1e-6 * embree, "MB", BENCH_NO_TARGET, 0);
	bench_single("of it: Embree's own while it builds", 1e-6 * building, "MB", BENCH_NO_TARGET, 0);
	bench_single("of it: meshes", 1e-6 * meshes, "MB", BENCH_NO_TARGET, 0);
	bench_single("of it: a lease's film and tiles", 1e-6 * films, "MB", BENCH_NO_TARGET, 0);
	bench_single("size / (Embree + meshes + films)", 1e6 * series_median(&size) / (embree + mesh_and_film_bytes),
		     "", BENCH_AT_MOST, 1.2);
	bench_single("peak / (Embree building + meshes + films)", peak / (building + mesh_and_film_bytes), "",
		     BENCH_AT_MOST, 1.2);
	farm_processes_stop(&f);
}

enum { SENT_CELLS = 930 };

/* Returns the seconds of a submission; *bytes: the bytes that it sent. */
static double send_scene(const struct farm_processes *f, const struct relay *r, uint16_t port, unsigned seed,
			 double *bytes)
{
	struct process p;
	uint64_t before = relay_sent_bytes(r);
	process_start(
		&p, f->bin, f->log,
		"hslt-submit --coordinator 127.0.0.1:%u %s/wavy.xml -o %s/sent.exr --integrator path --spp 1 --seed %u",
		port, f->folder, f->folder, seed);
	process_wait(&p);
	*bytes = (double)(relay_sent_bytes(r) - before);
	return p.cpu_seconds;
}

/* Submits without any worker, so that nothing is rendered. */
static void measure_sending(const char *bin)
{
	static const char xml[] =
		"<scene version='3.0.0'><sensor type='perspective'/><emitter type='constant'/><shape type='ply'>"
		"<string name='filename' value='wavy.ply'/></shape></scene>";
	struct farm_processes f;
	uint16_t port;
	farm_processes_start(&f, bin, 0);
	struct bench_file ply = bench_make_wavy_ply(SENT_CELLS);
	double size = (double)(ply.size + sizeof xml - 1), first, second;
	bench_write_file(f.folder, "wavy.ply", ply.bytes, ply.size);
	bench_write_file(f.folder, "wavy.xml", xml, sizeof xml - 1);
	mem_free(ply.bytes);
	struct relay *r = relay_start((uint16_t)atoi(strchr(f.address, ':') + 1), &port);
	double cpu_first = send_scene(&f, r, port, 1, &first), cpu_second = send_scene(&f, r, port, 2, &second);
	relay_stop(r);
	bench_single("scene with a mesh: its files", 1e-6 * size, "MB", BENCH_NO_TARGET, 0);
	bench_single("first submission: bytes sent / bytes of files", first / size, "", BENCH_AT_MOST, 1.01);
	bench_single("second submission: bytes sent", second, "bytes", BENCH_AT_MOST, 10000);
	bench_single("second / first", second / first, "", BENCH_NO_TARGET, 0);
	bench_single("CPU of hslt-submit: second / first", cpu_second / cpu_first, "", BENCH_NO_TARGET, 0);
	farm_processes_stop(&f);
}

/* Returns whether all programs are there; names the missing one. */
static bool has_programs(const char *bin)
{
	static const char *const needed[] = {"hslt-coordinator", "hslt-worker", "hslt-submit", "hslt-render"};
	for (size_t i = 0; i < sizeof needed / sizeof *needed; i++)
		if (!process_program_exists(bin, needed[i])) {
			char why[128];
			snprintf(why, sizeof why, "%s is not built", needed[i]);
			bench_skip(why);
			return false;
		}
	return true;
}

void bench_sending(const char *bin)
{
	bench_group("sending", "hslt-submit and hslt-coordinator on loopback: a scene submitted twice");
	if (has_programs(bin))
		measure_sending(bin);
}

void bench_farm(const char *bin)
{
	bench_group("farm", "real processes on loopback, pssmlt");
	if (!has_programs(bin))
		return;
	measure_cpu_per_mutation(bin);
	measure_two_workers(bin);
}

void bench_memory(const char *bin)
{
	bench_group("memory", "resident sizes of real processes");
	if (!has_programs(bin))
		return;
	measure_coordinator_memory(bin);
	measure_worker_memory(bin);
}
