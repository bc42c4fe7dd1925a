/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/supervise.h"

#include "common/base/clock.h"
#include "common/base/crash.h"
#include "common/base/log.h"
#include "worker/daemon/crash_record.h"

#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const double initial_pause = 0.05, max_pause = 10, long_run_seconds = 30;

struct supervisor {
	sigset_t signals, mask; /* the signals that it waits for; the mask at the start */
	pid_t child;
	int forwarded_signal;  /* the last signal passed on to the process; 0: none */
	bool has_lost_process; /* an earlier process has been lost, so a process that cannot start is tried again */
	double pause_seconds;  /* before the next start */
};

/* Under nohup SIGHUP is ignored, also by the rendering process; sigwaitinfo would receive it nevertheless. */
static bool is_ignored(int number)
{
	struct sigaction a;
	return sigaction(number, NULL, &a) == 0 && a.sa_handler == SIG_IGN;
}

static void block_handled_signals(struct supervisor *s)
{
	sigemptyset(&s->signals);
	sigaddset(&s->signals, SIGCHLD);
	sigaddset(&s->signals, SIGTERM);
	sigaddset(&s->signals, SIGINT);
	if (!is_ignored(SIGHUP))
		sigaddset(&s->signals, SIGHUP);
	sigprocmask(SIG_BLOCK, &s->signals, &s->mask);
}

/* Lets the rendering process notify the service manager's watchdog instead of the supervisor. */
static void take_over_watchdog(pid_t parent)
{
	const char *watchdog_pid = getenv("WATCHDOG_PID");
	char own_pid[24];
	snprintf(own_pid, sizeof own_pid, "%ld", (long)getpid());
	if (watchdog_pid && strtol(watchdog_pid, NULL, 10) == parent)
		setenv("WATCHDOG_PID", own_pid, 1);
}

static int start_process(struct supervisor *s, int (*run)(void *), void *user)
{
	pid_t parent = getpid();
	fflush(NULL);
	s->child = fork();
	if (s->child != 0)
		return s->child < 0 ? -errno : 0;
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	if (getppid() != parent)
		_exit(1);
	take_over_watchdog(parent);
	crash_record_catch_signals();
	sigprocmask(SIG_SETMASK, &s->mask, NULL);
	exit(run(user));
}

/* Waits until the process has ended, passing on signals. Returns its status. */
static int wait_for_end(struct supervisor *s)
{
	for (;;) {
		int status, number = sigwaitinfo(&s->signals, NULL);
		if (number == SIGCHLD) {
			if (waitpid(s->child, &status, WNOHANG) == s->child)
				return status;
		} else if (number > 0) {
			s->forwarded_signal = number;
			kill(s->child, number);
		}
	}
}

/* Returns false if a signal asks the program to end during the pause. */
static bool pause_before_start(struct supervisor *s)
{
	double end = clock_seconds() + s->pause_seconds;
	for (double remaining; (remaining = end - clock_seconds()) > 0;) {
		struct timespec t = {(time_t)remaining, (long)(1e9 * (remaining - (double)(time_t)remaining))};
		int number = sigtimedwait(&s->signals, NULL, &t);
		if (number > 0 && number != SIGCHLD)
			return false;
	}
	return true;
}

/* Exit codes 1 and 2 mean that the process could not start, for instance because a name is not resolved at the moment,
 * a certificate is being replaced, or the disk is full. */
static bool has_failed_to_start(int status)
{
	return WIFEXITED(status) && (WEXITSTATUS(status) == 1 || WEXITSTATUS(status) == 2);
}

/* Waits for the end of a process that was started. Returns true if it must be replaced; otherwise *code is the
 * program's exit code. */
static bool wait_for_loss(struct supervisor *s, int *code)
{
	int status = wait_for_end(s), number = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
	unsigned lost = crash_record_add_loss(number, clock_seconds());
	bool unable = s->has_lost_process && has_failed_to_start(status);
	*code = WEXITSTATUS(status);
	if (!number && !lost && !unable)
		return false;
	if (s->forwarded_signal) {
		*code = number == s->forwarded_signal ? 0 : 1;
		return false;
	}
	if (unable)
		log_event(LOG_PROCESS_LOST, "code=%d text=\"the rendering process cannot start; retrying\"", *code);
	else
		log_event(LOG_PROCESS_LOST, "signal=%d text=\"the rendering process was ended by %s\" leases=%u",
			  number, crash_signal_name(number), lost);
	return true;
}

int supervise_process(unsigned threads, int (*run)(void *), void *user)
{
	struct supervisor s = {.pause_seconds = initial_pause};
	struct error e;
	int code;
	if (crash_record_open(threads, &e)) {
		fprintf(stderr, "hslt-worker: %s\n", e.text);
		return 1;
	}
	block_handled_signals(&s);
	for (;; s.has_lost_process = true) {
		double begun = clock_seconds();
		int rc = start_process(&s, run, user);
		if (rc && !s.has_lost_process) {
			fprintf(stderr, "hslt-worker: no process: %s\n", strerror(-rc));
			return 1;
		}
		if (rc)
			log_event(LOG_PROCESS_LOST, "text=\"no process: %s: it is tried again\"", strerror(-rc));
		else if (!wait_for_loss(&s, &code))
			return code;
		s.pause_seconds = clock_seconds() - begun > long_run_seconds ? initial_pause
				  : s.pause_seconds * 2 < max_pause	     ? s.pause_seconds * 2
									     : max_pause;
		if (!pause_before_start(&s))
			return 0;
	}
}
