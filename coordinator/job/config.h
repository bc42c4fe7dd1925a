/* SPDX-License-Identifier: Apache-2.0 */
/* What the coordinator was started with; coordinator/main.c reads it from the command line. */
#ifndef COORDINATOR_JOB_CONFIG_H
#define COORDINATOR_JOB_CONFIG_H

#include "coordinator/job/quota.h"

#include <stdbool.h>

struct server_config {
	const char *listen, *spool;
	const char *status_socket; /* NULL: none */
	const char *status_group;  /* who may connect to it besides us; NULL: nobody */
	const char *keep_partials; /* NULL: none */
	const char *port_file;	   /* NULL: none; the port that was bound is written there */
	const char *tls;	   /* a folder (common/net/tls.h); NULL or "": plaintext */
	double tls_check_seconds;  /* how often certificates of live connections are checked again */
	bool insecure;
	struct quota quota;	  /* of each client */
	uint64_t blob_bytes;	  /* the spool's limit of scene files; 0: none */
	double clear_seconds;	  /* results of finished jobs are kept so long; 0: for ever */
	uint64_t clear_bytes;	  /* of all finished jobs, their films included; 0: any */
	uint64_t keep_bytes;	  /* of films of jobs that are done, so that they can be extended; 0: none are kept */
	double retry_seconds;	  /* between tries of what the disk did not take */
	uint64_t journal_bytes;	  /* a job's journal that is longer is cut by a checkpoint */
	double heartbeat_seconds; /* a worker silent for 3 of them loses its leases, for 6 its connection */
	unsigned max_connections; /* 0: by the file descriptors that there are */
	unsigned max_fetches;	  /* files that clients have begun to fetch, at a time */
	double verify;		  /* least share of the leases of each job that two workers compute */
	unsigned max_faults;	  /* of a worker, before it is quarantined */
	bool accept_loss;	  /* go on without the jobs that the spool has lost */
	const char *forgive;	  /* the name of a worker that was quarantined and may come back; NULL: none */
	uint64_t film_bytes; /* of running jobs' films in memory; those of further jobs are mapped files of the spool */
	uint64_t waiting_bytes;	 /* of results that wait for films that are being read */
	double worker_bandwidth; /* bytes of tiles a second that one thread may send on average, for new jobs' epochs;
				    0: any */
	double hello_seconds, stall_seconds; /* how long a peer may take to say hello, to finish a frame */
};

#endif
