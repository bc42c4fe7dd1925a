/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/option.h"
#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/output.h"
#include "common/base/version.h"
#include "worker/daemon/agent.h"
#include "worker/daemon/supervise.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const char *argp_program_version = "hslt-worker " HSLT_VERSION;

static const char doc[] =
	"Renders leases for a coordinator until it is told to stop."
	"\v"
	"Examples:\n"
	"  hslt-worker --coordinator 127.0.0.1:7700\n"
	"  hslt-worker --coordinator farm.lan:7700 --tls ~/node1 --threads 8 --name $(hostname)\n"
	"\n"
	"SIGTERM: finishes the running epochs within the grace period or gives them up, sends what is done and leaves; the "
	"second one ends it at once. It reconnects for ever unless it is refused for good; with --idle-exit it leaves when nobody has work for it. A lease that "
	"makes no progress for --stall is given back as failed, as are those that wait for a scene whose building makes none, and "
	"the worker leaves, to be started again. It renders in a process of its own: when a signal ends that (a fault in a scene's wake, "
	"the machine's memory) the lease is given back as failed and the process is started again. Under systemd it says when it is "
	"ready and feeds the watchdog.\n"
	"HSLT_COORDINATOR stands in for --coordinator, HSLT_TLS for --tls. Exit codes: 0 stopped, 1 failed, 2 usage, 6 refused "
	"for good (a certificate of another role, another version), 75 a thread hung.";

enum {
	OPTION_NAME = 256,
	OPTION_CACHE,
	OPTION_CACHE_SIZE,
	OPTION_GRACE,
	OPTION_INSECURE,
	OPTION_REPEAT,
	OPTION_LARGE,
	OPTION_LIE,
	OPTION_SPOIL,
	OPTION_TLS,
	OPTION_IDLE,
	OPTION_STALL,
	OPTION_HANG,
	OPTION_CRASH
};

static const struct argp_option options[] = {
	{"coordinator", 'c', "HOST:PORT", 0, "The coordinator", 0},
	{"threads", 't', "N", 0, "Render threads (all cores)", 0},
	{"name", OPTION_NAME, "NAME", 0, "How the worker is shown (host and process)", 0},
	{"cache", OPTION_CACHE, "DIR", 0, "Where files of scenes are kept (~/.cache/hslt)", 0},
	{"cache-size", OPTION_CACHE_SIZE, "GB", 0, "The cache's limit (20)", 0},
	{"grace", OPTION_GRACE, "SECONDS", 0, "After SIGTERM (20)", 0},
	{"idle-exit", OPTION_IDLE, "SECONDS", 0, "Leave when there was no lease for so long (0: never)", 0},
	{"stall", OPTION_STALL, "SECONDS", 0,
	 "How long a lease or the building of a scene may make no progress (120; 0: for ever)", 0},
	{"tls", OPTION_TLS, "DIR", 0, "ca.pem, cert.pem, key.pem: encrypt, and say who we are (hslt-ca makes them)", 0},
	{"insecure", OPTION_INSECURE, NULL, 0, "Connect to other than loopback addresses without encryption", 0},
	{"verbose", 'v', NULL, 0, "Log more", 0},
	{"test-spoil-states", OPTION_SPOIL, "N", OPTION_HIDDEN, "Spoil the chain states of one of N results", 0},
	{"test-large", OPTION_LARGE, "N", OPTION_HIDDEN, "Make a pixel of one of N results 1e30", 0},
	{"test-lie", OPTION_LIE, "N", OPTION_HIDDEN, "Flip a bit in one of N results", 0},
	{"test-repeat", OPTION_REPEAT, NULL, OPTION_HIDDEN, "Send every result twice", 0},
	{"test-crash", OPTION_CRASH, "N", OPTION_HIDDEN,
	 "The N-th lease of each process that renders ends it by SIGSEGV", 0},
	{"test-hang", OPTION_HANG, "N", OPTION_HIDDEN, "The N-th lease never ends", 0},
	{0},
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct agent_config *c = state->input;
	switch (key) {
	case 'c':
		c->coordinator = arg;
		return 0;
	case 't':
		c->threads = (unsigned)option_number(state, "--threads", arg, 1, 1024);
		return 0;
	case OPTION_NAME:
		if (!*arg || strlen(arg) > 127)
			argp_error(state, "--name takes 1 to 127 bytes");
		c->name = arg;
		return 0;
	case OPTION_CACHE:
		c->cache = arg;
		return 0;
	case OPTION_CACHE_SIZE:
		c->cache_bytes = (uint64_t)(1e9 * option_number(state, "--cache-size", arg, 0.001, 1e6));
		return 0;
	case OPTION_GRACE:
		c->grace_seconds = option_number(state, "--grace", arg, 0, 86400);
		return 0;
	case OPTION_IDLE:
		c->idle_seconds = option_number(state, "--idle-exit", arg, 0, 1e7);
		return 0;
	case OPTION_TLS:
		c->tls = arg;
		return 0;
	case OPTION_INSECURE:
		c->insecure = true;
		return 0;
	case 'v':
		log_set_level(LOG_LEVEL_DEBUG);
		return 0;
	case OPTION_LARGE:
		if (!getenv("HSLT_TEST"))
			argp_error(state, "--test-large is for tests alone: it makes wrong images");
		c->large = (unsigned)option_number(state, "--test-large", arg, 1, 1e6);
		return 0;
	case OPTION_LIE:
		if (!getenv("HSLT_TEST"))
			argp_error(state, "--test-lie is for tests alone: it makes wrong images");
		c->lie = (unsigned)option_number(state, "--test-lie", arg, 1, 1e6);
		return 0;
	case OPTION_SPOIL:
		if (!getenv("HSLT_TEST"))
			argp_error(state, "--test-spoil-states is for tests alone: it makes wrong images");
		c->spoil = (unsigned)option_number(state, "--test-spoil-states", arg, 1, 1e6);
		return 0;
	case OPTION_STALL:
		c->stall_seconds = option_number(state, "--stall", arg, 0, 86400);
		return 0;
	case OPTION_HANG:
		c->hang = (unsigned)option_number(state, "--test-hang", arg, 1, 1e9);
		return 0;
	case OPTION_CRASH:
		c->crash = (unsigned)option_number(state, "--test-crash", arg, 1, 1e9);
		return 0;
	case OPTION_REPEAT:
		c->repeat = true;
		return 0;
	case ARGP_KEY_END:
		if (!c->coordinator)
			argp_error(state, "--coordinator HOST:PORT is needed (or $HSLT_COORDINATOR)");
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

static int run(void *user)
{
	struct error e;
	int rc = agent_run(user, &e);
	if (rc)
		fprintf(stderr, "hslt-worker: %s\n", e.text);
	return rc == 0 ? 0 : rc == -EACCES ? AGENT_REFUSED : rc == -EPERM || rc == -EINVAL ? 2 : 1;
}

int main(int argc, char **argv)
{
	char host[64] = "worker", name[128];
	mem_keep(1 << 20);
	long cores = sysconf(_SC_NPROCESSORS_ONLN);
	gethostname(host, sizeof host - 1);
	snprintf(name, sizeof name, "%s-%ld", host, (long)getpid());
	struct agent_config c = {.coordinator = getenv("HSLT_COORDINATOR"),
				 .tls = getenv("HSLT_TLS"),
				 .name = name,
				 .cache_bytes = 20000000000u,
				 .threads = cores > 0 && cores <= 1024 ? (unsigned)cores : 1,
				 .grace_seconds = 20,
				 .stall_seconds = 120};
	output_check_at_exit();
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse, NULL, doc, NULL, NULL, NULL}, argc, argv, 0, NULL, &c);
	if (geteuid() == 0)
		log_event(LOG_ROOT, "text=\"a worker needs no privileges: scenes from others are read as root\"");
	return supervise(c.threads, run, &c);
}
