/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What accuracy costs in time: settings around a default, one of them changed at a time, rendered in turns and
 * compared. The parts: design (which settings), run (rendering), judge (figures), csv and html (reports). One thread
 * besides those of the leases.
 */
#ifndef WORKER_CLI_ACCURACY_H
#define WORKER_CLI_ACCURACY_H

#include "worker/cli/accuracy/accuracy_stats.h"
#include "worker/cli/render/local.h"
#include "worker/cli/image/picture.h"

enum { ACCURACY_SETTINGS = 96, ACCURACY_SWEEPS = 24, ACCURACY_VALUES = 12, ACCURACY_COSTS = 4096, ACCURACY_CELLS = 17 };

/* How much longer the reference is rendered than each other setting. */
#define ACCURACY_REFERENCE_SHARE 4.0

/* Share of the pixels, those with the greatest errors, that errors leave out: a single one can be most of the whole. */
#define ACCURACY_TRIM 0.005

struct accuracy_setting {
	char parameter[32], value[48]; /* "default" and "reference" are settings without value */
	double share;		       /* of the time, in units of the others' */
	bool other_image;	       /* it is known to make another image, however small the difference */
	uint32_t max_depth;
	char accuracy[PLAN_ACCURACY_MAX], mixture[PLAN_MUTATIONS_MAX];
};

struct accuracy_sweep { /* of one parameter; the default's value among the others, in order */
	char parameter[32];
	const char *summary;
	size_t count, setting[ACCURACY_VALUES];
	char value[ACCURACY_VALUES][48];
};

struct accuracy_left_out {
	char parameter[32], why[160];
};

struct accuracy_design {
	size_t count, sweep_count, left_out_count;
	struct accuracy_setting settings[ACCURACY_SETTINGS]; /* the first is the default, the second the reference:
								careful, and longer */
	struct accuracy_sweep sweeps[ACCURACY_SWEEPS];
	struct accuracy_left_out left_out[ACCURACY_SWEEPS];
};
enum { ACCURACY_DEFAULT, ACCURACY_REFERENCE };

/* Around the request's settings, what the scene calls for. only: NAME,NAME: sweeps to make; NULL: all. -EINVAL: there
 * is no such parameter, with a sentence. */
int accuracy_design(struct accuracy_design *d, const struct plan_request *base, const struct render_summary *scene,
		    const char *only, struct error *e);

/* One setting's rendering. */
struct accuracy_job {
	struct plan plan;
	struct world *world; /* that of several, if it can */
	struct local_run run;
	struct local_job *job;
	size_t cost_count;
	double cost[ACCURACY_COSTS]; /* CPU seconds a mutation, of each round */
	double cpu;		     /* of the rounds */
};

struct accuracy_run {
	/* in */
	const struct accuracy_design *design;
	struct plan_request request; /* what all have in common */
	const struct scene *scene;
	const struct asset_source *assets;
	const struct render_options *render;
	unsigned threads;
	double seconds;		 /* wall clock in all */
	double setting_seconds;	 /* CPU seconds of a setting; 0: by the clock */
	uint64_t setting_rounds; /* rounds of a setting, so that all but times repeats; 0: by time */
	const atomic_bool *stop;
	void (*progress)(void *user, double fraction, const char *state);
	void *user;
	/* out */
	struct accuracy_job *jobs; /* [design->count] */
	size_t world_count;
	struct world *worlds[ACCURACY_SETTINGS];
	double wall_seconds;
	bool interrupted;
};

/* 0 also where it was interrupted when each setting had a round: what there is can be judged. */
int accuracy_render(struct accuracy_run *r, struct error *e);
void accuracy_run_fini(struct accuracy_run *r);

/* The figures of one setting. Errors are relative errors of docs/design.md, rules 4; at 95 %. */
struct accuracy_figures {
	uint64_t mutations, rounds;
	double cpu_seconds;
	struct interval cost;		       /* microseconds of CPU a mutation */
	double acceptance, failed_walks, rays; /* failed_walks: of all walks, NAN: none */
	struct interval equal_mutations, equal_time;
	struct interval bias_mean;  /* relative to the reference */
	struct interval bias_block; /* of the worst block, at 95 % for all blocks together */
	unsigned block;		    /* which: across + down * blocks_across */
	double bias_seen, bias_bound;
	size_t beaten_by; /* itself: on the front; the reference takes no part */
};

struct accuracy_judgement {
	unsigned across, down; /* blocks */
	uint64_t at_mutations; /* of equal mutations */
	double at_cpu_seconds; /* of equal time */
	bool file;	       /* the reference is a file's image */
	bool thin; /* too little was rendered to trust the figures: errors of groups that missed the rare light look
		      small */
	struct accuracy_figures figures[ACCURACY_SETTINGS];
	uint32_t width, height;
	float *rgb; /* planes of the picture for the report: R, G, B */
};

/* reference: an image of the settings' size to measure the bias against; NULL: the careful setting. */
int accuracy_judge(const struct accuracy_run *r, const struct picture *reference, struct accuracy_judgement *out,
		   struct error *e);
void accuracy_judgement_fini(struct accuracy_judgement *j);

/* What a report says besides. */
struct accuracy_context {
	const char *scene, *reference; /* names; reference: NULL: none */
	const struct render_summary *summary;
	const struct accuracy_design *design;
	const struct accuracy_run *run;
	const struct accuracy_judgement *judgement;
};

/* "tolerance 0.01", "default". */
void accuracy_name(const struct accuracy_setting *s, char *text, size_t size);

int accuracy_csv(const struct accuracy_context *x, const char *path, struct error *e);
/* One XHTML file. Where gnuplot is missing it says so and goes without plots. */
int accuracy_html(const struct accuracy_context *x, const char *path, struct error *e);

#endif
