/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The steps of hslt-submit: collects a scene's files and their hashes, sends the job and the files that the coordinator
 * lacks, and waits for its end. One thread.
 */
#ifndef WORKER_CLI_SUBMIT_SUBMIT_H
#define WORKER_CLI_SUBMIT_SUBMIT_H

#include "common/estimate/forecast.h"
#include "common/blob/blob.h"
#include "common/net/client.h"
#include "common/exr/output_files.h"
#include "worker/cli/base/options.h"

/* A scene and its files, as read on this machine. */
struct scene_files {
	char *folder; /* of the scene file; names of files are relative to this folder, or to one of --path */
	struct asset_folders folders;
	char *scene; /* name of the scene file in its folder */
	size_t file_count;
	struct scene_file {
		char *name;
		struct blob_hash hash;
		uint64_t size;
	} * files;
	struct render_summary summary;
	size_t note_count;
	char **notes;
};

/* Reads and checks the scene, and lists the files that building its world needs. -EINVAL if an output would replace one
 * of them. Errors name file, line and element. */
int scene_files_read(struct scene_files *files, const char *path, struct render_arguments *a,
		     const struct output_files *outputs, struct error *e);
void scene_files_fini(struct scene_files *files);

struct submit_request {
	const char *name, *output; /* output: name of the image file for a later fetch, or "" */
	int priority;
	bool is_mixed;		/* workers of any numeric fingerprint may take part */
	double verify_fraction; /* share of the epochs that two workers compute */
	const struct render_arguments *args;
};

/* Identifies a job of a coordinator. A new spool counts from 1 again, so the number alone could mean another job. */
struct submitted_job {
	uint64_t job;
	double submitted_at; /* s since 1970 by the coordinator's clock */
};

/* Sends a job and the files that the coordinator lacks. plan_text: the plan, and by which rules it was made. Returns
 * -EACCES, with the coordinator's sentence, if the job is refused. */
int submit_send(struct client *cl, const struct submit_request *r, const struct scene_files *source_files,
		struct submitted_job *job, char *plan_text, size_t plan_size, struct error *e);

struct submit_outcome {
	uint32_t exit_code; /* for a program that waits for the job */
	bool has_result;
	char state[16];		       /* "done", "failed" or "cancelled" */
	struct forecast_history looks; /* estimates of the error; their times count from the first round on */
	double cpu_seconds, bootstrap_cpu_seconds, bootstrap_seconds;
	char reason[256], note[1024]; /* why there is no result; notes on the image */
};

/* Shows progress on stderr until the job has ended. Returns -ESTALE if another job has the number now. */
int submit_wait(struct client *cl, const struct submitted_job *job, struct submit_outcome *outcome, struct error *e);

#endif
