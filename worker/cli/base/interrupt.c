/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/base/interrupt.h"

#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

atomic_bool interrupted;

static void on_interrupt(int signal_number)
{
	(void)signal_number;
	atomic_store(&interrupted, true);
}

/* Handles SIGHUP, unless it is ignored, as under nohup. The handler of interrupt_watch stays installed, because closing
 * a terminal may send the signal twice, by the kernel and by the shell. */
static void handle_hangup(void (*handler)(int), int flags)
{
	struct sigaction act = {.sa_handler = handler, .sa_flags = flags}, before;
	if (sigaction(SIGHUP, NULL, &before) == 0 && before.sa_handler != SIG_IGN)
		sigaction(SIGHUP, &act, NULL);
}

static void handle_termination(void (*handler)(int))
{
	struct sigaction act = {.sa_handler = handler, .sa_flags = (int)SA_RESETHAND};
	sigaction(SIGINT, &act, NULL);
	sigaction(SIGTERM, &act, NULL);
}

void interrupt_watch(void)
{
	handle_termination(on_interrupt);
	handle_hangup(on_interrupt, 0);
}

static const char *_Atomic end_message;

static void print_and_raise(int signal_number)
{
	const char *text = atomic_load(&end_message);
	/* SA_RESETHAND has restored the default action, which raise triggers when this handler returns. */
	if (write(STDERR_FILENO, text, strlen(text)) < 0)
		_exit(128 + signal_number);
	raise(signal_number);
}

void interrupt_set_message(const char *text)
{
	atomic_store(&end_message, text);
	handle_termination(print_and_raise);
	handle_hangup(print_and_raise, (int)SA_RESETHAND);
}
