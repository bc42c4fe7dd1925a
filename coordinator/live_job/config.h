/* SPDX-License-Identifier: Apache-2.0 */
/* The configuration of the coordinator, which coordinator/main.c reads from the command line. */
#ifndef COORDINATOR_LIVE_JOB_CONFIG_H
#define COORDINATOR_LIVE_JOB_CONFIG_H

#include "coordinator/live_job/quota.h"

#include <stdbool.h>

struct server_config {
	const char *listen, *spool;
	const char *status_socket; /* NULL: none */
	const char *status_group;  /* group that may connect to it; NULL: only our own user */
	const char *keep_partials; /* NULL: none */
	const char *port_file;	   /* file for the port that was bound; NULL: none */
	const char *tls;	   /* folder (common/net/tls.h); NULL or "": plaintext */
	double tls_check_seconds;  /* seconds between checks of the certificates of open connections */
	bool insecure;
	struct quota quota;	  /* of each client */
	uint64_t blob_bytes;	  /* limit of scene files in the spool; 0: none */
	double clear_seconds;	  /* how long results of finished jobs are kept; 0: forever */
	uint64_t clear_bytes;	  /* limit for all finished jobs, with films; 0: none */
	uint64_t keep_bytes;	  /* limit for films of finished jobs, which extensions need; 0: keep none */
	double retry_seconds;	  /* between attempts to write what the disk refused */
	uint64_t journal_bytes;	  /* a journal longer than this is replaced by a checkpoint */
	double heartbeat_seconds; /* a worker that is silent for 3 of them loses its leases, for 6 its connection */
	unsigned max_connections; /* 0: derived from the limit of file descriptors */
	unsigned max_fetches;	  /* limit of concurrent fetches by clients */
	double verify;		  /* minimum share of each job's leases to verify */
	unsigned max_faults;	  /* wrong results of a worker before it is quarantined */
	bool accept_loss;	  /* start without the jobs that the spool has lost */
	const char *forgive;	  /* the name of a quarantined worker to readmit; NULL: none */
	uint64_t film_bytes;	/* limit of running jobs' films in memory; those of further jobs are mapped files of the
				   spool */
	uint64_t waiting_bytes; /* limit of results waiting for films that are being read */
	uint64_t receive_bytes; /* limit of messages that are being received; further ones wait */
	uint64_t state_bytes;	/* limit of one job's chain states in memory, if each is as long as it can be; those of
				   all jobs: jobs/room.h */
	uint64_t send_bytes;	/* limit of what waits to be sent; peers that do not read are disconnected */
	double worker_bandwidth; /* bytes of tiles a second that one thread may send on average, for the epochs of new
				    jobs; 0: unlimited */
	double hello_seconds, stall_seconds; /* time for a peer to say hello; to complete a frame */
};

#endif
