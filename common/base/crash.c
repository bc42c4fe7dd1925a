/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/crash.h"

#include <errno.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

enum { STACK_SIZE = 1 << 14 };

static const struct {
	int number;
	const char *name;
} signals[] = {{SIGSEGV, "SIGSEGV"}, {SIGBUS, "SIGBUS"}, {SIGFPE, "SIGFPE"}, {SIGILL, "SIGILL"}, {SIGABRT, "SIGABRT"}};
enum { SIGNAL_COUNT = sizeof signals / sizeof *signals };

static _Thread_local struct {
	const char *activity, *file;
	int line;
} context;
static _Thread_local unsigned char handler_stack[STACK_SIZE];
static void (*handler)(int number, const char *text);
static struct sigaction previous_actions[SIGNAL_COUNT];
static const char *program_name;

void crash_set_context(const char *activity, const char *file, int line)
{
	context.activity = activity;
	context.file = file;
	context.line = line;
}

const char *crash_signal_name(int number)
{
	for (int i = 0; i < SIGNAL_COUNT; i++)
		if (signals[i].number == number)
			return signals[i].name;
	return number == SIGKILL ? "SIGKILL" : "a signal";
}

static size_t append_text(char *text, size_t used, const char *more)
{
	while (*more && used + 1 < CRASH_TEXT_MAX)
		text[used++] = *more++;
	text[used] = 0;
	return used;
}

static size_t append_number(char *text, size_t used, int n)
{
	char digits[12];
	size_t i = sizeof digits - 1;
	digits[i] = 0;
	do
		digits[--i] = (char)('0' + n % 10);
	while ((n /= 10) > 0);
	return append_text(text, used, digits + i);
}

static void handle_signal(int number)
{
	char text[CRASH_TEXT_MAX];
	int saved_errno = errno;
	size_t n = append_text(text, 0, crash_signal_name(number));
	if (context.activity) {
		n = append_text(text, n, " while ");
		n = append_text(text, n, context.activity);
	}
	if (context.activity && context.file) {
		n = append_text(text, n, ": ");
		n = append_text(text, n, context.file);
		n = append_text(text, n, ":");
		append_number(text, n, context.line);
	}
	handler(number, text);
	for (int i = 0; i < SIGNAL_COUNT; i++)
		if (signals[i].number == number)
			sigaction(number, &previous_actions[i], NULL);
	errno = saved_errno;
	raise(number); /* blocked until this function returns; a faulting instruction raises it again */
}

void crash_init_thread(void)
{
	sigset_t all;
	stack_t current;
	/* Sanitizers install an alternate stack in each thread and remove it when the thread ends: keep theirs. */
	if (sigaltstack(NULL, &current) || (current.ss_flags & SS_DISABLE))
		sigaltstack(&(stack_t){.ss_sp = handler_stack, .ss_size = sizeof handler_stack}, NULL);
	sigemptyset(&all);
	for (int i = 0; i < SIGNAL_COUNT; i++)
		sigaddset(&all, signals[i].number);
	pthread_sigmask(SIG_UNBLOCK, &all, NULL); /* a blocked signal would end the program without a message */
}

void crash_install_handler(void (*on_crash)(int number, const char *text))
{
	struct sigaction a = {.sa_handler = handle_signal, .sa_flags = SA_ONSTACK};
	sigemptyset(&a.sa_mask);
	handler = on_crash;
	crash_init_thread();
	for (int i = 0; i < SIGNAL_COUNT; i++)
		sigaction(signals[i].number, &a, &previous_actions[i]);
}

static void write_stderr(const char *text)
{
	ssize_t n = write(STDERR_FILENO, text, strlen(text));
	(void)n;
}

static void print_and_exit(int number, const char *text)
{
	(void)number;
	write_stderr(program_name);
	write_stderr(": ended by ");
	write_stderr(text);
	write_stderr(": a fault of this program or of a library that it uses\n");
	_exit(1);
}

void crash_install_exit_handler(const char *program)
{
	program_name = program;
	crash_install_handler(print_and_exit);
}
