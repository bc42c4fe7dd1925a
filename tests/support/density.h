/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Checks the density of every technique for a given path, whichever technique made it; the balance heuristic depends on
 * these. Sub-paths are walked at random and joined in all ways. The densities of all their vertices, in both
 * directions, are computed from positions, normals and the BSDFs' own pdfs alone. Then
 *  - the walk's own pdf and pdf_rev must be equal to these,
 *  - beta times all densities must be the integrand, computed independently,
 *  - path_technique_ratios must give their quotients, for the path relabelled as if each technique had made it.
 * Deterministic; tolerances are relative and allow for the rounding of directions between points. If there is a
 * scattering medium, it is the only medium, and it is everywhere.
 */
#ifndef TESTS_SUPPORT_DENSITY_H
#define TESTS_SUPPORT_DENSITY_H

#include "worker/render/world/world.h"

struct density_tally {
	size_t betas, routes, with_delta, from_infinity, relabelled, with_passed_vertices, skipped, off_ray;
	double worst_error, worst_ratio_error;
};

/* Fails the test if a density differs. Frees the world. */
struct density_tally density_check(const char *name, struct world *w, size_t walks);

#endif
