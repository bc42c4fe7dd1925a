/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Homogeneous media. Light that travels a distance d through one keeps exp(-sigma_t d) of its radiance: sigma_a of
 * sigma_t = sigma_a + sigma_s is absorbed, sigma_s scattered into other directions by a phase function (phase.h).
 * Lengths are those of the rescaled world. Immutable after creation; any thread.
 */
#ifndef WORKER_RENDER_MEDIUM_MEDIUM_H
#define WORKER_RENDER_MEDIUM_MEDIUM_H

#include "worker/render/medium/phase.h"
#include "worker/render/texture/color.h"

struct medium {
	struct color first, second; /* sigma_a and sigma_s, or if by_albedo sigma_t and its scattered share */
	bool by_albedo;
	bool absorbs, scatters; /* false: that coefficient counts as 0 */
	double per_length;	/* times the coefficients: 1 / length */
	struct phase phase;
};

extern const struct plugin_decl medium_decls[]; /* ends with a NULL type */

struct medium_build {
	double unit;	     /* the scene's unit of length, in that of the distances */
	bool dialect_3;	     /* otherwise 0.6's defaults */
	struct arena *arena; /* for tables of the coefficients */
};

int medium_create(struct medium *m, const struct scene_node *n, const struct medium_build *build, struct error *e);

bool medium_is_coloured(const struct medium *m); /* its coefficients vary with wavelength */

/* 1 / length; the second is sigma_t. */
spectrum medium_scattering(const struct medium *m, const struct wavelengths *w);
spectrum medium_extinction(const struct medium *m, const struct wavelengths *w);

/* The share that is left. distance may be INFINITY. */
spectrum medium_transmittance(const struct medium *m, double distance, const struct wavelengths *w);

#endif
