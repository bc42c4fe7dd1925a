/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The load test's options, phases and report (docs/benchmarks.md has measured figures).
 *
 * It makes certificates, starts the coordinator, connects the fake workers of load_worker at the rate of --ramp, lets
 * each send a batch, and then measures for --minutes: processor time, memory and bytes written by the coordinator,
 * durations of leases, delays of its loop. At the end the content of the images is compared with the results that were
 * acknowledged to workers as merged. If a bound is missed, the exit code is 1.
 */
#include "tests/load/load.h"

#include "common/base/mem.h"
#include "tests/bench/process.h"
#include "tests/support/first_address.h"

#include <argp.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static const char doc[] =
	"Fake workers on loopback against the real coordinator: what it costs, how fast it answers, whether anything is lost."
	"\v"
	"Ends with 1 when a bound is missed: no lease lost, less than one core, less than 1 GB beyond the films, 99 % of the leases "
	"within 100 ms.";

enum {
	OPTION_BIN = 256,
	OPTION_MINUTES,
	OPTION_SIZE,
	OPTION_INTERVAL,
	OPTION_INSECURE,
	OPTION_JOBS,
	OPTION_GROUPS,
	OPTION_PARTS,
	OPTION_DYING,
	OPTION_LYING,
	OPTION_HOARDING,
	OPTION_HANGING,
	OPTION_RAMP,
	OPTION_SPOOL,
	OPTION_WANT,
	OPTION_HEARTBEAT,
	OPTION_COORDINATOR,
	OPTION_LOSSES
};

static const struct argp_option options[] = {
	{"workers", 'w', "N", 0, "Connected workers (1000)", 0},
	{"minutes", OPTION_MINUTES, "M", 0,
	 "How long is measured, once all are connected and each has sent a batch (10)", 0},
	{"size", OPTION_SIZE, "WxH", 0, "Film of each job (1280x720)", 0},
	{"interval", OPTION_INTERVAL, "SECONDS", 0, "Between a worker's batches (60)", 0},
	{"jobs", OPTION_JOBS, "N", 0, "Jobs at once (as many as keep all of them busy, and one)", 0},
	{"groups", OPTION_GROUPS, "N", 0, "Of each job (16)", 0},
	{"parts", OPTION_PARTS, "N", 0, "Of each job (64)", 0},
	{"want", OPTION_WANT, "N", 0, "Leases that a worker holds: the one it works on, and others at hand (2)", 0},
	{"dying", OPTION_DYING, "N", 0, "Of the workers so many die in a third of their leases, and call again (0)", 0},
	{"lying", OPTION_LYING, "N", 0, "... send results that cannot be (0)", 0},
	{"hoarding", OPTION_HOARDING, "N", 0, "... claim 4,096 threads, take leases and give nothing (0)", 0},
	{"hanging", OPTION_HANGING, "N", 0,
	 "... stand still in a third of their leases, until they are disconnected (0)", 0},
	{"ramp", OPTION_RAMP, "N", 0, "New connections a second (100)", 0},
	{"heartbeat", OPTION_HEARTBEAT, "SECONDS", 0, "Of the coordinator (5)", 0},
	{"spool", OPTION_SPOOL, "DIR", 0, "Where a folder for spool, certificates and logs is made and removed (/tmp)",
	 0},
	{"insecure", OPTION_INSECURE, NULL, 0, "Without TLS", 0},
	{"coordinator", OPTION_COORDINATOR, "OPTIONS", 0, "More options for the coordinator", 0},
	{"losses", OPTION_LOSSES, NULL, 0, "Only what is lost or wrong counts, not how fast it is", 0},
	{"bin", OPTION_BIN, "DIR", 0, "The programs (build/bin)", 0},
	{0},
};

static struct load load;
static struct process coordinator;
static char folder[256], log_file[300], status_socket[300];

void load_die(const char *format, ...)
{
	va_list ap;
	va_start(ap, format);
	fputs("load: ", stderr);
	vfprintf(stderr, format, ap);
	fputc('\n', stderr);
	va_end(ap);
	if (*folder)
		fprintf(stderr, "load: %s stays for a look\n", folder);
	exit(2);
}

double load_now(void)
{
	return (double)uv_hrtime() * 1e-9;
}

double load_uniform(struct load *l)
{
	l->random = l->random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
	return (double)(l->random >> 11) * 0x1p-53;
}

/* ---- options */

static double parse_between(struct argp_state *state, const char *arg, double min, double max)
{
	char *end;
	double x = strtod(arg, &end);
	if (end == arg || *end || !(x >= min && x <= max))
		argp_error(state, "a number from %g to %g, not '%s'", min, max, arg);
	return x;
}

static error_t parse_option(int key, char *arg, struct argp_state *state)
{
	struct load_settings *s = &load.settings;
	switch (key) {
	case 'w':
		s->workers = (unsigned)parse_between(state, arg, 1, 100000);
		return 0;
	case OPTION_MINUTES:
		s->minutes = parse_between(state, arg, 0.05, 1e4);
		return 0;
	case OPTION_SIZE:
		if (sscanf(arg, "%ux%u", &s->width, &s->height) != 2)
			argp_error(state, "--size takes WxH");
		return 0;
	case OPTION_INTERVAL:
		s->interval_seconds = parse_between(state, arg, 0.1, 3600);
		return 0;
	case OPTION_JOBS:
		s->jobs = (unsigned)parse_between(state, arg, 1, 64);
		return 0;
	case OPTION_GROUPS:
		s->groups = (unsigned)parse_between(state, arg, 1, PLAN_GROUPS_MAX);
		return 0;
	case OPTION_PARTS:
		s->parts = (unsigned)parse_between(state, arg, 1, PLAN_PARTS_MAX);
		return 0;
	case OPTION_WANT:
		s->leases_per_worker = (unsigned)parse_between(state, arg, 1, 4);
		return 0;
	case OPTION_DYING:
		s->misbehaving[LOAD_DYING] = (unsigned)parse_between(state, arg, 0, 1e5);
		return 0;
	case OPTION_LYING:
		s->misbehaving[LOAD_LYING] = (unsigned)parse_between(state, arg, 0, 1e5);
		return 0;
	case OPTION_HOARDING:
		s->misbehaving[LOAD_HOARDING] = (unsigned)parse_between(state, arg, 0, 1e5);
		return 0;
	case OPTION_HANGING:
		s->misbehaving[LOAD_HANGING] = (unsigned)parse_between(state, arg, 0, 1e5);
		return 0;
	case ARGP_KEY_END:
		if (s->misbehaving[LOAD_DYING] + s->misbehaving[LOAD_LYING] + s->misbehaving[LOAD_HOARDING] +
			    s->misbehaving[LOAD_HANGING] >=
		    s->workers)
			argp_error(state, "one worker at least must be honest");
		return 0;
	case OPTION_RAMP:
		s->connections_per_second = parse_between(state, arg, 1, 1e4);
		return 0;
	case OPTION_HEARTBEAT:
		s->heartbeat_seconds = parse_between(state, arg, 0.1, 3600);
		return 0;
	case OPTION_SPOOL:
		s->spool = arg;
		return 0;
	case OPTION_INSECURE:
		s->insecure = true;
		return 0;
	case OPTION_LOSSES:
		s->only_losses = true;
		return 0;
	case OPTION_COORDINATOR:
		s->coordinator_options = arg;
		return 0;
	case OPTION_BIN:
		s->bin = arg;
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

/* ---- the coordinator */

__attribute__((format(printf, 1, 2))) static void run_shell(const char *format, ...)
{
	char command[4096];
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(command, sizeof command, format, ap);
	va_end(ap);
	if (n < 0 || (size_t)n >= sizeof command || system(command) != 0)
		load_die("%s failed", command);
}

static void make_certificates(void)
{
	setenv("HSLT_CA", folder, 1);
	run_shell("cd %s && %s/hslt-ca init >log 2>&1", folder, load.settings.bin);
	run_shell("cd %s && %s/hslt-ca worker crowd >>log 2>&1", folder, load.settings.bin);
	run_shell("cd %s && %s/hslt-ca client ann >>log 2>&1", folder, load.settings.bin);
}

static void start_coordinator(char *host_port, size_t size)
{
	char port_file[300], tls[300] = "", port[16] = "";
	struct error e;
	snprintf(folder, sizeof folder, "%s/hslt-load.XXXXXX", load.settings.spool);
	if (!mkdtemp(folder))
		load_die("no folder in %s", load.settings.spool);
	snprintf(log_file, sizeof log_file, "%s/log", folder);
	snprintf(status_socket, sizeof status_socket, "%s/status", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	if (!load.settings.insecure) {
		make_certificates();
		snprintf(tls, sizeof tls, " --tls %s/coordinator", folder);
	}
	process_start(
		&coordinator, load.settings.bin, log_file,
		"hslt-coordinator --listen 127.0.0.1:0 --port-file %s --spool %s/spool --status-socket %s --heartbeat %g%s %s",
		port_file, folder, status_socket, load.settings.heartbeat_seconds, tls,
		load.settings.coordinator_options);
	for (int i = 0; i < 1200 && !*port; i++) {
		usleep(50000);
		FILE *f = fopen(port_file, "r");
		if (f && !fgets(port, sizeof port, f))
			*port = 0;
		if (f)
			fclose(f);
	}
	port[strcspn(port, "\n")] = 0;
	if (!*port)
		load_die("the coordinator does not listen");
	snprintf(host_port, size, "127.0.0.1:%s", port);
	snprintf(tls, sizeof tls, "%s/crowd", folder);
	if (first_address_resolve(&load.address, host_port, &e) ||
	    (!load.settings.insecure && tls_open(&load.tls, tls, &e)))
		load_die("%s", e.text);
}

static double status_bytes(const char *name)
{
	char path[64], line[256], format[64];
	double kb = 0;
	snprintf(path, sizeof path, "/proc/%d/status", (int)coordinator.pid);
	snprintf(format, sizeof format, "%s:", name);
	FILE *f = fopen(path, "r");
	while (f && fgets(line, sizeof line, f))
		if (strncmp(line, format, strlen(format)) == 0)
			kb = strtod(line + strlen(format), NULL);
	if (f)
		fclose(f);
	return 1024 * kb;
}

static double bytes_written(void)
{
	char path[64], line[256];
	double n = 0;
	snprintf(path, sizeof path, "/proc/%d/io", (int)coordinator.pid);
	FILE *f = fopen(path, "r");
	while (f && fgets(line, sizeof line, f))
		if (strncmp(line, "write_bytes:", 12) == 0)
			n = strtod(line + 12, NULL);
	if (f)
		fclose(f);
	return n;
}

/* ---- the run */

static struct {
	uv_timer_t connect, phase, lag;
	double begin_time, end_time, last_lag_time, coordinator_cpu[2], generator_cpu[2], written[2], anonymous,
		load_average;
} run_state;

static double generator_cpu_seconds(void)
{
	struct rusage r;
	getrusage(RUSAGE_SELF, &r);
	return (double)(r.ru_utime.tv_sec + r.ru_stime.tv_sec) +
	       1e-6 * (double)(r.ru_utime.tv_usec + r.ru_stime.tv_usec);
}

static void record_usage(int index)
{
	run_state.coordinator_cpu[index] = process_cpu_seconds(&coordinator);
	run_state.generator_cpu[index] = generator_cpu_seconds();
	run_state.written[index] = bytes_written();
	*(index ? &run_state.end_time : &run_state.begin_time) = load_now();
}

static void on_connect(uv_timer_t *t)
{
	unsigned n = (unsigned)fmax(1, load.settings.connections_per_second / 20);
	for (; n > 0 && load.connecting < load.settings.workers; n--)
		load_connect(&load, load.connecting++);
	if (load.connecting == load.settings.workers)
		uv_close((uv_handle_t *)t, NULL);
}

static void finish_load(void)
{
	uv_close((uv_handle_t *)&run_state.phase, NULL);
	uv_close((uv_handle_t *)&run_state.lag, NULL);
	load_disconnect_all(&load);
}

/* Runs once a second: connects, then measures, then leaves. */
static void on_phase(uv_timer_t *t)
{
	(void)t;
	double now = load_now(), anonymous = status_bytes("RssAnon");
	run_state.anonymous = fmax(run_state.anonymous, anonymous);
	if (!process_is_running(&coordinator))
		load_die("the coordinator has ended");
	if (!load.is_measuring && !load.is_leaving &&
	    load.connected_count + load.settings.misbehaving[LOAD_DYING] + load.settings.misbehaving[LOAD_HANGING] >=
		    load.settings.workers &&
	    load.merged >= load.settings.workers) {
		load.is_measuring = true;
		record_usage(0);
		fprintf(stderr, "load: %u workers are connected and have sent a batch; measuring\n",
			load.connected_count);
	} else if (load.is_measuring && now - run_state.begin_time >= 60 * load.settings.minutes) {
		double average[3];
		run_state.load_average = getloadavg(average, 3) > 0 ? average[0] : NAN;
		record_usage(1);
		load.is_measuring = false;
		load_wind_down(&load);
	} else if (load.is_leaving && (load_unacknowledged_count(&load) == 0 || now - run_state.end_time > 120)) {
		finish_load();
	} else if (load.faults && !load.is_measuring && !load.is_leaving &&
		   load.disconnected > load.settings.workers / 2) {
		load_die("%s", load.first_fault);
	}
}

/* Measures the delay of the generator itself, which limits what it can measure. */
static void on_lag(uv_timer_t *t)
{
	double now = load_now();
	(void)t;
	if (load.is_measuring && run_state.last_lag_time > 0)
		load_times_add(&load.timer_delays, fmax(0, 1000 * (now - run_state.last_lag_time) - 10));
	run_state.last_lag_time = now;
}

static void run_loop(void)
{
	uv_timer_init(&load.loop, &run_state.connect);
	uv_timer_init(&load.loop, &run_state.phase);
	uv_timer_init(&load.loop, &run_state.lag);
	uv_timer_start(&run_state.connect, on_connect, 0, 50);
	uv_timer_start(&run_state.phase, on_phase, 1000, 1000);
	uv_timer_start(&run_state.lag, on_lag, 10, 10);
	uv_run(&load.loop, UV_RUN_DEFAULT);
}

/* ---- the table */

static void print_times(const char *label, struct load_times *t)
{
	printf("%-46s %9.2f %9.2f %9.2f ms  (%zu)\n", label, load_times_quantile(t, 0.5), load_times_quantile(t, 0.99),
	       load_times_quantile(t, 1), t->count);
}

static bool check_bound(const char *label, double value, const char *unit, double bound, bool strict)
{
	bool met = strict ? value < bound : value <= bound;
	printf("%-46s %9.3g %s, bound %g: %s\n", label, value, unit, bound, met ? "met" : "MISSED");
	return met;
}

/* Returns the number of batches that are in the sums more or less often than they were acknowledged. */
static double count_miscounted(void)
{
	uint64_t counted = 0;
	for (unsigned i = 0; i < load.job_count; i++)
		counted += (uint64_t)load_counted_mutations(&load, status_socket, load.jobs[i].id);
	const struct plan *p = &load.jobs[0].plan;
	uint64_t lease = plan_round_mutations(p) / (p->groups * p->parts);
	return fabs((double)counted / (double)lease - (double)load.merged);
}

static int report(double miscounted, double peak)
{
	const struct plan *p = &load.jobs[0].plan;
	double seconds = run_state.end_time - run_state.begin_time,
	       cores = (run_state.coordinator_cpu[1] - run_state.coordinator_cpu[0]) / seconds;
	double films = 72.0 * p->crop_width * p->crop_height * p->groups * load.job_count;
	double lost = (double)(load_unacknowledged_count(&load) + load.refused);
	printf("%u workers, %ux%u, a batch each %g s, %s, %u jobs of %u leases a round, %.1f minutes, load %.2f\n",
	       load.settings.workers, load.settings.width, load.settings.height, load.settings.interval_seconds,
	       load.settings.insecure ? "plaintext" : "TLS", load.job_count, p->groups * p->parts, seconds / 60,
	       run_state.load_average);
	printf("%-46s %9.3g MB\n", "a batch", 1e-6 * (double)load_content_payload_bytes(load.content));
	printf("%-46s %9.1f /s, %.1f MB/s\n", "batches", (double)load.batches / seconds,
	       1e-6 * (double)load.bytes / seconds);
	printf("%-46s %9.1f MB/s\n", "written to the disk",
	       1e-6 * (run_state.written[1] - run_state.written[0]) / seconds);
	printf("%-46s %9.2f s of %.2f s; in all %.1f s\n", "coordinator's processor",
	       run_state.coordinator_cpu[1] - run_state.coordinator_cpu[0], seconds, coordinator.cpu_seconds);
	printf("%-46s %9.1f ms\n", "... of it for each batch",
	       1000 * (run_state.coordinator_cpu[1] - run_state.coordinator_cpu[0]) / (double)load.batches);
	printf("%-46s %9.2f s\n", "generator's processor", run_state.generator_cpu[1] - run_state.generator_cpu[0]);
	printf("%-46s %9.3g GB peak, %.3g GB films, %.3g GB not from files\n", "coordinator's memory", 1e-9 * peak,
	       1e-9 * films, 1e-9 * run_state.anonymous);
	printf("%-46s %9s %9s %9s\n", "", "p50", "p99", "max");
	print_times("result handed over -> next lease", &load.grant_times);
	print_times("first lease request -> lease", &load.first_grant_times);
	print_times("result handed over -> acknowledged", &load.ack_times);
	print_times("heartbeat -> answer", &load.heartbeat_times);
	print_times("result to the kernel", &load.send_times);
	print_times("generator's timer late", &load.timer_delays);
	printf("leases: %llu granted, %llu merged, %llu of bootstraps, %llu given back at the end, %llu copies taken "
	       "back, %llu again to the same, %llu repeats\n",
	       (unsigned long long)load.grants, (unsigned long long)load.merged,
	       (unsigned long long)load.bootstrap_merged, (unsigned long long)load.returned,
	       (unsigned long long)load.revoked, (unsigned long long)load.granted_again,
	       (unsigned long long)load.repeated);
	const unsigned *misbehaving = load.settings.misbehaving;
	printf("bad workers: %u die (%llu deaths), %u lie (%llu results, %llu refused), %u hoard (%llu leases), %u hang (%llu times)\n",
	       misbehaving[LOAD_DYING], (unsigned long long)load.deaths, misbehaving[LOAD_LYING],
	       (unsigned long long)load.lies, (unsigned long long)load.lies_refused, misbehaving[LOAD_HOARDING],
	       (unsigned long long)load.hoarded, misbehaving[LOAD_HANGING], (unsigned long long)load.hangs);
	if (load.faults)
		printf("faults: %llu, the first: %s\n", (unsigned long long)load.faults, load.first_fault);
	bool met = check_bound("leases lost", lost, "", 0, false);
	met &= check_bound("acknowledged out of order", (double)load.out_of_order, "", 0, false);
	met &= check_bound("merged more or less than once", miscounted, "", 0, false);
	met &= check_bound("wrong results that count", (double)load.lies_merged, "", 0, false);
	met &= check_bound("coordinator's exit code", coordinator.exit_code, "", 0, false);
	met &= check_bound("connections lost, faults", (double)(load.disconnected + load.faults), "", 0, false);
	if (load.settings.only_losses)
		return met ? 0 : 1;
	met &= check_bound("coordinator", cores, "cores", 1, true);
	met &= check_bound("memory beyond the films", 1e-9 * (peak - films), "GB", 1, true);
	met &= check_bound("p99 of a lease", load_times_quantile(&load.grant_times, 0.99), "ms", 100, true);
	return met ? 0 : 1;
}

static void prepare_load(const char *host_port)
{
	char tls[300] = "";
	struct rlimit files;
	if (!load.settings.insecure)
		snprintf(tls, sizeof tls, "%s/ann", folder);
	getrlimit(RLIMIT_NOFILE, &files);
	files.rlim_cur = files.rlim_max;
	setrlimit(RLIMIT_NOFILE, &files);
	unsigned slots = load.settings.groups * load.settings.parts;
	load.job_count = load.settings.jobs
				 ? load.settings.jobs
				 : (load.settings.workers * load.settings.leases_per_worker + slots - 1) / slots + 1;
	load.jobs = mem_alloc(load.job_count, sizeof *load.jobs);
	load.workers = load_workers_new(load.settings.workers);
	if (!load.jobs || !load.workers || load.job_count > 64)
		load_die("no room for so many jobs or workers");
	for (unsigned i = 0; i < load.job_count; i++)
		load_submit(&load, host_port, tls, i);
	load.content = load_content_new(&load.jobs[0].plan);
}

int main(int argc, char **argv)
{
	char host_port[64];
	mem_retain_freed(64 << 20);
	load.settings = (struct load_settings){.workers = 1000,
					       .width = 1280,
					       .height = 720,
					       .groups = 16,
					       .parts = 64,
					       .minutes = 10,
					       .interval_seconds = 60,
					       .connections_per_second = 100,
					       .heartbeat_seconds = 5,
					       .leases_per_worker = 2,
					       .bin = "build/bin",
					       .spool = "/tmp",
					       .coordinator_options = ""};
	load.random = 1;
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse_option, NULL, doc, NULL, NULL, NULL}, argc, argv, 0, NULL,
		   &load.settings);
	char *bin = realpath(load.settings.bin, NULL);
	load.settings.bin = bin ? bin : load.settings.bin;
	signal(SIGPIPE, SIG_IGN);
	start_coordinator(host_port, sizeof host_port);
	prepare_load(host_port);
	uv_loop_init(&load.loop);
	run_loop();
	double miscounted = count_miscounted(), peak = process_peak_bytes(&coordinator, NULL);
	process_stop(&coordinator);
	int code = report(miscounted, peak);
	load_content_free(load.content);
	tls_close(load.tls);
	run_shell("rm -rf %s", folder);
	free(bin);
	return code;
}
