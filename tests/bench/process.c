/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/bench/process.h"

#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { RUNNING_MAX = 16 };
static pid_t running_pids[RUNNING_MAX];

static void kill_all(void)
{
	for (int i = 0; i < RUNNING_MAX; i++)
		if (running_pids[i])
			kill(running_pids[i], SIGKILL);
}

static void replace_running(pid_t before, pid_t after)
{
	static bool registered;
	if (!registered)
		atexit(kill_all);
	registered = true;
	for (int i = 0; i < RUNNING_MAX; i++)
		if (running_pids[i] == before) {
			running_pids[i] = after;
			return;
		}
}

bool process_program_exists(const char *bin, const char *name)
{
	char path[4096];
	snprintf(path, sizeof path, "%s/%s", bin, name);
	return access(path, X_OK) == 0;
}

void process_start(struct process *p, const char *bin, const char *log, const char *format, ...)
{
	char line[8192], path[4096], *arg[PROCESS_ARGS_MAX + 1], *rest = line;
	va_list ap;
	va_start(ap, format);
	vsnprintf(line, sizeof line, format, ap);
	va_end(ap);
	int n = 0;
	for (char *word; n < PROCESS_ARGS_MAX && (word = strtok_r(n ? NULL : line, " ", &rest));)
		arg[n++] = word;
	arg[n] = NULL;
	snprintf(path, sizeof path, "%s/%s", bin, arg[0]);
	*p = (struct process){.pid = fork()};
	if (p->pid == 0) {
		int fd = open(log, O_WRONLY | O_CREAT | O_APPEND, 0600);
		dup2(fd, 1);
		dup2(fd, 2);
		execv(path, arg);
		_exit(127);
	}
	if (p->pid < 0) {
		perror("bench: fork");
		exit(1);
	}
	replace_running(0, p->pid);
}

static void wait_for_end(struct process *p)
{
	struct rusage r;
	int status;
	if (wait4(p->pid, &status, 0, &r) != p->pid) {
		perror("bench: wait4");
		exit(1);
	}
	replace_running(p->pid, 0);
	p->pid = 0;
	p->cpu_seconds = (double)(r.ru_utime.tv_sec + r.ru_stime.tv_sec) +
			 1e-6 * (double)(r.ru_utime.tv_usec + r.ru_stime.tv_usec);
	p->exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void process_wait(struct process *p)
{
	wait_for_end(p);
	if (p->exit_code != 0) {
		fprintf(stderr, "bench: a program ended with %d\n", p->exit_code);
		exit(1);
	}
}

void process_stop(struct process *p)
{
	kill(p->pid, SIGTERM);
	wait_for_end(p);
}

bool process_is_running(const struct process *p)
{
	siginfo_t info = {.si_pid = 0};
	return waitid(P_PID, (id_t)p->pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == 0;
}

/* A worker renders in a child of the process that was started (worker/daemon/supervise.h). */
static size_t list_with_children(pid_t pid, pid_t pids[16])
{
	char path[64];
	size_t count = 1;
	snprintf(path, sizeof path, "/proc/%d/task/%d/children", (int)pid, (int)pid);
	FILE *f = fopen(path, "r");
	if (!f) {
		perror("bench: list of children");
		exit(1);
	}
	pids[0] = pid;
	for (int child; count < 16 && fscanf(f, "%d", &child) == 1;)
		pids[count++] = child;
	fclose(f);
	return count;
}

double process_cpu_seconds(const struct process *p)
{
	pid_t pids[16];
	double sum = 0;
	for (size_t i = 0, n = list_with_children(p->pid, pids); i < n; i++) {
		clockid_t clock;
		struct timespec t = {0, 0};
		if (clock_getcpuclockid(pids[i], &clock) == 0)
			clock_gettime(clock, &t);
		sum += (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
	}
	return sum;
}

double process_peak_bytes(const struct process *p, double *current)
{
	pid_t pids[16];
	double peak = 0, resident = 0;
	for (size_t i = 0, n = list_with_children(p->pid, pids); i < n; i++) {
		char path[64], line[256];
		double kilobytes;
		snprintf(path, sizeof path, "/proc/%d/status", (int)pids[i]);
		FILE *f = fopen(path, "r");
		while (f && fgets(line, sizeof line, f))
			if (sscanf(line, "VmHWM: %lf", &kilobytes) == 1)
				peak += kilobytes;
			else if (sscanf(line, "VmRSS: %lf", &kilobytes) == 1)
				resident += kilobytes;
		if (f)
			fclose(f);
	}
	if (current)
		*current = 1024 * resident;
	return 1024 * peak;
}

double process_wait_peak(struct process *p)
{
	double peak = 0;
	while (process_is_running(p)) {
		/* The last value and not the largest: before the process runs the program, it is a copy of this
		 * process. */
		double bytes = process_peak_bytes(p, NULL);
		peak = bytes > 0 ? bytes : peak;
		usleep(1000);
	}
	process_wait(p);
	return peak;
}

double process_wall_seconds(void)
{
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void process_make_folder(char *folder)
{
	if (!mkdtemp(folder)) {
		perror("bench: mkdtemp");
		exit(1);
	}
}

void process_remove_folder(const char *folder)
{
	char command[128];
	snprintf(command, sizeof command, "rm -rf %s", folder);
	if (system(command) != 0)
		fprintf(stderr, "bench: %s is left behind\n", folder);
}
