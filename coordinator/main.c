/* SPDX-License-Identifier: Apache-2.0 */
/*
 * hslt-coordinator: its options, and then the server until a signal stops it.
 *
 * Exit codes: 0 after SIGTERM or SIGINT, 2 for options and settings that cannot be, 1 for anything else; the reason
 * goes to stderr.
 */
#include "common/base/option.h"
#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/output.h"
#include "common/base/text.h"
#include "common/base/version.h"
#include "coordinator/server/limits.h"
#include "coordinator/server/server.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const char *argp_program_version = "hslt-coordinator " HSLT_VERSION;

static const char doc[] =
	"Takes render jobs, hands their work to workers, merges what they send back into one image."
	"\v"
	"Examples:\n"
	"  hslt-coordinator --listen 127.0.0.1:7700 --spool ~/farm --status-socket ~/farm/status\n"
	"  hslt-coordinator --listen 0.0.0.0:7700 --tls ~/.hslt-ca/coordinator --spool /var/lib/hslt\n"
	"\n"
	"The spool keeps the jobs' results; one coordinator works with a spool at a time. A line of the log is written to "
	"stderr for every event. Under systemd it says when it is ready and feeds the watchdog, and a socket unit's Unix socket "
	"is taken as the status socket. HSLT_TLS stands in for --tls.\n"
	"Exit codes: 0 stopped by SIGTERM or SIGINT, 1 failed, 2 usage.";

enum {
	OPTION_SPOOL = 256,
	OPTION_STATUS,
	OPTION_GROUP,
	OPTION_PARTIALS,
	OPTION_PORT_FILE,
	OPTION_HEARTBEAT,
	OPTION_BLOBS,
	OPTION_TLS,
	OPTION_TLS_CHECK,
	OPTION_INSECURE,
	OPTION_JOURNAL,
	OPTION_CONNECTIONS,
	OPTION_FILM_MEMORY,
	OPTION_KEEP,
	OPTION_DAYS,
	OPTION_GB,
	OPTION_BANDWIDTH,
	OPTION_JOBS,
	OPTION_ASSETS,
	OPTION_FILM,
	OPTION_MUTATIONS,
	OPTION_VERIFY,
	OPTION_FAULTS,
	OPTION_FORGIVE,
	OPTION_LOSS,
};

static const struct argp_option options[] = {
	{"listen", 'l', "HOST:PORT", 0, "Where workers and clients connect (127.0.0.1:7700; port 0: any free one)", 0},
	{"spool", OPTION_SPOOL, "DIR", 0, "The folder of blobs, jobs and results", 0},
	{"status-socket", OPTION_STATUS, "PATH", 0, "Unix socket for hslt-status (or $HSLT_STATUS_SOCKET)", 0},
	{"status-group", OPTION_GROUP, "GROUP", 0, "Who may connect to it besides this user (nobody)", 0},
	{"keep-partials", OPTION_PARTIALS, "DIR", 0, "Write every partial EXR tile that is merged into DIR", 0},
	{"port-file", OPTION_PORT_FILE, "FILE", 0, "Write the port that was bound into FILE", 0},
	{"heartbeat", OPTION_HEARTBEAT, "SECONDS", 0, "How often workers must be heard (5)", 0},
	{"blobs", OPTION_BLOBS, "GB", 0,
	 "Limit of scene files kept in the spool; the oldest that no job needs go (100)", 0},
	{"tls", OPTION_TLS, "DIR", 0,
	 "ca.pem, cert.pem, key.pem, crl.pem: encrypt, and let in who has a certificate (hslt-ca)", 0},
	{"tls-check", OPTION_TLS_CHECK, "SECONDS", 0,
	 "How often certificates of live connections are checked again (60)", 0},
	{"journal", OPTION_JOURNAL, "MB", 0,
	 "Results of a running job that are kept before its films are written in their place (64)", 0},
	{"connections", OPTION_CONNECTIONS, "N", 0,
	 "At once, at most (10000, or as many as there are file descriptors)", 0},
	{"film-memory", OPTION_FILM_MEMORY, "MB", 0,
	 "Films of running jobs in memory; beyond, they are files of the spool (a quarter of the memory)", 0},
	{"keep-films", OPTION_KEEP, "MB", 0, "Films of jobs that are done, for hslt-job extend; the oldest go (2000)",
	 0},
	{"keep-days", OPTION_DAYS, "N", 0,
	 "Results of finished jobs; their records ten times as long; 0: for ever (30)", 0},
	{"keep-gb", OPTION_GB, "N", 0,
	 "Of all finished jobs together: films go first, then results, the oldest first; 0: any (0)", 0},
	{"worker-bandwidth", OPTION_BANDWIDTH, "MB/S", 0,
	 "Tiles that one thread of a worker may send on average: epochs of new jobs are at least that long (any)", 0},
	{"quota-jobs", OPTION_JOBS, "N", 0, "Jobs of a client that have not ended", 0},
	{"quota-assets", OPTION_ASSETS, "MB", 0, "Their files together, and those on their way", 0},
	{"quota-film", OPTION_FILM, "MB", 0,
	 "Films of a job: 72 bytes a pixel of its crop and group (--groups, up to 16 by itself)", 0},
	{"quota-mutations", OPTION_MUTATIONS, "N", 0, "Of a job, or samples; then each must say how many", 0},
	{"verify", OPTION_VERIFY, "P", 0,
	 "Least share of the epochs of each job, or percent, that two workers must compute alike (0)", 0},
	{"max-faults", OPTION_FAULTS, "N", 0,
	 "Wrong results, or invalid ones in a row, after which a worker is set aside for good (3)", 0},
	{"forgive", OPTION_FORGIVE, "NAME", 0, "A worker that was set aside in an earlier run comes back", 0},
	{"accept-loss", OPTION_LOSS, NULL, 0,
	 "Start although the spool has lost jobs: what is left of them is put into SPOOL/lost", 0},
	{"insecure", OPTION_INSECURE, NULL, 0, "Listen on other than loopback addresses without encryption", 0},
	{"verbose", 'v', NULL, 0, "Log every lease, too", 0},
	{0},
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct server_config *c = state->input;
	switch (key) {
	case 'l':
		c->listen = arg;
		return 0;
	case OPTION_SPOOL:
		c->spool = arg;
		return 0;
	case OPTION_STATUS:
		c->status_socket = arg;
		return 0;
	case OPTION_GROUP:
		c->status_group = arg;
		return 0;
	case OPTION_PARTIALS:
		c->keep_partials = arg;
		return 0;
	case OPTION_PORT_FILE:
		c->port_file = arg;
		return 0;
	case OPTION_HEARTBEAT:
		c->heartbeat_seconds = option_number(state, "--heartbeat", arg, 0.05, 3600);
		return 0;
	case OPTION_BLOBS:
		c->blob_bytes = (uint64_t)(1e9 * option_number(state, "--blobs", arg, 0.001, 1e6));
		return 0;
	case OPTION_TLS:
		c->tls = arg;
		return 0;
	case OPTION_TLS_CHECK:
		c->tls_check_seconds = option_number(state, "--tls-check", arg, 0.1, 3600);
		return 0;
	case OPTION_JOURNAL:
		c->journal_bytes = (uint64_t)(1e6 * option_number(state, "--journal", arg, 0.001, 1e6));
		return 0;
	case OPTION_CONNECTIONS:
		c->max_connections = (unsigned)option_number(state, "--connections", arg, 1, CONNECTIONS_MOST);
		return 0;
	case OPTION_FILM_MEMORY:
		c->film_bytes = (uint64_t)(1e6 * option_number(state, "--film-memory", arg, 0, 1e9));
		return 0;
	case OPTION_KEEP:
		c->keep_bytes = (uint64_t)(1e6 * option_number(state, "--keep-films", arg, 0, 1e9));
		return 0;
	case OPTION_DAYS:
		c->clear_seconds = 86400 * option_number(state, "--keep-days", arg, 0, 1e6);
		return 0;
	case OPTION_GB:
		c->clear_bytes = (uint64_t)(1e9 * option_number(state, "--keep-gb", arg, 0, 1e9));
		return 0;
	case OPTION_BANDWIDTH:
		c->worker_bandwidth = 1e6 * option_number(state, "--worker-bandwidth", arg, 1e-6, 1e6);
		return 0;
	case OPTION_JOBS:
		c->quota.jobs = (uint64_t)option_number(state, "--quota-jobs", arg, 1, 1e9);
		return 0;
	case OPTION_ASSETS:
		c->quota.asset_bytes = (uint64_t)(1e6 * option_number(state, "--quota-assets", arg, 1e-6, 1e12));
		return 0;
	case OPTION_FILM:
		c->quota.film_bytes = (uint64_t)(1e6 * option_number(state, "--quota-film", arg, 1e-6, 1e12));
		return 0;
	case OPTION_MUTATIONS:
		c->quota.mutations = (uint64_t)option_number(state, "--quota-mutations", arg, 1, 1e18);
		return 0;
	case OPTION_VERIFY:
		if (!text_share(arg, &c->verify))
			argp_error(state, "--verify takes a share from 0 to 1 or percent, not '%s'", arg);
		return 0;
	case OPTION_FAULTS:
		c->max_faults = (unsigned)option_number(state, "--max-faults", arg, 1, 1e6);
		return 0;
	case OPTION_FORGIVE:
		c->forgive = arg;
		return 0;
	case OPTION_LOSS:
		c->accept_loss = true;
		return 0;
	case OPTION_INSECURE:
		c->insecure = true;
		return 0;
	case 'v':
		log_set_level(LOG_LEVEL_DEBUG);
		return 0;
	case ARGP_KEY_END:
		if (!c->spool)
			argp_error(state, "--spool DIR is needed");
		if (c->status_group && !c->status_socket && !getenv("LISTEN_FDS"))
			argp_error(state, "--status-group is for a --status-socket");
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

int main(int argc, char **argv)
{
	struct server_config c;
	struct error e;
	mem_keep(128 << 20);
	server_config_init(&c);
	c.blob_bytes = 100000000000u;
	c.status_socket = getenv("HSLT_STATUS_SOCKET");
	c.tls = getenv("HSLT_TLS");
	output_check_at_exit();
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse, NULL, doc, NULL, NULL, NULL}, argc, argv, 0, NULL, &c);
	log_event(LOG_START, "program=hslt-coordinator version=%s", HSLT_VERSION);
	if (geteuid() == 0)
		log_event(LOG_ROOT,
			  "text=\"a coordinator needs no privileges: what comes over the network is read as root\"");
	int rc = server_run(&c, &e);
	if (rc)
		fprintf(stderr, "hslt-coordinator: %s\n", e.text);
	return rc == 0 ? 0 : rc == -EPERM || rc == -EINVAL ? 2 : 1;
}
