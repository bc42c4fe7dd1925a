/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/program.h"
#include "worker/daemon/agent.h"
#include "worker/daemon/supervise.h"

#include <stdio.h>
#include <unistd.h>

#define CONFIG struct agent_config

static const struct option_row option_rows[] = {
	{"coordinator", 'c', "HOST:PORT", "The coordinator", OPTION_TEXT(CONFIG, coordinator_address),
	 .environment = "HSLT_COORDINATOR", .is_required = true},
	{"threads", 't', "N", "Render threads (all cores)", OPTION_COUNT(CONFIG, threads, 1, 1024)},
	{"name", 0, "NAME", "Displayed name of the worker (host and process)", OPTION_NAME(CONFIG, name, 127)},
	{"cache", 0, "DIR", "Folder of cached scene files (~/.cache/hslt)", OPTION_TEXT(CONFIG, cache_folder)},
	{"cache-size", 0, "GB", "Limit of the cache", OPTION_SIZE(CONFIG, max_cache_bytes, 0.001, 1e6, 1e9),
	 .default_value = "20"},
	{"grace", 0, "SECONDS", "Time for running leases after SIGTERM",
	 OPTION_SECONDS(CONFIG, grace_seconds, 0, 86400), .default_value = "20"},
	{"idle-exit", 0, "SECONDS", "Exit after this long without a lease; 0: never",
	 OPTION_SECONDS(CONFIG, idle_seconds, 0, 1e7), .default_value = "0"},
	{"stall", 0, "SECONDS", "How long a lease, or building a scene, may go without progress; 0: forever",
	 OPTION_SECONDS(CONFIG, stall_seconds, 0, 86400), .default_value = "120"},
	{"tls", 0, "DIR", "ca.pem, cert.pem, key.pem, made by hslt-ca: encryption and authentication",
	 OPTION_TEXT(CONFIG, tls_folder), .environment = "HSLT_TLS"},
	{"insecure", 0, NULL, "Connect to addresses other than loopback without encryption",
	 OPTION_FLAG(CONFIG, insecure)},
	{"verbose", 'v', NULL, "Log more", OPTION_CUSTOM(program_parse_verbose)},
	{0},
};

static const struct program program = {
	.name = "hslt-worker",
	.summary = "Renders leases for a coordinator until it is told to stop.",
	.examples = "hslt-worker --coordinator 127.0.0.1:7700\n"
		    "hslt-worker --coordinator farm.lan:7700 --tls ~/node1 --threads 8 --name $(hostname)",
	.details = "On SIGTERM it finishes the running epochs within the grace period or gives them up, sends finished "
		   "results and exits; a second SIGTERM ends it at once. It reconnects forever, unless it is refused "
		   "permanently; with --idle-exit it exits when there is no work. A lease without progress for --stall "
		   "is returned as failed, as are leases that wait for a scene whose building makes no progress, "
		   "and the worker exits, to be restarted. Rendering runs in a separate process: if a signal ends it "
		   "(a fault caused by a scene, lack of memory), the lease is returned as failed and the process is "
		   "restarted. Under systemd it reports when it is ready and feeds the watchdog.\n"
		   "The size of the cache is also written 500M, 20G or 2T, times 90s, 5m, 2h or 3d.",
	.exit_codes =
		"0 stopped, 1 failed, 2 usage, 6 refused permanently (a certificate of another role, another version), "
		"75 a thread hung",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, NULL},
};

static int run_worker(void *user)
{
	struct error e;
	int rc = agent_run(user, &e);
	if (rc)
		fprintf(stderr, "hslt-worker: %s\n", e.text);
	return rc == 0 ? 0 : rc == -EACCES ? AGENT_EXIT_REFUSED : rc == -EPERM || rc == -EINVAL ? 2 : 1;
}

int main(int argc, char **argv)
{
	char host[64] = "worker", name[128];
	mem_retain_freed(1 << 20);
	long cores = sysconf(_SC_NPROCESSORS_ONLN);
	gethostname(host, sizeof host - 1);
	snprintf(name, sizeof name, "%s-%ld", host, (long)getpid());
	struct agent_config c = {.name = name, .threads = cores > 0 && cores <= 1024 ? (unsigned)cores : 1};
	program_parse_options(&program, argc, argv, &c);
	if (geteuid() == 0)
		log_event(LOG_ROOT,
			  "text=\"running as root, which a worker does not need: it reads other people's scenes\"");
	return supervise_process(c.threads, run_worker, &c);
}
