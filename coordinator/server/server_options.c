/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/server/server_options.h"

#include "common/base/program.h"
#include "coordinator/server/limits.h"

#include <stdlib.h>
#include <uv.h>

#define CONFIG struct server_config

static const struct option_row option_rows[] = {
	{"listen", 'l', "HOST:PORT",
	 "Address for workers and clients; a name means all its addresses, port 0 any free port",
	 OPTION_TEXT(CONFIG, listen_address), .default_value = "127.0.0.1:7700"},
	{"spool", 0, "DIR", "Folder for scene files, jobs and results", OPTION_TEXT(CONFIG, spool_folder),
	 .is_required = true},
	{"status-socket", 0, "PATH", "Unix socket for hslt-status", OPTION_TEXT(CONFIG, status_socket),
	 .environment = "HSLT_STATUS_SOCKET"},
	{"status-group", 0, "GROUP", "Group that may connect to the status socket, besides this user (none)",
	 OPTION_TEXT(CONFIG, status_group)},
	{"keep-partials", 0, "DIR", "Write each partial EXR tile to DIR as it is merged",
	 OPTION_TEXT(CONFIG, partials_folder)},
	{"port-file", 0, "FILE", "Write the number of the port in use to FILE", OPTION_TEXT(CONFIG, port_file)},
	{"heartbeat", 0, "SECONDS", "Interval at which workers must send something",
	 OPTION_SECONDS(CONFIG, heartbeat_seconds, 0.05, 3600), .default_value = "5"},
	{"blobs", 0, "GB", "Limit of scene files in the spool; the least recently used that no job needs are deleted",
	 OPTION_SIZE(CONFIG, max_blob_bytes, 0.001, 1e6, 1e9), .default_value = "100"},
	{"tls", 0, "DIR", "ca.pem, cert.pem, key.pem, crl.pem, made by hslt-ca: encryption and authentication",
	 OPTION_TEXT(CONFIG, tls_folder), .environment = "HSLT_TLS"},
	{"tls-check", 0, "SECONDS", "Interval at which the certificates of open connections are checked",
	 OPTION_SECONDS(CONFIG, tls_check_seconds, 0.1, 3600), .default_value = "60"},
	{"journal", 0, "MB", "Size of a running job's journal beyond which its films are written as a checkpoint",
	 OPTION_SIZE(CONFIG, max_journal_bytes, 0.001, 1e6, 1e6), .default_value = "64"},
	{"connections", 0, "N", "Maximum number of connections (10000, or as file descriptors allow)",
	 OPTION_COUNT(CONFIG, max_connections, 1, CONNECTIONS_MAX)},
	{"film-memory", 0, "MB",
	 "Limit of running jobs' films in memory; further films are files in the spool (a quarter of the "
	 "memory)",
	 OPTION_SIZE(CONFIG, max_film_bytes, 0, 1e9, 1e6)},
	{"keep-films", 0, "MB", "Limit of finished jobs' films, kept for hslt-job extend; the oldest are deleted first",
	 OPTION_SIZE(CONFIG, retained_film_bytes, 0, 1e9, 1e6), .default_value = "2000"},
	{"keep-days", 0, "N",
	 "Days to keep results of finished jobs; their records are kept ten times as long; 0: forever",
	 OPTION_TIME(CONFIG, retention_seconds, 0, 1e6, 86400), .default_value = "30"},
	{"keep-gb", 0, "N",
	 "Limit of all files of finished jobs; films are deleted first, then results, oldest first; 0: none",
	 OPTION_SIZE(CONFIG, retention_bytes, 0, 1e9, 1e9), .default_value = "0"},
	{"worker-bandwidth", 0, "MB/S",
	 "Average rate at which one thread of a worker may send tiles, which sets a lower limit to the "
	 "epochs of new jobs (unlimited)",
	 OPTION_SIZE(CONFIG, worker_bandwidth, 1e-6, 1e6, 1e6)},
	{"quota-jobs", 0, "N", "Maximum number of live jobs of one client",
	 OPTION_COUNT(CONFIG, quota.max_jobs, 1, 1e9)},
	{"quota-assets", 0, "MB", "Files of a client's live jobs in total, including uploads",
	 OPTION_SIZE(CONFIG, quota.max_asset_bytes, 1e-6, 1e12, 1e6)},
	{"quota-film", 0, "MB", "Films of one job: 72 bytes per pixel of its crop and group (--groups, 16 by default)",
	 OPTION_SIZE(CONFIG, quota.max_film_bytes, 1e-6, 1e12, 1e6)},
	{"quota-mutations", 0, "N", "Mutations or samples of one job; every job must then have such a bound",
	 OPTION_COUNT(CONFIG, quota.max_mutations, 1, 1e18)},
	{"verify", 0, "P", "Minimum share or percentage of each job's epochs on which two workers must agree",
	 OPTION_RATIO(CONFIG, min_verify_fraction, 0, 1), .default_value = "0"},
	{"max-faults", 0, "N",
	 "Number of wrong results, or of invalid ones in a row, after which a worker is quarantined permanently",
	 OPTION_COUNT(CONFIG, max_faults, 1, 1e6), .default_value = "3"},
	{"forgive", 0, "NAME", "Readmit a worker that was quarantined in an earlier run",
	 OPTION_TEXT(CONFIG, forgiven_worker)},
	{"accept-loss", 0, NULL, "Start even if the spool has lost jobs; what is left of them is moved to SPOOL/lost",
	 OPTION_FLAG(CONFIG, accept_loss)},
	{"insecure", 0, NULL, "Listen on addresses other than loopback without encryption",
	 OPTION_FLAG(CONFIG, insecure)},
	{"verbose", 'v', NULL, "Also log every lease", OPTION_CUSTOM(program_parse_verbose)},
	{0},
};

static int check_options(void *target, struct error *e)
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
	.exit_codes = "0 stopped by SIGTERM or SIGINT, 1 failed, 2 usage",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_options},
};

/* Returns a quarter of the memory that this process may use. */
static uint64_t quarter_of_memory(void)
{
	uint64_t total = uv_get_total_memory(), constrained = uv_get_constrained_memory();
	return (constrained && constrained < total ? constrained : total) / 4;
}

void server_config_init(struct server_config *c)
{
	*c = (struct server_config){.retry_seconds = 2,
				    .max_fetches = FETCHES_MAX,
				    .max_film_bytes = quarter_of_memory(),
				    .max_waiting_bytes = quarter_of_memory(),
				    .max_receive_bytes = quarter_of_memory() / 2,
				    .max_state_bytes = quarter_of_memory(),
				    .max_send_bytes = quarter_of_memory() / 2,
				    .hello_seconds = 10,
				    .stall_seconds = 30};
	option_set_defaults(&server_program.options, c, NULL);
}
