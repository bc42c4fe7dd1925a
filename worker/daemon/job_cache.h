/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job at a worker: its description (JobInfo), its files in the cache, and its world, the scene ready for rendering.
 * The world is built on a thread of the pool and shared by all leases. Cached files are checked by libuv's pool, some
 * megabytes at a time. Everything else runs on the loop's thread.
 */
#ifndef WORKER_DAEMON_JOB_CACHE_H
#define WORKER_DAEMON_JOB_CACHE_H

#include "common/blob/blob_check.h"
#include "common/wire/plan_wire.h"
#include "worker/daemon/cache.h"
#include "worker/daemon/thread_pool.h"
#include "worker/render/render.h"

enum job_cache_state {
	JOB_CACHE_REQUESTED, /* JobGet has been sent */
	JOB_CACHE_FETCHING,  /* files are missing or being checked */
	JOB_CACHE_BUILDING,  /* the world is being built */
	JOB_CACHE_READY,     /* leases can be rendered */
	JOB_CACHE_FAILED,    /* `error` is the reason */
};

enum job_cache_files {
	JOB_CACHE_FILES_COMPLETE,  /* all files are in the cache */
	JOB_CACHE_FILE_MISSING,	   /* the file `wanted_file` must be fetched */
	JOB_CACHE_FILE_BEING_READ, /* `wanted_file` is being read by libuv's pool: look again once reading.on_done has
				      been called */
};

struct job_cache {
	struct task task; /* builds the world */
	struct job_cache *next;
	uint64_t job;
	enum job_cache_state state;
	struct envelope info; /* JobInfo, owned */
	struct plan plan;
	struct blob_store *blobs;
	bool *is_held;		      /* by file: it is in the cache, and held for this job */
	char **paths;		      /* by file, for the thread that builds the world */
	struct blob_hash wanted_file; /* while FETCHING: the file being waited for */
	struct {
		uv_work_t work;
		struct blob_check *check; /* NULL: nothing is being read */
		size_t file_index;
		bool has_more;			     /* its end has not been reached */
		bool has_failed;		     /* the file cannot be used and must be fetched */
		const bool *stop_requested;	     /* set when the worker stops: ends the reading */
		void (*on_done)(struct job_cache *); /* called on the loop's thread when a file has been read */
	} reading;
	struct world *world;
	struct brightness *brightness_map; /* see render_brightness_map_new */
	struct lease_key waiting_lease;	   /* one of the leases that wait for the world; job 0: none */
	unsigned lease_count;		   /* number of leases that need the world */
	uint64_t last_used;		   /* value of agent.use_counter at the last use */
	bool has_ended;			   /* the job has ended at the coordinator */
	bool is_confirmed; /* on this connection, the coordinator has said that this number is still this job's */
	double build_seconds;
	void *owner;
	void (*on_built)(struct job_cache *); /* called on the loop's thread when the state is READY or FAILED */
	struct error error;
	bool is_worker_at_fault; /* FAILED because of this machine, not the job */
	bool is_out_of_memory;	 /* FAILED because there was not enough memory for the world */
	bool had_other_worlds;	 /* other worlds have been in memory since the build, or since the last lease, began */
};

struct job_cache *job_cache_find(struct job_cache *all, uint64_t job); /* NULL if none has this number */
int job_cache_new(struct job_cache **out, uint64_t job, struct blob_store *blobs, struct error *e); /* 0 or -ENOMEM */
/* Must not be called while BUILDING, nor while a file is being read. */
void job_cache_free(struct job_cache *cache);

/* Takes the answer to JobGet, which it then owns; call job_cache_check_files next. Returns 0, -EBADMSG or -ENOMEM. */
int job_cache_set_info(struct job_cache *cache, struct envelope *info, struct error *e);
/* Returns whether a description is that of this job: all but the bounds, which may have been changed, must be equal.
 * False also if memory is out. */
bool job_cache_matches(const struct job_cache *cache, const Farm__JobInfo *info);
/* Holds the job's files that are in the cache, up to the first that is missing or must be read first.
 * reading.stop_requested and reading.on_done must be set. */
enum job_cache_files job_cache_check_files(struct job_cache *cache, uv_loop_t *loop);
/* Builds the world in the thread pool, after job_cache_check_files has returned JOB_CACHE_FILES_COMPLETE. Returns 0 or
 * -ENOMEM. */
int job_cache_build(struct job_cache *cache, struct thread_pool *pool, struct error *e);

/* Call when a lease of the job begins, or the building of its world does: notes whether other worlds are in memory. */
void job_cache_note_other_worlds(struct job_cache *cache, struct job_cache *all, bool building);
/* Call when an allocation has failed for the job. If other worlds were in memory, tells crash_record_note_memory_short.
 */
void job_cache_note_memory_failure(const struct job_cache *cache);

#endif
