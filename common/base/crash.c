/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/crash.h"

#include <errno.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

enum { STACK = 1 << 14 };

static const struct {
	int number;
	const char *name;
} signals[] = {{SIGSEGV, "SIGSEGV"}, {SIGBUS, "SIGBUS"}, {SIGFPE, "SIGFPE"}, {SIGILL, "SIGILL"}, {SIGABRT, "SIGABRT"}};
enum { SIGNALS = sizeof signals / sizeof *signals };

static _Thread_local struct {
	const char *doing, *file;
	int line;
} place;
static _Thread_local unsigned char stack[STACK];
static void (*handler)(int number, const char *text);
static struct sigaction before[SIGNALS];
static const char *program_name;

void crash_place(const char *doing, const char *file, int line)
{
	place.doing = doing;
	place.file = file;
	place.line = line;
}

const char *crash_signal_name(int number)
{
	for (int i = 0; i < SIGNALS; i++)
		if (signals[i].number == number)
			return signals[i].name;
	return number == SIGKILL ? "SIGKILL" : "a signal";
}

static size_t append_text(char *text, size_t used, const char *more)
{
	while (*more && used + 1 < CRASH_TEXT)
		text[used++] = *more++;
	text[used] = 0;
	return used;
}

static size_t add_number(char *text, size_t used, int n)
{
	char digits[12];
	size_t i = sizeof digits - 1;
	digits[i] = 0;
	do
		digits[--i] = (char)('0' + n % 10);
	while ((n /= 10) > 0);
	return append_text(text, used, digits + i);
}

static void on_signal(int number)
{
	char text[CRASH_TEXT];
	int kept = errno;
	size_t n = append_text(text, 0, crash_signal_name(number));
	if (place.doing) {
		n = append_text(text, n, " while ");
		n = append_text(text, n, place.doing);
	}
	if (place.doing && place.file) {
		n = append_text(text, n, ": ");
		n = append_text(text, n, place.file);
		n = append_text(text, n, ":");
		add_number(text, n, place.line);
	}
	handler(number, text);
	for (int i = 0; i < SIGNALS; i++)
		if (signals[i].number == number)
			sigaction(number, &before[i], NULL);
	errno = kept;
	raise(number); /* blocked until this function returns; a faulting instruction raises it again */
}

void crash_thread(void)
{
	sigset_t all;
	stack_t now;
	/* Sanitizers install an alternate stack in each thread and remove it when the thread ends: keep theirs. */
	if (sigaltstack(NULL, &now) || (now.ss_flags & SS_DISABLE))
		sigaltstack(&(stack_t){.ss_sp = stack, .ss_size = sizeof stack}, NULL);
	sigemptyset(&all);
	for (int i = 0; i < SIGNALS; i++)
		sigaddset(&all, signals[i].number);
	pthread_sigmask(SIG_UNBLOCK, &all, NULL); /* a blocked signal would end the program without a message */
}

void crash_catch(void (*last_words)(int number, const char *text))
{
	struct sigaction a = {.sa_handler = on_signal, .sa_flags = SA_ONSTACK};
	sigemptyset(&a.sa_mask);
	handler = last_words;
	crash_thread();
	for (int i = 0; i < SIGNALS; i++)
		sigaction(signals[i].number, &a, &before[i]);
}

static void write_text(const char *text)
{
	ssize_t n = write(STDERR_FILENO, text, strlen(text));
	(void)n;
}

static void say_and_exit(int number, const char *text)
{
	(void)number;
	write_text(program_name);
	write_text(": ended by ");
	write_text(text);
	write_text(": a fault of this program or of a library that it uses\n");
	_exit(1);
}

void crash_exit(const char *program)
{
	program_name = program;
	crash_catch(say_and_exit);
}
