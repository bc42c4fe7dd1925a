/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/shares.h"

#include <stdio.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

static pid_t others[SHARES];
static FILE *logs[SHARES];

unsigned shares_begin(void)
{
	fflush(NULL);
	for (unsigned i = 1; i < SHARES; i++) {
		logs[i] = tmpfile();
		others[i] = logs[i] ? fork() : -1;
		if (others[i])
			continue;
		prctl(PR_SET_PDEATHSIG, SIGKILL);
		if (dup2(fileno(logs[i]), 1) < 0 || dup2(fileno(logs[i]), 2) < 0)
			_exit(1);
		return i;
	}
	return 0;
}

bool shares_pass(void)
{
	bool all = true;
	for (int i = 1; i < SHARES; i++) {
		char line[512];
		int status = 0;
		bool bad = others[i] < 0 || waitpid(others[i], &status, 0) != others[i] || !WIFEXITED(status) ||
			   WEXITSTATUS(status);
		if (logs[i])
			rewind(logs[i]);
		while (bad && logs[i] && fgets(line, sizeof line, logs[i]))
			fputs(line, stderr);
		if (logs[i])
			fclose(logs[i]);
		all = all && !bad;
	}
	return all;
}
