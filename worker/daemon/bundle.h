/*
 * A job at a worker: what it is (JobInfo), its files in the cache, its world. The world is built on a thread of the crew
 * and shared by all leases; everything else is the loop's thread.
 */
#ifndef WORKER_DAEMON_BUNDLE_H
#define WORKER_DAEMON_BUNDLE_H

#include "common/wire/plan_wire.h"
#include "worker/daemon/cache.h"
#include "worker/daemon/crew.h"
#include "worker/render/render.h"

enum bundle_state {
	BUNDLE_ASKED,    /* JobGet was sent */
	BUNDLE_FETCHING, /* files are missing */
	BUNDLE_BUILDING, /* its world is being built */
	BUNDLE_READY,
	BUNDLE_FAILED, /* error says why */
};

struct bundle {
	struct task task; /* building */
	struct bundle *next;
	uint64_t job;
	enum bundle_state state;
	struct envelope info; /* JobInfo, owned */
	struct plan plan;
	struct blob_store *blobs;
	bool *held;   /* by file: in the cache, held */
	char **paths; /* by file, for the builder's thread */
	struct blob_hash wanted; /* while FETCHING: the blob that it waits for */
	struct world *world;
	struct lease_key waits; /* one of the leases that wait for the world; job 0: none */
	unsigned users;     /* leases that need it */
	uint64_t last_used; /* counter */
	bool ended;         /* the coordinator needs it no more */
	double build_seconds;
	void *owner;
	void (*built)(struct bundle *); /* on the loop's thread: READY or FAILED */
	struct error error;
	bool own; /* FAILED: this machine is at fault, not the job */
};

int bundle_new(struct bundle **b, uint64_t job, struct blob_store *blobs, struct error *e);
/* Not while BUILDING. */
void bundle_free(struct bundle *b);

/* Takes the answer to JobGet; then bundle_next_missing. -EBADMSG. */
int bundle_set_info(struct bundle *b, struct envelope *info, struct error *e);
/* Whether it is the same job: number and all, but for the bounds, which may have been moved. Where it cannot be known: not. */
bool bundle_is_of(const struct bundle *b, const Farm__JobInfo *info);
/* Holds what is there; the next hash to fetch into b->wanted. false: all files are there. */
bool bundle_next_missing(struct bundle *b);
/* All files are there: builds the world on the crew. */
int bundle_build(struct bundle *b, struct crew *c, struct error *e);

#endif
