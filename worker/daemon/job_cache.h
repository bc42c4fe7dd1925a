/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job at a worker: what it is (JobInfo), its files in the cache, its world. The world is built on a thread of the
 * thread pool and shared by all leases; everything else is the loop's thread.
 */
#ifndef WORKER_DAEMON_JOB_CACHE_H
#define WORKER_DAEMON_JOB_CACHE_H

#include "common/wire/plan_wire.h"
#include "worker/daemon/cache.h"
#include "worker/daemon/thread_pool.h"
#include "worker/render/render.h"

enum job_cache_state {
	JOB_CACHE_ASKED,    /* JobGet was sent */
	JOB_CACHE_FETCHING, /* files are missing */
	JOB_CACHE_BUILDING, /* its world is being built */
	JOB_CACHE_READY,
	JOB_CACHE_FAILED, /* error says why */
};

struct job_cache {
	struct task task; /* building */
	struct job_cache *next;
	uint64_t job;
	enum job_cache_state state;
	struct envelope info; /* JobInfo, owned */
	struct plan plan;
	struct blob_store *blobs;
	bool *held;		 /* by file: in the cache, held */
	char **paths;		 /* by file, for the builder's thread */
	struct blob_hash wanted; /* while FETCHING: the blob that it waits for */
	struct world *world;
	struct lease_key waits; /* one of the leases that wait for the world; job 0: none */
	unsigned users;		/* leases that need it */
	uint64_t last_used;	/* counter */
	bool ended;		/* the coordinator needs it no more */
	double build_seconds;
	void *owner;
	void (*built)(struct job_cache *); /* on the loop's thread: READY or FAILED */
	struct error error;
	bool own; /* FAILED: this machine is at fault, not the job */
};

int job_cache_new(struct job_cache **b, uint64_t job, struct blob_store *blobs, struct error *e);
/* Not while BUILDING. */
void job_cache_free(struct job_cache *b);

/* Takes the answer to JobGet; then job_cache_next_missing. -EBADMSG. */
int job_cache_set_info(struct job_cache *b, struct envelope *info, struct error *e);
/* Whether it is the same job: number and all, but for the bounds, which may have been moved. Where it cannot be known:
 * not. */
bool job_cache_is_of(const struct job_cache *b, const Farm__JobInfo *info);
/* Holds what is there; the next hash to fetch into b->wanted. false: all files are there. */
bool job_cache_next_missing(struct job_cache *b);
/* All files are there: builds the world on the thread pool. */
int job_cache_build(struct job_cache *b, struct thread_pool *c, struct error *e);

#endif
