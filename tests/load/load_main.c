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

static double parse_between(struct argp_state *state, const char *arg, double least, double most)
{
	char *end;
	double x = strtod(arg, &end);
	if (end == arg || *end || !(x >= least && x <= most))
		argp_error(state, "a number from %g to %g, not '%s'", least, most, arg);
	return x;
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct load_settings *s = &load.s;
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
		s->interval = parse_between(state, arg, 0.1, 3600);
		return 0;
	case OPTION_JOBS:
		s->jobs = (unsigned)parse_between(state, arg, 1, 64);
		return 0;
	case OPTION_GROUPS:
		s->groups = (unsigned)parse_between(state, arg, 1, PLAN_MAX_GROUPS);
		return 0;
	case OPTION_PARTS:
		s->parts = (unsigned)parse_between(state, arg, 1, PLAN_MAX_PARTS);
		return 0;
	case OPTION_WANT:
		s->want = (unsigned)parse_between(state, arg, 1, 4);
		return 0;
	case OPTION_DYING:
		s->bad[LOAD_DIES] = (unsigned)parse_between(state, arg, 0, 1e5);
		return 0;
	case OPTION_LYING:
		s->bad[LOAD_LIES] = (unsigned)parse_between(state, arg, 0, 1e5);
		return 0;
	case OPTION_HOARDING:
		s->bad[LOAD_HOARDS] = (unsigned)parse_between(state, arg, 0, 1e5);
		return 0;
	case OPTION_HANGING:
		s->bad[LOAD_HANGS] = (unsigned)parse_between(state, arg, 0, 1e5);
		return 0;
	case ARGP_KEY_END:
		if (s->bad[LOAD_DIES] + s->bad[LOAD_LIES] + s->bad[LOAD_HOARDS] + s->bad[LOAD_HANGS] >= s->workers)
			argp_error(state, "one worker at least must be honest");
		return 0;
	case OPTION_RAMP:
		s->ramp = parse_between(state, arg, 1, 1e4);
		return 0;
	case OPTION_HEARTBEAT:
		s->heartbeat = parse_between(state, arg, 0.1, 3600);
		return 0;
	case OPTION_SPOOL:
		s->spool = arg;
		return 0;
	case OPTION_INSECURE:
		s->insecure = true;
		return 0;
	case OPTION_LOSSES:
		s->losses = true;
		return 0;
	case OPTION_COORDINATOR:
		s->options = arg;
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
	run_shell("cd %s && %s/hslt-ca init >log 2>&1", folder, load.s.bin);
	run_shell("cd %s && %s/hslt-ca worker crowd >>log 2>&1", folder, load.s.bin);
	run_shell("cd %s && %s/hslt-ca client ann >>log 2>&1", folder, load.s.bin);
}

static void start(char *host_port, size_t size)
{
	char port_file[300], tls[300] = "", port[16] = "";
	struct error e;
	snprintf(folder, sizeof folder, "%s/hslt-load.XXXXXX", load.s.spool);
	if (!mkdtemp(folder))
		load_die("no folder in %s", load.s.spool);
	snprintf(log_file, sizeof log_file, "%s/log", folder);
	snprintf(status_socket, sizeof status_socket, "%s/status", folder);
	snprintf(port_file, sizeof port_file, "%s/port", folder);
	if (!load.s.insecure) {
		make_certificates();
		snprintf(tls, sizeof tls, " --tls %s/coordinator", folder);
	}
	process_start(
		&coordinator, load.s.bin, log_file,
		"hslt-coordinator --listen 127.0.0.1:0 --port-file %s --spool %s/spool --status-socket %s --heartbeat %g%s %s",
		port_file, folder, status_socket, load.s.heartbeat, tls, load.s.options);
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
	if (first_address(&load.address, host_port, &e) || (!load.s.insecure && tls_open(&load.tls, tls, &e)))
		load_die("%s", e.text);
}

static double field_of_status(const char *name)
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
	double begun, ended, lag_at, cpu[2], own_cpu[2], written[2], anonymous, loaded;
} clockwork;

static double own_cpu(void)
{
	struct rusage r;
	getrusage(RUSAGE_SELF, &r);
	return (double)(r.ru_utime.tv_sec + r.ru_stime.tv_sec) +
	       1e-6 * (double)(r.ru_utime.tv_usec + r.ru_stime.tv_usec);
}

static void note_usage(int which)
{
	clockwork.cpu[which] = process_cpu_seconds(&coordinator);
	clockwork.own_cpu[which] = own_cpu();
	clockwork.written[which] = bytes_written();
	*(which ? &clockwork.ended : &clockwork.begun) = load_now();
}

static void on_connect(uv_timer_t *t)
{
	unsigned n = (unsigned)fmax(1, load.s.ramp / 20);
	for (; n > 0 && load.connecting < load.s.workers; n--)
		load_connect(&load, load.connecting++);
	if (load.connecting == load.s.workers)
		uv_close((uv_handle_t *)t, NULL);
}

static void finish_load(void)
{
	uv_close((uv_handle_t *)&clockwork.phase, NULL);
	uv_close((uv_handle_t *)&clockwork.lag, NULL);
	load_close(&load);
}

/* Runs once a second: connects, then measures, then leaves. */
static void on_phase(uv_timer_t *t)
{
	(void)t;
	double now = load_now(), anonymous = field_of_status("RssAnon");
	clockwork.anonymous = fmax(clockwork.anonymous, anonymous);
	if (!process_is_running(&coordinator))
		load_die("the coordinator has ended");
	if (!load.measuring && !load.leaving &&
	    load.connected + load.s.bad[LOAD_DIES] + load.s.bad[LOAD_HANGS] >= load.s.workers &&
	    load.merged >= load.s.workers) {
		load.measuring = true;
		note_usage(0);
		fprintf(stderr, "load: %u workers are connected and have sent a batch; measuring\n", load.connected);
	} else if (load.measuring && now - clockwork.begun >= 60 * load.s.minutes) {
		double average[3];
		clockwork.loaded = getloadavg(average, 3) > 0 ? average[0] : NAN;
		note_usage(1);
		load.measuring = false;
		load_leave(&load);
	} else if (load.leaving && (load_unanswered(&load) == 0 || now - clockwork.ended > 120)) {
		finish_load();
	} else if (load.faults && !load.measuring && !load.leaving && load.closed > load.s.workers / 2) {
		load_die("%s", load.fault);
	}
}

/* Measures the delay of the generator itself, which limits what it can measure. */
static void on_lag(uv_timer_t *t)
{
	double now = load_now();
	(void)t;
	if (load.measuring && clockwork.lag_at > 0)
		load_times_add(&load.late, fmax(0, 1000 * (now - clockwork.lag_at) - 10));
	clockwork.lag_at = now;
}

static void run_loop(void)
{
	uv_timer_init(&load.loop, &clockwork.connect);
	uv_timer_init(&load.loop, &clockwork.phase);
	uv_timer_init(&load.loop, &clockwork.lag);
	uv_timer_start(&clockwork.connect, on_connect, 0, 50);
	uv_timer_start(&clockwork.phase, on_phase, 1000, 1000);
	uv_timer_start(&clockwork.lag, on_lag, 10, 10);
	uv_run(&load.loop, UV_RUN_DEFAULT);
}

/* ---- the table */

static void row_times(const char *what, struct load_times *t)
{
	printf("%-46s %9.2f %9.2f %9.2f ms  (%zu)\n", what, load_times_at(t, 0.5), load_times_at(t, 0.99),
	       load_times_at(t, 1), t->count);
}

static bool check_bound(const char *what, double value, const char *unit, double most, bool strict)
{
	bool met = strict ? value < most : value <= most;
	printf("%-46s %9.3g %s, bound %g: %s\n", what, value, unit, most, met ? "met" : "MISSED");
	return met;
}

/* Returns the number of batches that are in the sums more or less often than they were acknowledged. */
static double count_miscounted(void)
{
	uint64_t counted = 0;
	for (unsigned i = 0; i < load.job_count; i++)
		counted += (uint64_t)load_counted(&load, status_socket, load.jobs[i].id);
	const struct plan *p = &load.jobs[0].plan;
	uint64_t lease = plan_round_mutations(p) / (p->groups * p->parts);
	return fabs((double)counted / (double)lease - (double)load.merged);
}

static int report(double wrong, double peak)
{
	const struct plan *p = &load.jobs[0].plan;
	double seconds = clockwork.ended - clockwork.begun, cores = (clockwork.cpu[1] - clockwork.cpu[0]) / seconds;
	double films = 72.0 * p->crop_width * p->crop_height * p->groups * load.job_count;
	double lost = (double)(load_unanswered(&load) + load.refused);
	printf("%u workers, %ux%u, a batch each %g s, %s, %u jobs of %u leases a round, %.1f minutes, load %.2f\n",
	       load.s.workers, load.s.width, load.s.height, load.s.interval, load.s.insecure ? "plaintext" : "TLS",
	       load.job_count, p->groups * p->parts, seconds / 60, clockwork.loaded);
	printf("%-46s %9.3g MB\n", "a batch", 1e-6 * (double)load_content_bytes(load.content));
	printf("%-46s %9.1f /s, %.1f MB/s\n", "batches", (double)load.batches / seconds,
	       1e-6 * (double)load.bytes / seconds);
	printf("%-46s %9.1f MB/s\n", "written to the disk",
	       1e-6 * (clockwork.written[1] - clockwork.written[0]) / seconds);
	printf("%-46s %9.2f s of %.2f s; in all %.1f s\n", "coordinator's processor",
	       clockwork.cpu[1] - clockwork.cpu[0], seconds, coordinator.cpu_seconds);
	printf("%-46s %9.1f ms\n", "... of it for each batch",
	       1000 * (clockwork.cpu[1] - clockwork.cpu[0]) / (double)load.batches);
	printf("%-46s %9.2f s\n", "generator's processor", clockwork.own_cpu[1] - clockwork.own_cpu[0]);
	printf("%-46s %9.3g GB peak, %.3g GB films, %.3g GB not from files\n", "coordinator's memory", 1e-9 * peak,
	       1e-9 * films, 1e-9 * clockwork.anonymous);
	printf("%-46s %9s %9s %9s\n", "", "p50", "p99", "max");
	row_times("result handed over -> next lease", &load.grant);
	row_times("first lease request -> lease", &load.first_grant);
	row_times("result handed over -> acknowledged", &load.ack);
	row_times("heartbeat -> answer", &load.beat);
	row_times("result to the kernel", &load.send);
	row_times("generator's timer late", &load.late);
	printf("leases: %llu granted, %llu merged, %llu of bootstraps, %llu given back at the end, %llu copies taken "
	       "back, %llu again to the same, %llu repeats\n",
	       (unsigned long long)load.grants, (unsigned long long)load.merged,
	       (unsigned long long)load.bootstrap_merged, (unsigned long long)load.given_back,
	       (unsigned long long)load.revoked, (unsigned long long)load.again, (unsigned long long)load.repeated);
	const unsigned *bad = load.s.bad;
	printf("bad workers: %u die (%llu deaths), %u lie (%llu results, %llu refused), %u hoard (%llu leases), %u hang (%llu times)\n",
	       bad[LOAD_DIES], (unsigned long long)load.deaths, bad[LOAD_LIES], (unsigned long long)load.lies,
	       (unsigned long long)load.lies_refused, bad[LOAD_HOARDS], (unsigned long long)load.hoarded,
	       bad[LOAD_HANGS], (unsigned long long)load.hangs);
	if (load.faults)
		printf("faults: %llu, the first: %s\n", (unsigned long long)load.faults, load.fault);
	bool met = check_bound("leases lost", lost, "", 0, false);
	met &= check_bound("acknowledged out of order", (double)load.disordered, "", 0, false);
	met &= check_bound("merged more or less than once", wrong, "", 0, false);
	met &= check_bound("wrong results that count", (double)load.lies_merged, "", 0, false);
	met &= check_bound("coordinator's exit code", coordinator.code, "", 0, false);
	met &= check_bound("connections lost, faults", (double)(load.closed + load.faults), "", 0, false);
	if (load.s.losses)
		return met ? 0 : 1;
	met &= check_bound("coordinator", cores, "cores", 1, true);
	met &= check_bound("memory beyond the films", 1e-9 * (peak - films), "GB", 1, true);
	met &= check_bound("p99 of a lease", load_times_at(&load.grant, 0.99), "ms", 100, true);
	return met ? 0 : 1;
}

static void prepare(const char *host_port)
{
	char tls[300] = "";
	struct rlimit files;
	if (!load.s.insecure)
		snprintf(tls, sizeof tls, "%s/ann", folder);
	getrlimit(RLIMIT_NOFILE, &files);
	files.rlim_cur = files.rlim_max;
	setrlimit(RLIMIT_NOFILE, &files);
	unsigned slots = load.s.groups * load.s.parts;
	load.job_count = load.s.jobs ? load.s.jobs : (load.s.workers * load.s.want + slots - 1) / slots + 1;
	load.jobs = mem_alloc(load.job_count, sizeof *load.jobs);
	load.workers = load_workers_new(load.s.workers);
	if (!load.jobs || !load.workers || load.job_count > 64)
		load_die("no room for so many jobs or workers");
	for (unsigned i = 0; i < load.job_count; i++)
		load_submit(&load, host_port, tls, i);
	load.content = load_content_new(&load.jobs[0].plan);
}

int main(int argc, char **argv)
{
	char host_port[64];
	mem_keep(64 << 20);
	load.s = (struct load_settings){.workers = 1000,
					.width = 1280,
					.height = 720,
					.groups = 16,
					.parts = 64,
					.minutes = 10,
					.interval = 60,
					.ramp = 100,
					.heartbeat = 5,
					.want = 2,
					.bin = "build/bin",
					.spool = "/tmp",
					.options = ""};
	load.random = 1;
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse, NULL, doc, NULL, NULL, NULL}, argc, argv, 0, NULL, &load.s);
	char *bin = realpath(load.s.bin, NULL);
	load.s.bin = bin ? bin : load.s.bin;
	signal(SIGPIPE, SIG_IGN);
	start(host_port, sizeof host_port);
	prepare(host_port);
	uv_loop_init(&load.loop);
	run_loop();
	double wrong = count_miscounted(), peak = process_peak_bytes(&coordinator, NULL);
	process_stop(&coordinator);
	int code = report(wrong, peak);
	load_content_free(load.content);
	tls_close(load.tls);
	run_shell("rm -rf %s", folder);
	free(bin);
	return code;
}
