/* SPDX-License-Identifier: Apache-2.0 */
/* Strategies that break up the path: the b and c that they allow, and what moves. */
#ifndef WORKER_RENDER_MUTATION_STRATEGY_H
#define WORKER_RENDER_MUTATION_STRATEGY_H

#include "worker/render/mutation/breakup.h"

enum { STRATEGY_DRAWN = -1, STRATEGY_CAMERA = -2 }; /* DRAWN: b or c is chosen by the heuristic; CAMERA: b = k */

struct strategy {
	const struct heuristic *heuristic;
	int b, c; /* a vertex number, or one of the values above */
	bool moves_halfvecs, moves_wavelength, moves_aperture, moves_emitter; /* see struct breakup */
	/* The wavelength also moves where media scatter, although the transmittance of each edge changes with it. */
	bool moves_wavelength_in_media;
};

/* Proposes a breakup by self's strategy; `forced` takes precedence. */
enum proposal_result strategy_propose(const struct mutation_ops *self, struct mutation_ctx *m,
				      const struct mutation_forced_choice *forced, struct full_path *x,
				      struct full_path *y, struct proposal_move *move);

#endif
