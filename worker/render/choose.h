/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Which integrator a scene calls for: `path`, `bdpt8`, `erpt4`, `erpt`, or the chains of `hslt`. Decided once,
 * before the plan is made, from a pilot that counts rays instead of seconds and draws random numbers of its own: the
 * same on every machine for the same request, and the plan names what was chosen.
 *
 * The pilot draws samples of `path`, merges light with the camera's sub-paths where a lobe is narrow (rare_light.h),
 * and draws samples of `bdpt` where these leave the choice open. Of each kind it asks what a contribution brings
 * relative to the brightness of its place: how much light comes in rare contributions of many times that brightness,
 * how fast the frequency of the largest falls with their size (their tail index, by Hill's estimator), and what share
 * the largest alone has.
 *
 * `erpt` is the usual answer: samples of bdpt, of which short chains spread what is too bright. `hslt` is called for
 * where such samples are too rare to begin a chain wherever one is wanted: merging or bdpt finds much rare light, and
 * even what the camera's sub-paths find has extremes without a mean; or nothing finds any light. The others do where
 * path's tail is that of a finite variance and its variance times rays is the smaller one. If a tail index of 2 or
 * more says so, and no sample has a share in the light that such a law does not allow, this is `path` where no lobe of
 * the scene is so narrow that it focuses light, else `bdpt8`, whose light sub-paths, one in eight samples, bound
 * fireflies of reflected light. If only an extreme-value index below 1/2 says so, which sees an end of a broad range of
 * contributions, if the pilot is brief, or if surfaces refract, whose caustics a pilot may miss altogether, it is
 * `erpt4`, whose chains bound fireflies, with a light sub-path in one of four samples. `erpt4` also stands in where
 * path misses a little of the light, such as that of a point light by a mirror, and bdpt finds that evenly.
 */
#ifndef WORKER_RENDER_CHOOSE_H
#define WORKER_RENDER_CHOOSE_H

#include "worker/render/rare_light.h"
#include "worker/render/render.h"

/* What a pilot chooses among, besides RENDER_INTEGRATOR_CHAINS: the first name and the others. */
#define RENDER_CHOICES(first, other) first("path") other("bdpt8") other("erpt4") other("erpt")
#define RENDER_CHOICES_FIRST(name) name
#define RENDER_CHOICES_OTHER(name) ", " name
#define RENDER_CHOICES_TEXT RENDER_CHOICES(RENDER_CHOICES_FIRST, RENDER_CHOICES_OTHER)

/* The figures of one integrator. */
struct render_found {
	double cost;	/* variance of a sample's relative contribution, the few largest left out, times rays a
			   sample; infinite: no light but theirs */
	double rare;	/* share of the energy beyond RENDER_RARE times the brightness there */
	double tail;	/* tail index of the largest, one in RENDER_TAIL samples, */
	double extreme; /* and one in RENDER_EXTREME; 1 where fewer carry light */
	double evi;	/* extreme-value index of the largest, one in RENDER_EVI; 1 where fewer carry light */
	double most;	/* share of the energy that one sample alone brought, the largest */
};
enum { RENDER_TAIL = 128, RENDER_EXTREME = 512, RENDER_EVI = 256 };

struct render_choice {
	struct render_found path, bdpt;
	struct rare_light merged; /* to bdpt, by merging; 0 where no lobe is narrow, or media scatter */
	double found;		  /* path's mean over bdpt's: the share of the light that path finds; 0: not known */
	bool misses;	  /* path finds less than there is: light of a point or a direction through a specular lobe, or
			     none at all */
	bool dark;	  /* path finds next to nothing */
	bool media_shine; /* media shine, which the chains of hslt do not find */
	bool focuses;	  /* lobes that are narrow: what they throw a pilot may have missed */
	bool refracts;	  /* and surfaces let light through: a pilot may have missed the lamps behind them */
	bool brief;	  /* too few samples to trust a tail index where lobes are narrow */
	bool settled;	  /* no choice was left before bdpt was looked at: nothing is known of it */
	uint64_t samples; /* of the pilot, all kinds, of bdpt a quarter where that is enough: at most about 1 in 7 of
			     a short render's, or 3 times 4,096; 1 in 30 of a long one's, 1 in 120 of one of hours; not
			     those of `path`, an eighth at most, that single bright ones of bdpt are held against */
};

/* Sets integrator, kind and mixture of the request, all else of which stands. Ticks. -ENOMEM, -EINVAL */
int render_choose(const struct world *w, struct plan_request *r, struct render_choice *out, struct error *e);
/* By what was found. Pure. */
const char *render_choice_of(const struct render_choice *c);
/* Whether the figures of path and of merging are enough for a choice. Pure. */
bool render_choice_is_settled(const struct render_choice *c);
/* One sentence for people, without figures. Pure. */
void render_choice_text(const char *integrator, const struct render_choice *c, char *text, size_t size);

#endif
