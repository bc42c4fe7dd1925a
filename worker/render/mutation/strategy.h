/* SPDX-License-Identifier: Apache-2.0 */
/* Strategies that are breakups: the b and c that they allow, and what moves. */
#ifndef WORKER_RENDER_MUTATION_STRATEGY_H
#define WORKER_RENDER_MUTATION_STRATEGY_H

#include "worker/render/mutation/breakup.h"

enum { STRATEGY_DRAWN = -1, STRATEGY_CAMERA = -2 }; /* b or c by the heuristic; b = k */

struct strategy {
	const struct heuristic *heuristic;
	int b, c;				      /* a number, or one of the above */
	bool halfvecs, wavelength, aperture, emitter; /* see struct breakup */
	bool wavelength_in_media; /* even where media then transmit another share of light along each edge */
};

/* A breakup by self's strategy; `how` takes precedence. */
enum proposal_end strategy_propose(const struct mutation_ops *self, struct mutation_ctx *m,
				   const struct mutation_setting *how, struct full_path *x, struct full_path *y,
				   struct move *move);

#endif
