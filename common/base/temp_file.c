/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/temp_file.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const int signal_numbers[] = {SIGINT, SIGTERM, SIGHUP};
enum { SIGNAL_COUNT = sizeof signal_numbers / sizeof *signal_numbers };
static struct sigaction previous_actions[SIGNAL_COUNT];
static const char *temp_path; /* read by the handler, written while the signals are blocked */

static void remove_and_raise(int number)
{
	unlink(temp_path);
	raise(number); /* SA_RESETHAND has restored the default action, which is taken when this function returns */
}

static void block_signals(sigset_t *old_mask)
{
	sigset_t all;
	sigemptyset(&all);
	for (int i = 0; i < SIGNAL_COUNT; i++)
		sigaddset(&all, signal_numbers[i]);
	sigprocmask(SIG_BLOCK, &all, old_mask);
}

int temp_file_begin(char *path, struct error *e)
{
	struct sigaction a = {.sa_handler = remove_and_raise, .sa_flags = (int)SA_RESETHAND};
	sigset_t old_mask;
	block_signals(&old_mask);
	int fd = mkstemp(path);
	int rc = fd < 0 ? error_set(e, errno, "%s", strerror(errno)) : fd;
	temp_path = path;
	sigemptyset(&a.sa_mask);
	for (int i = 0; i < SIGNAL_COUNT && fd >= 0; i++)
		if (sigaction(signal_numbers[i], NULL, &previous_actions[i]) == 0 &&
		    previous_actions[i].sa_handler == SIG_DFL)
			sigaction(signal_numbers[i], &a, NULL);
	sigprocmask(SIG_SETMASK, &old_mask, NULL);
	return rc;
}

void temp_file_end(void)
{
	sigset_t old_mask;
	block_signals(&old_mask);
	for (int i = 0; i < SIGNAL_COUNT; i++)
		sigaction(signal_numbers[i], &previous_actions[i], NULL);
	sigprocmask(SIG_SETMASK, &old_mask, NULL);
}
