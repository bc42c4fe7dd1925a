/* SPDX-License-Identifier: Apache-2.0 */
/* limit CPU IDLE COMMAND...: runs a test and ends it when it has used CPU seconds of processor time, or has been idle
 * for IDLE seconds.
 *
 * Both count all processes that the command started, also those that left their session or lost their parent. Idle is
 * time in which none of them ran, wanted to run, or waited for a disk; it counts from the last output on. So a busy
 * machine, on which all takes longer, ends nothing, and a test that polls for something that never comes is ended all
 * the same. Output is what the file on stdout grows by.
 *
 * The exit code is the command's, 128 + N if signal N ended it, 124 if this program did: it then says on stderr why,
 * and what each process was doing, sends SIGTERM to all of them and ten seconds later SIGKILL. SIGINT, SIGTERM and
 * SIGHUP do the same without a word.
 */
#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define GRACE_SECONDS 10.0 /* seconds between SIGTERM and SIGKILL */

struct process {
	pid_t pid, parent;
	char state; /* as in proc(5) */
	char name[32];
	double cpu_seconds; /* its own and those of its children that it waited for */
	bool is_descendant;
};

struct process_table {
	struct process *processes;
	size_t count, capacity;
};

static double seconds_now(void)
{
	struct timespec t;
	clock_gettime(CLOCK_MONOTONIC, &t);
	return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Of /proc/PID/stat or /proc/PID/task/TID/stat; false: it is gone. The name may hold spaces and parentheses. */
static bool read_stat(const char *path, struct process *p)
{
	char text[1024];
	FILE *f = fopen(path, "re");
	if (!f)
		return false;
	size_t n = fread(text, 1, sizeof text - 1, f);
	fclose(f);
	text[n] = 0;
	char *open = strchr(text, '('), *close = strrchr(text, ')');
	unsigned long user, system;
	long user_children, system_children;
	if (!open || !close || close < open ||
	    sscanf(close + 1, " %c %d %*d %*d %*d %*d %*u %*u %*u %*u %*u %lu %lu %ld %ld", &p->state, &p->parent,
		   &user, &system, &user_children, &system_children) != 6)
		return false;
	snprintf(p->name, sizeof p->name, "%.*s", (int)(close - open - 1), open + 1);
	p->cpu_seconds = (double)(user + system + (unsigned long)user_children + (unsigned long)system_children) /
			 (double)sysconf(_SC_CLK_TCK);
	return true;
}

static void read_process_table(struct process_table *t)
{
	t->count = 0;
	DIR *d = opendir("/proc");
	if (!d)
		return;
	for (struct dirent *e; (e = readdir(d));) {
		char path[64];
		pid_t pid = atoi(e->d_name);
		if (pid <= 0)
			continue;
		if (t->count == t->capacity) {
			size_t capacity = t->capacity ? 2 * t->capacity : 256;
			struct process *grown = realloc(t->processes, capacity * sizeof *grown);
			if (!grown)
				break;
			t->processes = grown;
			t->capacity = capacity;
		}
		snprintf(path, sizeof path, "/proc/%d/stat", pid);
		struct process *p = &t->processes[t->count];
		*p = (struct process){.pid = pid};
		if (read_stat(path, p))
			t->count++;
	}
	closedir(d);
	/* Descendants: until a pass finds no more. */
	for (bool found_more = true; found_more;) {
		found_more = false;
		for (size_t i = 0; i < t->count; i++) {
			for (size_t k = 0; !t->processes[i].is_descendant && k < t->count; k++)
				if (t->processes[k].pid == t->processes[i].parent &&
				    (t->processes[k].is_descendant || t->processes[k].pid == getpid()))
					t->processes[i].is_descendant = found_more = true;
		}
	}
}

static bool is_runnable_state(char state)
{
	return state == 'R' || state == 'D';
}

/* Any thread: the first one may only wait for the others. */
static bool has_runnable_thread(pid_t pid)
{
	char path[300];
	snprintf(path, sizeof path, "/proc/%d/task", pid);
	DIR *d = opendir(path);
	bool any = false;
	for (struct dirent *e; d && !any && (e = readdir(d));) {
		struct process thread;
		snprintf(path, sizeof path, "/proc/%d/task/%.20s/stat", pid, e->d_name);
		any = e->d_name[0] != '.' && read_stat(path, &thread) && is_runnable_state(thread.state);
	}
	if (d)
		closedir(d);
	return any;
}

static bool has_runnable_process(const struct process_table *t)
{
	for (size_t i = 0; i < t->count; i++)
		if (t->processes[i].is_descendant &&
		    (is_runnable_state(t->processes[i].state) || has_runnable_thread(t->processes[i].pid)))
			return true;
	return false;
}

/* Seconds that the tree has used so far: the living, and those that were waited for. */
static double tree_cpu_seconds(const struct process_table *t)
{
	double sum = 0, own_children = 0;
	struct timespec own_cpu;
	clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &own_cpu);
	for (size_t i = 0; i < t->count; i++) {
		if (t->processes[i].is_descendant)
			sum += t->processes[i].cpu_seconds;
		else if (t->processes[i].pid == getpid())
			own_children =
				t->processes[i].cpu_seconds - ((double)own_cpu.tv_sec + 1e-9 * (double)own_cpu.tv_nsec);
	}
	return sum + (own_children > 0 ? own_children : 0);
}

static void signal_all(const struct process_table *t, int sig)
{
	for (size_t i = 0; i < t->count; i++)
		if (t->processes[i].is_descendant)
			kill(t->processes[i].pid, sig);
}

/* Reaps what ended; the command's status once it has. */
static bool reap_children(pid_t command, int *status)
{
	bool ended = false;
	int s;
	for (pid_t p; (p = waitpid(-1, &s, WNOHANG)) > 0;) {
		if (p == command) {
			*status = s;
			ended = true;
		}
	}
	return ended;
}

static void terminate_all(struct process_table *t)
{
	int status;
	bool is_killing = false;
	double begin = seconds_now();
	read_process_table(t);
	signal_all(t, SIGTERM);
	signal_all(t, SIGCONT);
	for (;;) {
		reap_children(0, &status);
		read_process_table(t);
		bool any = false;
		for (size_t i = 0; i < t->count && !any; i++)
			any = t->processes[i].is_descendant;
		if (!any)
			return;
		is_killing = is_killing || seconds_now() - begin > GRACE_SECONDS;
		if (is_killing)
			signal_all(t, SIGKILL);
		nanosleep(&(struct timespec){0, 50000000}, NULL);
	}
}

static void print_processes(const struct process_table *t, const char *command, const char *reason, double seconds)
{
	fprintf(stderr, "limit: %s: %s for %.0f s; its processes, their states and seconds of processor time:\n",
		command, reason, seconds);
	for (size_t i = 0; i < t->count; i++)
		if (t->processes[i].is_descendant)
			fprintf(stderr, "limit:   %d %s %c %.1f\n", t->processes[i].pid, t->processes[i].name,
				t->processes[i].state, t->processes[i].cpu_seconds);
}

/* Ends when the command has, or a limit is reached. */
static int watch_command(pid_t command, const char *name, double cpu_limit, double idle_limit, const sigset_t *signals)
{
	struct process_table t = {0};
	double period = cpu_limit < idle_limit ? cpu_limit / 8 : idle_limit / 8, cpu = 0, idle = 0,
	       last_check = seconds_now();
	off_t output = 0;
	int status, over_count = 0;
	if (period > 1)
		period = 1;
	for (;;) {
		struct timespec wait = {(time_t)period, (long)(1e9 * (period - (double)(time_t)period))};
		int sig = sigtimedwait(signals, NULL, &wait);
		if (reap_children(command, &status)) {
			free(t.processes);
			return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
		}
		if (sig > 0 && sig != SIGCHLD) {
			terminate_all(&t);
			return 128 + sig;
		}
		double elapsed = seconds_now() - last_check;
		if (elapsed < period)
			continue;
		last_check += elapsed;
		read_process_table(&t);
		double previous_cpu = cpu;
		cpu = tree_cpu_seconds(&t);
		struct stat st;
		if (fstat(STDOUT_FILENO, &st) == 0 && S_ISREG(st.st_mode) && st.st_size != output) {
			output = st.st_size;
			idle = 0;
		}
		/* After a pause of this program itself only one period is known of. */
		double used = cpu > previous_cpu ? cpu - previous_cpu : 0;
		if (used < period && !has_runnable_process(&t))
			idle += period - used;
		/* Twice: a process that ends while the table is read may count as itself and as its parent's. */
		over_count = cpu >= cpu_limit ? over_count + 1 : 0;
		if (over_count >= 2 || idle >= idle_limit) {
			if (over_count >= 2)
				print_processes(&t, name, "it has used the processor", cpu);
			else
				print_processes(&t, name, "it has been idle and written nothing", idle);
			terminate_all(&t);
			free(t.processes);
			return 124;
		}
	}
}

int main(int argc, char **argv)
{
	double cpu = argc > 3 ? atof(argv[1]) : 0, idle = argc > 3 ? atof(argv[2]) : 0;
	if (!(cpu > 0) || !(idle > 0)) {
		fputs("usage: limit CPU-SECONDS IDLE-SECONDS COMMAND [ARGUMENT...]\n", stderr);
		return 2;
	}
	sigset_t signals, old_mask;
	sigemptyset(&signals);
	sigaddset(&signals, SIGCHLD);
	sigaddset(&signals, SIGINT);
	sigaddset(&signals, SIGTERM);
	sigaddset(&signals, SIGHUP);
	sigprocmask(SIG_BLOCK, &signals, &old_mask);
	prctl(PR_SET_CHILD_SUBREAPER, 1);
	pid_t command = fork();
	if (command == 0) {
		sigprocmask(SIG_SETMASK, &old_mask, NULL);
		execvp(argv[3], argv + 3);
		fprintf(stderr, "limit: %s: %s\n", argv[3], strerror(errno));
		_exit(127);
	}
	if (command < 0) {
		fprintf(stderr, "limit: fork: %s\n", strerror(errno));
		return 125;
	}
	return watch_command(command, argv[3], cpu, idle, &signals);
}
