/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The coordinator's shell: carries out what the core says. One loop, one thread; heavy work on films goes to the pool.
 * server_run returns when a signal has stopped it.
 */
#ifndef COORDINATOR_SHELL_SERVER_H
#define COORDINATOR_SHELL_SERVER_H

#include "common/blob/blob.h"
#include "common/net/conn.h"
#include "coordinator/core/farm.h"
#include "coordinator/shell/live_job.h"
#include "coordinator/shell/quota.h"
#include "coordinator/store/ledger.h"
#include "coordinator/store/seen.h"
#include "coordinator/store/spool.h"

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
	unsigned max_faults;	  /* of a worker, before it is set aside */
	bool accept_loss;	  /* go on without the jobs that the spool has lost */
	const char *forgive;	  /* the name of a worker that was set aside and may come back; NULL: none */
	uint64_t film_bytes; /* of running jobs' films in memory; those of further jobs are mapped files of the spool */
	uint64_t waiting_bytes;	 /* of results that wait for films that are being read */
	double worker_bandwidth; /* bytes of tiles a second that one thread may send on average, for new jobs' epochs;
				    0: any */
	double hello_seconds, stall_seconds; /* how long a peer may take to say hello, to finish a frame */
};
void server_config_init(struct server_config *c);

int server_run(const struct server_config *c, struct error *e);

/* ---- for the parts of the shell, and whoever turns its loop ---- */

struct server;

/* It listens; the jobs of an earlier life are read by its loop (recovery.h). */
int server_open(struct server **s, const struct server_config *c, struct error *e);
int server_await_jobs(struct server *s, struct error *e); /* turns the loop until they are */
void server_close(struct server *s);			  /* stops it, if no signal has */

struct incoming;
struct session;
struct status_socket;
struct clearing;
struct durable_ack;
struct recovery;
struct ending;

/* An event for the core that came up while its last update was carried out. */
struct deferred {
	struct deferred *next;
	struct event event;
	char text[256];
};

enum { SESSION_BUCKETS = 4096 };
enum { ENDED_MAX = 200 /* ended jobs in the lists; older ones can still be fetched */ };

struct server {
	struct server_config config;
	uv_loop_t loop;
	struct tls *tls; /* NULL: plaintext */
	uv_tcp_t listener;
	uv_timer_t wake, tick, drain; /* drain: results that waited for a canvas */
	uv_prepare_t look;
	uv_check_t check;
	double looked, read; /* s: when the loop looked at its sockets last; what came before this has been read */
	uv_signal_t on_term, on_int;
	struct farm *farm;
	struct spool *spool;
	struct blob_store *blobs;
	struct session *sessions, *by_id[SESSION_BUCKETS];
	unsigned session_count, fetches;
	struct live_job *orders;
	struct job_record *ended; /* ENDED_MAX, oldest first */
	size_t ended_count;
	struct deferred *deferred, **deferred_last;
	struct ledger *ledger;
	struct recovery *recovery; /* the jobs of an earlier life are being read; NULL: no more */
	size_t held_bytes;	   /* of what peers ask for meanwhile */
	int fault;		   /* why it stops by itself; 0: it does not */
	struct error fault_error;
	uint64_t *restored; /* ids of the jobs that went on when this life began */
	size_t restored_count;
	struct durable_ack *acks, **acks_last; /* that wait for a flush */
	struct durable_ack *parked;	       /* ... for a journal that failed to be a good one again */
	struct ending *endings;		       /* jobs that ended and whose records could not be written yet */
	double endings_again;
	struct seen seen;	   /* when this life began */
	double folders_next;	   /* when jobs' folders are looked for */
	double clear_next;	   /* when finished jobs are looked at again */
	struct clearing *clearing; /* they are being looked at */
	bool flushing;
	uint64_t last_peer;
	uint64_t garbled; /* connections on which bytes were changed */
	struct status_socket *status;
	bool stepping, stopping;
	bool feeding;			/* late results */
	bool caller_waits;		/* nobody could be let in: to be tried again */
	bool checkpointing;		/* of some job, by the pool */
	struct session *extending;	/* those with extensions that wait, in the order in which they came */
	const struct live_job *reading; /* of an ended job: the pool reads its films, and all else of it but id and plan
					   is the pool's */
	double tls_next;		/* when its files are looked at again */
	double watchdog,
		watchdog_next; /* the service manager's patience (0: none waits), and when it hears of us again */
	uint64_t changes;      /* grows with whatever the status shows */
};

/* No more is begun; the loop ends when what is under way has ended. */
void server_stop(struct server *s);
double server_now(const struct server *s);
/* Gives the event to the core and carries out the update and all that follows from it. */
void server_step(struct server *s, struct event *ev);
/* The same, of an event that brought more (incoming.h). Not while an update is carried out. */
void server_step_with(struct server *s, struct event *ev, const struct incoming *in);
/* Later, when the current update is carried out. Copies the text. */
void server_defer(struct server *s, const struct event *ev);
void server_job_broken(struct server *s, uint64_t job, const char *text);

struct live_job *server_live_job(const struct server *s, uint64_t job);
/* Where the films of a job of this plan go: NULL: into memory, which is never kept waiting by the disk. */
const char *server_film_folder(const struct server *s, const struct plan *p);
/* Some order is not busy any more: what waited for its canvas goes on. Orders that have ended are gone then. */
void server_order_free_again(struct server *s);
/* A result from a worker: now, or when the canvas is free. May take either. */
void server_result(struct server *s, uint64_t peer, struct envelope *env, struct buf *payload);

/* false: no such job. Looks at living jobs, at those that are being read, then at ended ones, then into the spool. */
bool server_view(struct server *s, uint64_t job, struct job_view *v);
/* All that are listed, ascending by id; mem_alloc'd. */
size_t server_views(struct server *s, struct job_view **views);

#endif
