/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's plan (docs/design.md, rules 1): fixed when the job starts, the same for hslt-render and the farm, never a
 * function of workers or threads. Pure; any thread.
 *
 * Work is divided into leases. A lease is named by (kind, group, part, epoch); its result depends on these and on the
 * plan alone.
 *
 * Bootstrap, LEASE_BOOTSTRAP: the samples with the indices plan_bootstrap_range(group, part); the epoch is 0.
 * Samples (path, bdpt, erpt), LEASE_RENDER: the sample indices of round `epoch` that are congruent to `group` modulo
 *   `groups`, in the rows plan_row_range(part).
 * Chains (pssmlt, hslt), LEASE_RENDER: epoch `epoch` of the chains plan_chain_range(part) of the group; chain c belongs
 *   to group c modulo `groups`.
 */
#ifndef COMMON_PLAN_PLAN_H
#define COMMON_PLAN_PLAN_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum plan_kind { PLAN_SAMPLES, PLAN_CHAINS };
enum lease_kind { LEASE_BOOTSTRAP = 1, LEASE_RENDER = 2 };

enum {
	PLAN_GROUPS_MAX = 64,
	PLAN_PIXELS_MAX = 1 << 24,	/* pixels of the crop: bounds a batch */
	PLAN_SIDE_MAX = 65536,		/* width and height of the full film */
	PLAN_FILM_PIXELS_MAX = 1 << 28, /* pixels of the full film; a film above PLAN_PIXELS_MAX is rendered in crops */
	PLAN_BORDER_MAX = 256,
	PLAN_PARTS_MAX = 64,
	PLAN_CHAINS_MAX = 1 << 20,
	PLAN_LEASE_CHAINS_MAX = 1 << 14, /* bounds the message header (seeds, sizes of states) and payload (states) */
	PLAN_BOOTSTRAP_MAX = 1 << 26,
	PLAN_DEPTH_MAX = 128,	   /* edges */
	PLAN_MUTATIONS_MAX = 160,  /* bytes of the mixture's text, with the final 0 */
	PLAN_STRATEGIES_MAX = 8,   /* entries of the mixture */
	PLAN_ACCURACY_MAX = 320,   /* bytes of the accuracy settings' text, with the final 0 */
	PLAN_EFFECTS_MAX = 320,	   /* bytes of the effects' text, with the final 0 */
	PLAN_SPEED_MAX = 20000000, /* mutations or samples a second: more than one thread can ever make */
};

/*
 * Light that few samples are unlikely to find at all, such as reflections inside the glass around a lamp for `path`, as
 * estimated by a pilot (worker/render/unseen_light.h). mean_squares[i] is for 4^i samples per pixel (for chains:
 * bootstrap samples and independent proposals): the share of such light in the light of a part of the film, squared and
 * averaged over the film. All 0: there is no such light, or no pilot has run.
 */
enum { PLAN_UNSEEN_COUNT = 12 };
struct plan_unseen {
	double mean_squares[PLAN_UNSEEN_COUNT];
};

/* Mean numbers of rays that a pilot counted (worker/render/count_rays.h), the same on every machine; 0: not counted. */
struct plan_rays {
	double bootstrap; /* per bootstrap sample */
	double step;	  /* per mutation or sample */
};

struct plan_request {
	char integrator[16];
	enum plan_kind kind;
	uint32_t width, height;				  /* full film */
	uint32_t crop_x, crop_y, crop_width, crop_height; /* width 0: the full film */
	uint32_t border; /* pixels by which samples extend beyond the crop: the filter's radius */
	uint64_t seed;
	uint64_t spp;		       /* samples or mutations per pixel at which the job ends; 0: no such bound */
	uint64_t mutations;	       /* the same bound as a total over all pixels; 0: none */
	double seconds;		       /* time at which the job ends; 0: none */
	double target_error;	       /* relative error at which the job ends; 0: none */
	uint32_t min_depth, max_depth; /* edges */
	uint32_t chains, groups;       /* 0: chosen by plan_make */
	uint32_t parts;		       /* leases of a group in a round; 0: chosen by plan_make */
	uint64_t bootstrap;	       /* bootstrap samples; 0: chosen by plan_make */
	uint64_t epoch;		       /* mutations per chain, or samples per pixel and group; 0: chosen by plan_make */
	double speed; /* mutations or samples a second of one thread, measured by a pilot; limits the time of a lease;
			 0: not known */
	struct plan_rays rays; /* counted if a time or an error ends the job: how much work fits into that bound */
	struct plan_unseen unseen;
	double bandwidth; /* bytes of tiles a second that one thread may send, set by the coordinator; 0: unlimited */
	char mixture[PLAN_MUTATIONS_MAX];			     /* becomes `mutations` of struct plan */
	char accuracy[PLAN_ACCURACY_MAX], effects[PLAN_EFFECTS_MAX]; /* as in struct plan */
};

struct plan {
	char integrator[16];
	enum plan_kind kind;
	uint32_t width, height, crop_x, crop_y, crop_width, crop_height, border;
	uint64_t seed;
	uint32_t groups, parts;	      /* leases per round = groups x parts */
	uint32_t chains;	      /* 0 for PLAN_SAMPLES; a multiple of groups x parts */
	uint64_t bootstrap;	      /* a multiple of groups x parts */
	uint64_t epoch;		      /* mutations per chain and epoch, or samples per pixel, group and round */
	uint64_t rounds;	      /* number after which the job ends; UINT64_MAX: only time or error end it */
	double seconds, target_error; /* as in struct plan_request */
	uint32_t min_depth, max_depth;
	/* The mixture of strategies that propose mutations, with their shares, in the renderer's spelling and separated
	 * by commas: "independent=0.1,hslt=0.9". Empty: the integrator has none. Bytes after the text are 0. */
	char mutations[PLAN_MUTATIONS_MAX];
	/* The accuracy settings that differ from their defaults ("tolerance=1e-05"), and the effects whose choice was
	 * overridden ("all", "-dispersion,+aperture"), in the renderer's spelling. Empty: nothing differs. Bytes after
	 * the texts are 0. */
	char accuracy[PLAN_ACCURACY_MAX], effects[PLAN_EFFECTS_MAX];
	struct plan_unseen unseen; /* has no influence on the image, only on the error that is stated */
};

/* Lists of the numeric fields of struct plan and struct plan_request, except `kind`: PLAN_COPIED_NUMBERS are copied
 * from the request, PLAN_CHOSEN_NUMBERS may be chosen by plan_make. Messages have fields of the same names. */
/* clang-format off */
#define PLAN_FILM_NUMBERS(X) X(width) X(height) X(crop_x) X(crop_y) X(crop_width) X(crop_height) X(border)
#define PLAN_COPIED_NUMBERS(X) PLAN_FILM_NUMBERS(X) X(seed) X(min_depth) X(max_depth)
#define PLAN_CHOSEN_NUMBERS(X) X(groups) X(parts) X(chains) X(bootstrap) X(epoch)
#define PLAN_SHARED_NUMBERS(X) PLAN_COPIED_NUMBERS(X) PLAN_CHOSEN_NUMBERS(X)
#define PLAN_NUMBERS(X) PLAN_SHARED_NUMBERS(X) X(rounds) X(seconds) X(target_error)
#define PLAN_REQUEST_NUMBERS(X) PLAN_SHARED_NUMBERS(X) X(spp) X(mutations) X(seconds) X(target_error) X(speed)
/* clang-format on */

/* Returns whether the request says when to stop: by samples, mutations, time or an error. */
bool plan_request_is_bounded(const struct plan_request *r);

/* Checks the request (sizes, crop, counts), chooses the numbers that it leaves open, and stores the plan. Returns 0, or
 * -EINVAL with a sentence. */
int plan_make(const struct plan_request *r, struct plan *p, struct error *e);
/*
 * The length of an epoch, if none is requested, follows from these rules:
 * - A job with a bound on its mutations or samples has 8 rounds; more, if it also has a time and a round would
 *   take more than about an eighth of it.
 * - Without such a bound, a round of chains has 32 mutations per pixel, and a round of samples has an eighth of
 *   the samples that the bound on time or error leaves room for (at 50,000 samples a second, and 1/E^2 samples per
 *   pixel for an error of E), so that the job ends soon after the bound is reached.
 * - A lease has at most a million mutations or, if a pilot has measured the speed, takes at most about 20 s of one
 *   thread (the epoch is rounded to a power of two, so that the noise of the pilot seldom shows).
 * - If a bandwidth is set, an epoch is long enough that sending a lease's tiles does not exceed it, but not longer than
 *   the job.
 */
/* Returns whether a pilot should measure the speed: without it, a lease might take longer than about 20 s. */
bool plan_needs_speed(const struct plan_request *r, const struct plan *p);
/*
 * How much work fits into a time is computed from counted rays, assuming that a thread traces two million a second.
 * Unless their numbers are requested, the bootstrap takes at most a quarter of the time of one thread, and starting the
 * chains, each as much work as a bootstrap sample, at most an eighth. If a mutation or a sample takes more than 8 rays,
 * the rounds of a plan without a bound on mutations or samples are shorter in proportion. Without a time, no lease of
 * the bootstrap takes more than about 20 s.
 */
/* Returns whether a pilot should count rays: the plan depends on them. */
bool plan_needs_ray_count(const struct plan_request *r);
/* Returns how many bootstrap samples one thread is assumed to draw in that time, at least 256; the largest possible
 * number if no rays were counted. */
uint64_t plan_affordable_bootstrap(const struct plan_request *r, double seconds);
/* Checks a plan from the wire: 0, or -EINVAL with a sentence. Every such plan must pass before it is used. */
int plan_check(const struct plan *p, struct error *e);
/* Returns the mean square of struct plan_unseen after that many samples per pixel, interpolated linearly in their
 * logarithm. */
double plan_unseen_mean_square(const struct plan *p, double spp);
/* Describes the rule by which plan_make chose the length of an epoch; empty if the length was requested. */
void plan_describe_epoch(const struct plan_request *r, const struct plan *p, char *text, size_t size);
enum { PLAN_TEXT_MAX = 1536 }; /* bytes that suffice for the text of any plan_describe... function */

/* A half-open range. */
struct plan_range {
	uint64_t begin, end;
};
/* Returns the bootstrap indices of a lease. */
struct plan_range plan_bootstrap_range(const struct plan *p, uint32_t group, uint32_t part);
/* Returns the chains of a part, as numbers k within the group, whose k-th chain is chain group + groups * k. */
struct plan_range plan_chain_range(const struct plan *p, uint32_t part);
/* Returns the rows of a part, of the crop extended by the border, counted from the top of the extended crop. */
struct plan_range plan_row_range(const struct plan *p, uint32_t part);
/* Returns the parts that plan_make chooses for this plan's chains and groups, or its film, if none are requested. */
uint32_t plan_default_parts(const struct plan *p);
uint64_t plan_round_mutations(const struct plan *p); /* samples or mutations in one round, all groups */
uint64_t plan_lease_mutations(const struct plan *p); /* samples or mutations in the longest lease of a round */
uint64_t plan_extended_pixels(const struct plan *p); /* pixels of the crop extended by the border on each side */

/* Returns the number of entries of a mixture's text, 0 if it is empty, or -1 if it is invalid: an empty entry, more
 * than PLAN_STRATEGIES_MAX, a character that no entry has, or no end within PLAN_MUTATIONS_MAX bytes. */
int plan_strategy_count(const char *mixture);
/* Copies the i-th entry without its share ("hslt", "hslt@b2c0"), cut to fit. */
void plan_strategy_name(const char *mixture, uint32_t i, char *name, size_t size);

/* Returns whether a text of a plan ends within `size` bytes, is followed by zeros only, and has no character that is
 * special to a shell. */
bool plan_text_is_valid(const char *text, size_t size);

#endif
