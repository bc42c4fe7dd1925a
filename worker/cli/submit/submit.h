/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What hslt-submit does: collects a scene's files by hash, sends the job and the files that the coordinator lacks,
 * waits for it and fetches its result. One thread.
 */
#ifndef WORKER_CLI_SUBMIT_H
#define WORKER_CLI_SUBMIT_H

#include "common/estimate/forecast.h"
#include "common/blob/blob.h"
#include "common/net/client.h"
#include "common/exr/output_files.h"
#include "worker/cli/base/options.h"

/* A scene and its files, as read here. */
struct scene_files {
	char *folder; /* of the scene file; names of files are relative to it, or to a folder of --path */
	struct asset_folders folders;
	char *scene; /* the scene file's name in it */
	size_t count;
	struct scene_file {
		char *name;
		struct blob_hash hash;
		uint64_t size;
	} * list;
	struct render_summary summary;
	size_t note_count;
	char **notes;
};

/* Reads and checks the scene with everything that it needs; files that building its world did not need are not part
 * among them. No output may replace one of them. The error names file, line and element. */
int scene_files_read(struct scene_files *files, const char *path, struct render_arguments *a,
		     const struct output_files *outputs, struct error *e);
void scene_files_fini(struct scene_files *files);

struct submit_request {
	const char *name, *output; /* output: a file's name for a later fetch, or "" */
	int priority;
	bool mixed;
	double verify; /* share of the epochs computed by two workers */
	const struct render_arguments *args;
};

/* A job of a coordinator. A new spool counts from 1 again, so the number alone could mean another job. */
struct submitted {
	uint64_t job;
	double at; /* s since 1970, by the coordinator */
};

/* -EACCES: refused, with the coordinator's sentence. plan_text: what was chosen, and by which rule. */
int submit_send(struct client *cl, const struct submit_request *r, const struct scene_files *files,
		struct submitted *job, char *plan_text, size_t plan_size, struct error *e);

struct submit_end {
	uint32_t exit_code; /* of a program that waited */
	bool has_result;
	char state[16];		       /* done, failed, cancelled */
	struct forecast_history looks; /* estimates of the error; seconds from the first round on */
	double cpu_seconds, bootstrap_cpu_seconds, bootstrap_seconds;
	char why[256], note[1024]; /* why there is no result; notes on the image */
};

/* Shows progress on stderr until the job has ended. -ESTALE: another job has its number. */
int submit_wait(struct client *cl, const struct submitted *job, struct submit_end *end, struct error *e);

#endif
