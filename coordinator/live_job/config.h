/* SPDX-License-Identifier: Apache-2.0 */
/* The configuration of the coordinator, which coordinator/main.c reads from the command line. */
#ifndef COORDINATOR_LIVE_JOB_CONFIG_H
#define COORDINATOR_LIVE_JOB_CONFIG_H

#include "coordinator/live_job/quota.h"

#include <stdbool.h>

struct server_config {
	const char *listen_address, *spool_folder;
	const char *status_socket;   /* NULL: none */
	const char *status_group;    /* group that may connect to it; NULL: only the coordinator's own user */
	const char *partials_folder; /* folder for partial tiles; NULL: none */
	const char *port_file;	     /* file to which the port is written; NULL: none */
	const char *tls_folder;	     /* see common/net/tls.h; NULL or "": plaintext */
	double tls_check_seconds;    /* seconds between checks of the certificates of open connections */
	bool insecure;
	struct quota quota;	      /* of each owner */
	uint64_t max_blob_bytes;      /* limit on scene files in the spool; 0: none */
	double retention_seconds;     /* how long results of finished jobs are kept; 0: forever */
	uint64_t retention_bytes;     /* limit on all files of finished jobs; 0: none */
	uint64_t retained_film_bytes; /* limit on films of finished jobs, which extensions need; 0: keep none */
	double retry_seconds;	      /* between attempts to write after the disk refused */
	uint64_t max_journal_bytes;   /* a journal that grows beyond this is replaced by a checkpoint */
	/* A worker that is silent for three intervals loses its leases, for six its connection. */
	double heartbeat_seconds;
	unsigned max_connections;   /* 0: derived from the limit of file descriptors */
	unsigned max_fetches;	    /* limit on concurrent fetches by clients */
	double min_verify_fraction; /* minimum fraction of each job's leases to verify */
	/* Number of wrong results, or of faults in a row, after which a worker is quarantined. */
	unsigned max_faults;
	bool accept_loss;	     /* start without the jobs that the spool has lost */
	const char *forgiven_worker; /* name of a quarantined worker to readmit; NULL: none */
	/* Limit on running jobs' films in memory; the films of further jobs are mapped files in the spool. */
	uint64_t max_film_bytes;
	uint64_t max_waiting_bytes; /* limit on results that wait for films that are being read */
	uint64_t max_receive_bytes; /* limit on messages that are being received; further ones wait */
	/* Limit on one job's chain states in memory, supposing that each is as long as possible; for those of all
	 * jobs see jobs/storage.h. */
	uint64_t max_state_bytes;
	/* Limit on data waiting to be sent; beyond it peers that do not read are disconnected. */
	uint64_t max_send_bytes;
	/* Bytes per second of tiles that one thread may send on average, which determines the length of new jobs'
	 * epochs; 0: unlimited. */
	double worker_bandwidth;
	/* Time for a new peer to say hello, and for any peer to complete a frame. */
	double hello_seconds, stall_seconds;
};

#endif
