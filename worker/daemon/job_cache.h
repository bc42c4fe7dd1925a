/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job at a worker: its description (JobInfo), its files in the cache, its world. The world is built on a thread of
 * the pool and shared by all leases; files that the cache has are read by libuv's pool, some megabytes at a time;
 * everything else is the loop's thread.
 */
#ifndef WORKER_DAEMON_JOB_CACHE_H
#define WORKER_DAEMON_JOB_CACHE_H

#include "common/blob/blob_check.h"
#include "common/wire/plan_wire.h"
#include "worker/daemon/cache.h"
#include "worker/daemon/thread_pool.h"
#include "worker/render/render.h"

enum job_cache_state {
	JOB_CACHE_ASKED,    /* JobGet was sent */
	JOB_CACHE_FETCHING, /* files are missing */
	JOB_CACHE_BUILDING, /* its world is being built */
	JOB_CACHE_READY,
	JOB_CACHE_FAILED, /* error is the reason */
};

enum job_cache_files {
	JOB_CACHE_HAS,	 /* all of them */
	JOB_CACHE_LACKS, /* `wanted` must be fetched */
	JOB_CACHE_READS, /* `wanted` is being read by libuv's pool: `read` is called, then ask again */
};

struct job_cache {
	struct task task; /* building */
	struct job_cache *next;
	uint64_t job;
	enum job_cache_state state;
	struct envelope info; /* JobInfo, owned */
	struct plan plan;
	struct blob_store *blobs;
	bool *held;		 /* by file: in the cache, and held */
	char **paths;		 /* by file, for the builder's thread */
	struct blob_hash wanted; /* while FETCHING: the blob being waited for */
	struct {
		uv_work_t work;
		struct blob_check *check; /* NULL: nothing is being read */
		size_t file;
		bool more;
		bool failed;			  /* the file cannot be used: it is fetched */
		const bool *stop;		  /* there is nothing more to read */
		void (*done)(struct job_cache *); /* on the loop's thread */
	} reading;
	struct world *world;
	struct brightness *map; /* see render_map_new */
	struct lease_key waits; /* one of the leases that wait for the world; job 0: none */
	unsigned users;		/* number of leases that need it */
	uint64_t last_used;	/* value of the counter of uses */
	bool ended;		/* the coordinator does not need it any more */
	bool confirmed;		/* on this connection: the coordinator's job of this number is this one */
	double build_seconds;
	void *owner;
	void (*built)(struct job_cache *); /* called on the loop's thread: READY or FAILED */
	struct error error;
	bool own;	/* FAILED: because of this machine, not the job */
	bool no_memory; /* FAILED: there was not enough for its world */
	bool beside;	/* other worlds have been in memory since its build, or since its last lease, began */
};

struct job_cache *job_cache_find(struct job_cache *all, uint64_t job); /* NULL: none has this number */
int job_cache_new(struct job_cache **b, uint64_t job, struct blob_store *blobs, struct error *e);
/* Not while BUILDING, nor while a file is being read. */
void job_cache_free(struct job_cache *b);

/* Takes the answer to JobGet; then call job_cache_look. -EBADMSG. */
int job_cache_set_info(struct job_cache *b, struct envelope *info, struct error *e);
/* Whether it is the same job: number and everything but the bounds, which may have been changed. If that cannot be
 * known: false. */
bool job_cache_is_of(const struct job_cache *b, const Farm__JobInfo *info);
/* Holds the files in the cache, up to the first that it lacks, or that has to be read first. b->reading.stop and done
 * must be set. */
enum job_cache_files job_cache_look(struct job_cache *b, uv_loop_t *loop);
/* All files are there: builds the world in the thread pool. */
int job_cache_build(struct job_cache *b, struct thread_pool *c, struct error *e);

/* A lease of b begins, or building its world does: notes which of all the worlds are in memory beside that of b. */
void job_cache_note_company(struct job_cache *b, struct job_cache *all, bool building);
/* An allocation failed for b. If other worlds had that memory, it is noted for the worker (work.h). */
void job_cache_lacked_memory(const struct job_cache *b);

#endif
