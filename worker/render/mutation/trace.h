/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The half vector multi-chain perturbation (Hanika, Kaplanyan, Dachsbacher 2015, sec. 4): starting at a nearby film
 * point, a path is traced whose half vectors are those of the old path, rotated into the new tangent frames, plus a
 * small perturbation. Events in media keep their distances and directions, also with a small perturbation.
 */
#ifndef WORKER_RENDER_MUTATION_TRACE_H
#define WORKER_RENDER_MUTATION_TRACE_H

#include "worker/render/mutation/mutation.h"

/* Makes y's vertices k-1 .. b, edges k-1 .. b and film point, and x_k if there is an aperture point to move. The modes
 * of the vertices k-1 .. b+1 are x's; x_b (b > 0) can scatter in many directions, x_0 (b = 0) is an emitter. Sets
 * move->first and move->log_symmetric. */
enum proposal_result trace_multichain(struct mutation_ctx *m, unsigned b, bool aperture, struct full_path *x,
				      struct full_path *y, struct proposal_move *move);

/* Makes a symmetric step of x_k on the aperture. Returns false if it leaves the aperture. */
bool trace_move_aperture(struct mutation_ctx *m, const struct full_path *x, struct full_path *y);

#endif
