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

#define GRACE 10.0 /* seconds between SIGTERM and SIGKILL */

struct process {
	pid_t pid, parent;
	char state; /* as in proc(5) */
	char name[32];
	double cpu; /* seconds: its own and those of its children that it waited for */
	bool ours;
};

struct table {
	struct process *of;
	size_t n, room;
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
	p->cpu = (double)(user + system + (unsigned long)user_children + (unsigned long)system_children) /
		 (double)sysconf(_SC_CLK_TCK);
	return true;
}

static void read_table(struct table *t)
{
	t->n = 0;
	DIR *d = opendir("/proc");
	if (!d)
		return;
	for (struct dirent *e; (e = readdir(d));) {
		char path[64];
		pid_t pid = atoi(e->d_name);
		if (pid <= 0)
			continue;
		if (t->n == t->room) {
			size_t room = t->room ? 2 * t->room : 256;
			struct process *grown = realloc(t->of, room * sizeof *grown);
			if (!grown)
				break;
			t->of = grown;
			t->room = room;
		}
		snprintf(path, sizeof path, "/proc/%d/stat", pid);
		struct process *p = &t->of[t->n];
		*p = (struct process){.pid = pid};
		if (read_stat(path, p))
			t->n++;
	}
	closedir(d);
	/* Descendants: until a pass finds no more. */
	for (bool more = true; more;) {
		more = false;
		for (size_t i = 0; i < t->n; i++) {
			for (size_t k = 0; !t->of[i].ours && k < t->n; k++)
				if (t->of[k].pid == t->of[i].parent && (t->of[k].ours || t->of[k].pid == getpid()))
					t->of[i].ours = more = true;
		}
	}
}

static bool wants_to_run(char state)
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
		any = e->d_name[0] != '.' && read_stat(path, &thread) && wants_to_run(thread.state);
	}
	if (d)
		closedir(d);
	return any;
}

static bool any_runnable(const struct table *t)
{
	for (size_t i = 0; i < t->n; i++)
		if (t->of[i].ours && (wants_to_run(t->of[i].state) || has_runnable_thread(t->of[i].pid)))
			return true;
	return false;
}

/* Seconds that the tree has used so far: the living, and those that were waited for. */
static double total_cpu(const struct table *t)
{
	double sum = 0, own_children = 0;
	struct timespec mine;
	clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &mine);
	for (size_t i = 0; i < t->n; i++) {
		if (t->of[i].ours)
			sum += t->of[i].cpu;
		else if (t->of[i].pid == getpid())
			own_children = t->of[i].cpu - ((double)mine.tv_sec + 1e-9 * (double)mine.tv_nsec);
	}
	return sum + (own_children > 0 ? own_children : 0);
}

static void signal_all(const struct table *t, int sig)
{
	for (size_t i = 0; i < t->n; i++)
		if (t->of[i].ours)
			kill(t->of[i].pid, sig);
}

/* Reaps what ended; the command's status once it has. */
static bool has_ended(pid_t command, int *status)
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

static void end_all(struct table *t)
{
	int status;
	bool killing = false;
	double begin = seconds_now();
	read_table(t);
	signal_all(t, SIGTERM);
	signal_all(t, SIGCONT);
	for (;;) {
		has_ended(0, &status);
		read_table(t);
		bool any = false;
		for (size_t i = 0; i < t->n && !any; i++)
			any = t->of[i].ours;
		if (!any)
			return;
		killing = killing || seconds_now() - begin > GRACE;
		if (killing)
			signal_all(t, SIGKILL);
		nanosleep(&(struct timespec){0, 50000000}, NULL);
	}
}

static void print_processes(const struct table *t, const char *command, const char *what, double seconds)
{
	fprintf(stderr, "limit: %s: %s for %.0f s; its processes, their states and seconds of processor time:\n",
		command, what, seconds);
	for (size_t i = 0; i < t->n; i++)
		if (t->of[i].ours)
			fprintf(stderr, "limit:   %d %s %c %.1f\n", t->of[i].pid, t->of[i].name, t->of[i].state,
				t->of[i].cpu);
}

/* Ends when the command has, or a limit is reached. */
static int watch_command(pid_t command, const char *name, double cpu_limit, double idle_limit, const sigset_t *signals)
{
	struct table t = {0};
	double period = cpu_limit < idle_limit ? cpu_limit / 8 : idle_limit / 8, cpu = 0, idle = 0,
	       last = seconds_now();
	off_t output = 0;
	int status, over = 0;
	if (period > 1)
		period = 1;
	for (;;) {
		struct timespec wait = {(time_t)period, (long)(1e9 * (period - (double)(time_t)period))};
		int sig = sigtimedwait(signals, NULL, &wait);
		if (has_ended(command, &status)) {
			free(t.of);
			return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
		}
		if (sig > 0 && sig != SIGCHLD) {
			end_all(&t);
			return 128 + sig;
		}
		double passed = seconds_now() - last;
		if (passed < period)
			continue;
		last += passed;
		read_table(&t);
		double before = cpu;
		cpu = total_cpu(&t);
		struct stat st;
		if (fstat(STDOUT_FILENO, &st) == 0 && S_ISREG(st.st_mode) && st.st_size != output) {
			output = st.st_size;
			idle = 0;
		}
		/* After a pause of this program itself only one period is known of. */
		double used = cpu > before ? cpu - before : 0;
		if (used < period && !any_runnable(&t))
			idle += period - used;
		/* Twice: a process that ends while the table is read may count as itself and as its parent's. */
		over = cpu >= cpu_limit ? over + 1 : 0;
		if (over >= 2 || idle >= idle_limit) {
			if (over >= 2)
				print_processes(&t, name, "it has used the processor", cpu);
			else
				print_processes(&t, name, "it has been idle and written nothing", idle);
			end_all(&t);
			free(t.of);
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
	sigset_t signals, before;
	sigemptyset(&signals);
	sigaddset(&signals, SIGCHLD);
	sigaddset(&signals, SIGINT);
	sigaddset(&signals, SIGTERM);
	sigaddset(&signals, SIGHUP);
	sigprocmask(SIG_BLOCK, &signals, &before);
	prctl(PR_SET_CHILD_SUBREAPER, 1);
	pid_t command = fork();
	if (command == 0) {
		sigprocmask(SIG_SETMASK, &before, NULL);
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
