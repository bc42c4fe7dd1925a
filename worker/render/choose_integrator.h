/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Chooses the integrator for a scene: `path`, `bdpt8`, `erpt4`, `erpt`, or the chains of `hslt`. The decision is made
 * once, before the plan, from a pilot that counts rays instead of seconds and draws its own random numbers. So it is
 * the same on every machine for the same request, and the plan names the choice.
 *
 * The pilot draws samples of `path`, merges light with the camera's sub-paths if a lobe is narrow (rare_light.h), and
 * draws samples of `bdpt` if these leave the choice open. For each kind it measures contributions relative to the
 * brightness of their place: how much light comes in rare contributions of many times that brightness, how fast the
 * frequency of the largest contributions falls with their size (their tail index, by Hill's estimator), and what share
 * the largest contribution alone has.
 *
 * `erpt` is the usual choice: samples of bdpt, whose overly bright contributions are spread by short chains. `hslt` is
 * chosen where such samples are too rare to start a chain wherever one is needed: merging or bdpt finds much rare
 * light, and even the contributions of the camera's sub-paths have extremes without a mean; or nothing finds any light.
 * The other integrators are chosen where path's tail indicates a finite variance and its variance times rays is the
 * smaller one. If a tail index of 2 or more indicates this, and no sample has a share of the light that contradicts it,
 * the choice is `path` if no lobe of the scene is narrow enough to focus light, else `bdpt8`, whose light sub-paths, in
 * one of eight samples, bound fireflies of reflected light. The choice is `erpt4`, whose chains bound fireflies, with a
 * light sub-path in one of four samples, in these cases: only an extreme-value index below 1/2 indicates a finite
 * variance, which detects the upper end of a broad range of contributions; or the pilot is brief; or surfaces refract,
 * whose caustics a pilot may miss altogether. `erpt4` is also chosen where path misses a little of the light, such as
 * that of a point light by a mirror, and bdpt finds that evenly.
 */
#ifndef WORKER_RENDER_CHOOSE_INTEGRATOR_H
#define WORKER_RENDER_CHOOSE_INTEGRATOR_H

#include "worker/render/rare_light.h"
#include "worker/render/render.h"

/* The integrators that a pilot chooses among, besides RENDER_INTEGRATOR_CHAINS: the first name and the others. */
#define RENDER_CHOICES(first, other) first("path") other("bdpt8") other("erpt4") other("erpt")
#define RENDER_CHOICES_FIRST(name) name
#define RENDER_CHOICES_OTHER(name) ", " name
#define RENDER_CHOICES_TEXT RENDER_CHOICES(RENDER_CHOICES_FIRST, RENDER_CHOICES_OTHER)

/* The measurements for one integrator. */
struct render_measurement {
	/* Variance of a sample's relative contribution, without the few largest contributions, times rays per sample;
	 * infinite if there is no other light. */
	double cost;
	double rare_share; /* share of the energy that exceeds RENDER_RARE_FACTOR times the brightness of its place */
	double tail_index; /* tail index of the largest contributions, one in RENDER_TAIL_INTERVAL samples */
	double extreme_tail_index;  /* tail index of one in RENDER_EXTREME_INTERVAL; 1 where fewer carry light */
	double extreme_value_index; /* extreme-value index of one in RENDER_EXTREME_VALUE_INTERVAL; 1 where fewer carry
				       light */
	double largest_share;	    /* share of the energy in the largest contribution of a single sample */
};
enum { RENDER_TAIL_INTERVAL = 128, RENDER_EXTREME_INTERVAL = 512, RENDER_EXTREME_VALUE_INTERVAL = 256 };

struct render_choice {
	struct render_measurement path, bdpt;
	struct rare_light merging; /* rare light for bdpt, by merging; 0 if no lobe is narrow or media scatter */
	double found_fraction; /* path's mean divided by bdpt's: the fraction of the light that path finds; 0: unknown
				*/
	/* Path cannot find all light: that of a point or a direction through a specular lobe, or any light at all. */
	bool path_misses_light;
	bool path_is_dark;	 /* path finds almost nothing */
	bool has_emitting_media; /* media emit light, which the chains of hslt cannot find */
	bool has_narrow_lobes;	 /* there are narrow lobes, whose caustics a pilot may have missed */
	/* Surfaces let light through as well: a pilot may have missed the lamps behind them. */
	bool has_transmission;
	bool is_brief;	 /* too few samples to trust a tail index where lobes are narrow */
	bool is_settled; /* the choice was clear without bdpt, about which nothing is known */
	/* Samples of the pilot, of all kinds; of bdpt only a quarter if that is enough. At most about 1 in 7 of a short
	 * render's samples, or 3 times 4,096; 1 in 30 of a long render's, 1 in 120 of one that takes hours. Samples of
	 * `path` with which single bright samples of bdpt are compared, at most an eighth, are not included. */
	uint64_t sample_count;
};

/* Sets integrator, kind and mixture of the request; everything else is kept. Ticks. Returns -ENOMEM or -EINVAL. */
int render_choose(const struct world *w, struct plan_request *r, struct render_choice *out, struct error *e);
/* Returns the name of the integrator to use according to the measurements. Pure. */
const char *render_choice_integrator(const struct render_choice *c);
/* Whether the measurements of path and of merging suffice for a choice. Pure. */
bool render_choice_is_settled(const struct render_choice *c);
/* Writes one sentence for people, without figures. Pure. */
void render_choice_text(const char *integrator, const struct render_choice *c, char *text, size_t size);

#endif
