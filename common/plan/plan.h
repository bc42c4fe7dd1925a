/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A job's plan (docs/design.md, rules 1): fixed when the job starts, the same for hslt-render and the farm, never a
 * function of workers or threads. Pure; any thread.
 *
 * Work is cut into leases. A lease is (kind, group, part, epoch); its result depends on the plan and on these alone.
 *   bootstrap, kind BOOTSTRAP: group g, part p owns the index range plan_bootstrap_range(); epoch is 0.
 *   samples (path, bdpt), kind RENDER: group g draws the sample indices of round r that are congruent to g modulo
 *     `groups`; part p owns a strip of rows.
 *   chains (pssmlt), kind RENDER: chain c belongs to group c mod groups; part p owns plan_chain_range() of them; epoch
 * r.
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
	PLAN_MAX_GROUPS = 64,
	PLAN_MAX_PIXELS = 1 << 24, /* of the crop: bounds a batch */
	PLAN_MAX_SIZE = 65536,	   /* width and height of the full film */
	PLAN_MAX_FILM = 1 << 28,   /* its pixels; what is larger than PLAN_MAX_PIXELS is rendered in crops */
	PLAN_MAX_BORDER = 256,
	PLAN_MAX_PARTS = 64,
	PLAN_MAX_CHAINS = 1 << 20,
	PLAN_MAX_LEASE_CHAINS =
		1 << 14, /* bounded so that seeds and state sizes fit into a header, and the states into a payload */
	PLAN_MAX_BOOTSTRAP = 1 << 26,
	PLAN_MAX_DEPTH = 128,	  /* edges */
	PLAN_MUTATIONS_MAX = 160, /* bytes of the mixture's text, with the final 0 */
	PLAN_MAX_STRATEGIES = 8,  /* entries of the mixture */
	PLAN_ACCURACY_MAX = 320,  /* bytes of the text, with the final 0 */
	PLAN_EFFECTS_MAX = 320,
	PLAN_SPEED_MOST = 20000000, /* mutations or samples a second of one thread: nothing is faster */
};

/*
 * Light that few samples hardly ever find, such as reflections inside the glass around a lamp for `path`, as a pilot
 * estimates it (worker/render/unseen_light.h): at[i] is the mean over the film of the square of its share in a place's
 * light, for 4^i samples per pixel; of chains, samples of the bootstrap and independent proposals. All 0: there is
 * none, or no pilot has asked.
 */
enum { PLAN_UNSEEN = 12 };
struct plan_unseen {
	double at[PLAN_UNSEEN];
};

/* Rays that a pilot counted (worker/render/rays.h), the same on every machine; 0: not counted. */
struct plan_rays {
	double bootstrap, step; /* per bootstrap sample; per mutation or sample */
};

struct plan_request {
	char integrator[16];
	enum plan_kind kind;
	uint32_t width, height;				  /* full film */
	uint32_t crop_x, crop_y, crop_width, crop_height; /* width 0: the full film */
	uint32_t border; /* pixels by which samples extend beyond the crop: the filter's radius */
	uint64_t seed;
	uint64_t spp;		       /* 0: none */
	uint64_t mutations;	       /* 0: none; as spp x pixels */
	double seconds;		       /* 0: none */
	double target_error;	       /* 0: none */
	uint32_t min_depth, max_depth; /* edges */
	uint32_t chains, groups;       /* 0: chosen by plan_make */
	uint32_t parts;		       /* leases of a group in a round; 0: chosen by plan_make */
	uint64_t bootstrap,
		epoch; /* 0: chosen by plan_make; epoch: mutations per chain, or samples per pixel and group */
	double speed; /* mutations or samples a second of one thread, measured by a pilot: bounds a lease's time; 0: not
			 known */
	struct plan_rays rays; /* set if a time or an error ends the job: decides how much fits into it */
	struct plan_unseen unseen;
	double bandwidth; /* bytes of tiles a second that one thread may send, set by the coordinator; 0: unlimited */
	char mixture[PLAN_MUTATIONS_MAX]; /* see mutations below; the count of them has the word here */
	char accuracy[PLAN_ACCURACY_MAX], effects[PLAN_EFFECTS_MAX];
};

struct plan {
	char integrator[16];
	enum plan_kind kind;
	uint32_t width, height, crop_x, crop_y, crop_width, crop_height, border;
	uint64_t seed;
	uint32_t groups, parts; /* leases per round = groups x parts */
	uint32_t chains;	/* 0 for PLAN_SAMPLES; a multiple of groups x parts */
	uint64_t bootstrap;	/* a multiple of groups x parts */
	uint64_t epoch;		/* mutations per chain and epoch, or samples per pixel, group and round */
	uint64_t rounds;	/* after which the job ends; UINT64_MAX: only time or error end it */
	double seconds, target_error;
	uint32_t min_depth, max_depth;
	/* The mixture of strategies that proposals are drawn from, as the renderer spells it, entries separated by
	 * commas: "independent=0.1,hslt=0.9". Empty: the integrator has none. Bytes after the text are 0. */
	char mutations[PLAN_MUTATIONS_MAX];
	/* As the renderer spells them; bytes after the text are 0. Settings that differ from the default:
	 * "tolerance=1e-05". Effects whose choice was overridden: "all", "-dispersion,+aperture". Empty: nothing
	 * differs. */
	char accuracy[PLAN_ACCURACY_MAX], effects[PLAN_EFFECTS_MAX];
	struct plan_unseen unseen; /* changes no bit of the image, only the error that is stated */
};

/* Their numbers, but for the kind: those that a plan has from its request, and those that plan_make may choose.
 * Messages have members of the same names. */
/* clang-format off */
#define PLAN_FILM(X) X(width) X(height) X(crop_x) X(crop_y) X(crop_width) X(crop_height) X(border)
#define PLAN_GIVEN(X) PLAN_FILM(X) X(seed) X(min_depth) X(max_depth)
#define PLAN_CHOSEN(X) X(groups) X(parts) X(chains) X(bootstrap) X(epoch)
#define PLAN_BITS(X) PLAN_GIVEN(X) PLAN_CHOSEN(X)
#define PLAN_NUMBERS(X) PLAN_BITS(X) X(rounds) X(seconds) X(target_error)
#define PLAN_REQUEST_NUMBERS(X) PLAN_BITS(X) X(spp) X(mutations) X(seconds) X(target_error) X(speed)
/* clang-format on */

/* Whether it says when to stop: by samples, mutations, time or an error. */
bool plan_request_is_bounded(const struct plan_request *r);

/* Checks the request (sizes, crop, counts) and chooses what it leaves open. -EINVAL with a sentence. */
int plan_make(const struct plan_request *r, struct plan *p, struct error *e);
/*
 * The length of an epoch if none is requested. A job with a bound on its mutations has 8 rounds, or more if fewer
 * mutations than these fit into an eighth of its time. Without such a bound, a round of chains has 32 mutations per
 * pixel, and a round of samples is an eighth of what a bound on time or error leaves room for (at 50,000 samples a
 * second, and 1/E^2 samples per pixel for an error of E), so that the bound is noticed soon after it is reached. A
 * lease has at most a million mutations or, if the pilot's speed is known, takes at most about 20 s of one thread
 * (rounded to a power of two, so that the pilot's noise seldom shows). If a bandwidth is set, an epoch is long enough
 * that a lease's tiles do not exceed it, but not longer than the job.
 */
/* Whether a pilot would help: without one a lease might take longer than that. */
bool plan_wants_speed(const struct plan_request *r, const struct plan *p);
/*
 * How much fits into a time, by counted rays, of which a thread traces two million a second. Unless they are requested,
 * the bootstrap takes at most a quarter of the time of one thread, and the starts of chains, each as much work as a
 * bootstrap sample, an eighth. If a mutation or a sample takes more than 8 rays, the rounds of a plan without a bound
 * on these are shorter in proportion. Without a time, no lease of the bootstrap takes more than about 20 s.
 */
bool plan_wants_rays(const struct plan_request *r);
/* Bootstrap samples that one thread draws in that many seconds, at least 256; the maximum if no rays were counted. */
uint64_t plan_bootstrap_room(const struct plan_request *r, double seconds);
/* Every plan from the wire must pass this check. */
int plan_check(const struct plan *p, struct error *e);
/* The share's mean square after that many samples per pixel, linear in their logarithm between two entries. */
double plan_unseen_after(const struct plan *p, double spp);
/* The rule by which plan_make chose the length of an epoch; empty: it was requested. */
void plan_describe_epoch(const struct plan_request *r, const struct plan *p, char *text, size_t size);
enum { PLAN_TEXT = 1536 }; /* enough for any of these texts */

/* Half-open ranges. */
struct plan_range {
	uint64_t begin, end;
};
struct plan_range plan_bootstrap_range(const struct plan *p, uint32_t group, uint32_t part);
/* The k-th chain of part `part`: group + groups * k for k in the range. */
struct plan_range plan_chain_range(const struct plan *p, uint32_t part);
/* A part's strip: rows of the crop extended by the border, counted from the top of the extended crop. */
struct plan_range plan_row_range(const struct plan *p, uint32_t part);
uint32_t plan_parts_usual(const struct plan *p);     /* by the rule, for its chains and groups or its film */
uint64_t plan_round_mutations(const struct plan *p); /* samples or mutations in one round, all groups */
uint64_t plan_lease_mutations(const struct plan *p); /* samples or mutations in the longest lease of a round */
uint64_t plan_extended_pixels(const struct plan *p); /* (crop + 2 border) in each direction */

/* Number of entries of a mixture's text; 0: it is empty, -1: it is invalid (an empty entry, too many, a character
 * that no entry has, or no end within PLAN_MUTATIONS_MAX bytes). */
int plan_strategy_count(const char *mixture);
/* The i-th entry without its weight ("hslt", "hslt@b2c0"), cut to the size. */
void plan_strategy_name(const char *mixture, uint32_t i, char *name, size_t size);

/* Checks a text of a plan: it ends within `size` bytes, nothing follows its end, and it has no character that is
 * special to a shell. */
bool plan_text_ok(const char *text, size_t size);

#endif
