/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The density of every technique for a given path, whichever technique made it (the balance heuristic stands and falls
 * with that). Sub-paths are walked at random and joined in all ways; the densities of all their vertices, in both
 * directions, are worked out from positions, normals and the BSDFs' own pdfs alone. Then
 *   - the walk's own pdf and pdf_rev must be these,
 *   - beta times all densities must be the integrand, written down once more,
 *   - path_technique_ratios must give their quotients, for the path relabelled as if each technique had made it.
 * Deterministic; tolerances are relative, for what rounding does to directions between points. If something scatters,
 * it is the only medium, and it is everywhere.
 */
#ifndef TESTS_SUPPORT_DENSITY_H
#define TESTS_SUPPORT_DENSITY_H

#include "worker/render/world/world.h"

struct density_tally {
	size_t betas, routes, with_delta, infinite, relabelled, passed, skipped, off;
	double worst, worst_ratio;
};

/* Fails the test if one differs. Frees the world. */
struct density_tally density_check(const char *name, struct world *w, size_t walks);

#endif
