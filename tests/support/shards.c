/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/shards.h"

#include <stdio.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

static pid_t shard_pids[SHARDS];
static FILE *shard_logs[SHARDS];

unsigned shards_begin(void)
{
	fflush(NULL);
	for (unsigned i = 1; i < SHARDS; i++) {
		shard_logs[i] = tmpfile();
		shard_pids[i] = shard_logs[i] ? fork() : -1;
		if (shard_pids[i])
			continue;
		prctl(PR_SET_PDEATHSIG, SIGKILL);
		if (dup2(fileno(shard_logs[i]), 1) < 0 || dup2(fileno(shard_logs[i]), 2) < 0)
			_exit(1);
		return i;
	}
	return 0;
}

bool shards_wait(void)
{
	bool passed = true;
	for (int i = 1; i < SHARDS; i++) {
		char line[512];
		int status = 0;
		bool failed = shard_pids[i] < 0 || waitpid(shard_pids[i], &status, 0) != shard_pids[i] ||
			      !WIFEXITED(status) || WEXITSTATUS(status);
		if (shard_logs[i])
			rewind(shard_logs[i]);
		while (failed && shard_logs[i] && fgets(line, sizeof line, shard_logs[i]))
			fputs(line, stderr);
		if (shard_logs[i])
			fclose(shard_logs[i]);
		passed = passed && !failed;
	}
	return passed;
}
