/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/server/server_options.h"

#include "common/base/program.h"
#include "coordinator/server/limits.h"

#include <stdlib.h>
#include <uv.h>

#define CONFIG struct server_config

static const struct option_row rows[] = {
	{"listen", 'l', "HOST:PORT",
	 "Address for workers and clients; a name means all its addresses, port 0 any free port",
	 OPTION_TEXT(CONFIG, listen), .standard = "127.0.0.1:7700"},
	{"spool", 0, "DIR", "Folder for scene files, jobs and results", OPTION_TEXT(CONFIG, spool), .needed = true},
	{"status-socket", 0, "PATH", "Unix socket for hslt-status", OPTION_TEXT(CONFIG, status_socket),
	 .environment = "HSLT_STATUS_SOCKET"},
	{"status-group", 0, "GROUP", "Group that may connect to the status socket, besides this user (none)",
	 OPTION_TEXT(CONFIG, status_group)},
	{"keep-partials", 0, "DIR", "Write each partial EXR tile to DIR as it is merged",
	 OPTION_TEXT(CONFIG, keep_partials)},
	{"port-file", 0, "FILE", "Write the number of the port in use to FILE", OPTION_TEXT(CONFIG, port_file)},
	{"heartbeat", 0, "SECONDS", "Interval at which workers must send something",
	 OPTION_SECONDS(CONFIG, heartbeat_seconds, 0.05, 3600), .standard = "5"},
	{"blobs", 0, "GB", "Limit of scene files in the spool; the least recently used that no job needs are deleted",
	 OPTION_SIZE(CONFIG, blob_bytes, 0.001, 1e6, 1e9), .standard = "100"},
	{"tls", 0, "DIR", "ca.pem, cert.pem, key.pem, crl.pem, made by hslt-ca: encryption and authentication",
	 OPTION_TEXT(CONFIG, tls), .environment = "HSLT_TLS"},
	{"tls-check", 0, "SECONDS", "Interval at which the certificates of open connections are checked",
	 OPTION_SECONDS(CONFIG, tls_check_seconds, 0.1, 3600), .standard = "60"},
	{"journal", 0, "MB", "Size of a running job's journal beyond which its films are written as a checkpoint",
	 OPTION_SIZE(CONFIG, journal_bytes, 0.001, 1e6, 1e6), .standard = "64"},
	{"connections", 0, "N", "Maximum number of connections (10000, or as file descriptors allow)",
	 OPTION_COUNT(CONFIG, max_connections, 1, CONNECTIONS_MOST)},
	{"film-memory", 0, "MB",
	 "Limit of running jobs' films in memory; further films are files in the spool (a quarter of the "
	 "memory)",
	 OPTION_SIZE(CONFIG, film_bytes, 0, 1e9, 1e6)},
	{"keep-films", 0, "MB", "Limit of finished jobs' films, kept for hslt-job extend; the oldest are deleted first",
	 OPTION_SIZE(CONFIG, keep_bytes, 0, 1e9, 1e6), .standard = "2000"},
	{"keep-days", 0, "N",
	 "Days to keep results of finished jobs; their records are kept ten times as long; 0: forever",
	 OPTION_TIME(CONFIG, clear_seconds, 0, 1e6, 86400), .standard = "30"},
	{"keep-gb", 0, "N",
	 "Limit of all files of finished jobs; films are deleted first, then results, oldest first; 0: none",
	 OPTION_SIZE(CONFIG, clear_bytes, 0, 1e9, 1e9), .standard = "0"},
	{"worker-bandwidth", 0, "MB/S",
	 "Average rate at which one thread of a worker may send tiles, which sets a lower limit to the "
	 "epochs of new jobs (unlimited)",
	 OPTION_SIZE(CONFIG, worker_bandwidth, 1e-6, 1e6, 1e6)},
	{"quota-jobs", 0, "N", "Maximum number of live jobs of one client", OPTION_COUNT(CONFIG, quota.jobs, 1, 1e9)},
	{"quota-assets", 0, "MB", "Files of a client's live jobs in total, including uploads",
	 OPTION_SIZE(CONFIG, quota.asset_bytes, 1e-6, 1e12, 1e6)},
	{"quota-film", 0, "MB", "Films of one job: 72 bytes per pixel of its crop and group (--groups, 16 by default)",
	 OPTION_SIZE(CONFIG, quota.film_bytes, 1e-6, 1e12, 1e6)},
	{"quota-mutations", 0, "N", "Mutations or samples of one job; every job must then have such a bound",
	 OPTION_COUNT(CONFIG, quota.mutations, 1, 1e18)},
	{"verify", 0, "P", "Minimum share or percentage of each job's epochs on which two workers must agree",
	 OPTION_RATIO(CONFIG, verify, 0, 1), .standard = "0"},
	{"max-faults", 0, "N",
	 "Number of wrong results, or of invalid ones in a row, after which a worker is quarantined permanently",
	 OPTION_COUNT(CONFIG, max_faults, 1, 1e6), .standard = "3"},
	{"forgive", 0, "NAME", "Readmit a worker that was quarantined in an earlier run", OPTION_TEXT(CONFIG, forgive)},
	{"accept-loss", 0, NULL, "Start even if the spool has lost jobs; what is left of them is moved to SPOOL/lost",
	 OPTION_FLAG(CONFIG, accept_loss)},
	{"insecure", 0, NULL, "Listen on addresses other than loopback without encryption",
	 OPTION_FLAG(CONFIG, insecure)},
	{"verbose", 'v', NULL, "Also log every lease", OPTION_TAKE(program_take_verbose)},
	{0},
};

static int check(void *target, struct error *e)
{
	const struct server_config *c = target;
	if (c->status_group && !c->status_socket && !getenv("LISTEN_FDS"))
		return error_set(e, EINVAL, "--status-group requires --status-socket");
	return 0;
}

const struct program server_program = {
	.name = "hslt-coordinator",
	.summary = "Accepts render jobs, distributes their work to workers, and merges the results into images.",
	.examples = "hslt-coordinator --listen 127.0.0.1:7700 --spool ~/farm --status-socket ~/farm/status\n"
		    "hslt-coordinator --listen 0.0.0.0:7700 --tls ~/.hslt-ca/coordinator --spool /var/lib/hslt",
	.details =
		"The spool keeps the jobs' results; only one coordinator can use a spool at a time. Every event is "
		"logged as a line on stderr. Under systemd it reports when it is ready, notifies the watchdog, and uses a socket unit's "
		"Unix socket as its status socket.\nSizes may also be written as 500M, 20G or 2T, times 90s, 5m, 2h or 3d, and "
		"counts 1.5k, 2M or 1G.",
	.exits = "0 stopped by SIGTERM or SIGINT, 1 failed, 2 usage",
	.own = {(const struct option_group[]){{NULL, rows}, {0}}, check},
};

/* Returns a quarter of the memory that this process may use. */
static uint64_t quarter_of_memory(void)
{
	uint64_t all = uv_get_total_memory(), ours = uv_get_constrained_memory();
	return (ours && ours < all ? ours : all) / 4;
}

void server_config_init(struct server_config *c)
{
	*c = (struct server_config){.retry_seconds = 2,
				    .max_fetches = FETCHES_MOST,
				    .film_bytes = quarter_of_memory(),
				    .waiting_bytes = quarter_of_memory(),
				    .receive_bytes = quarter_of_memory() / 2,
				    .state_bytes = quarter_of_memory(),
				    .send_bytes = quarter_of_memory() / 2,
				    .hello_seconds = 10,
				    .stall_seconds = 30};
	option_defaults(&server_program.own, c, NULL);
}
