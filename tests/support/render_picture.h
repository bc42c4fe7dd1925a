/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Renders a whole picture of a world with plain leases on two threads, without a farm or a program, for comparison with
 * references. Every run gives the same bits. Any error, including contributions that were refused, fails the test.
 */
#ifndef TESTS_SUPPORT_RENDER_PICTURE_H
#define TESTS_SUPPORT_RENDER_PICTURE_H

#include "worker/cli/image/picture.h"
#include "worker/render/render.h"

#include <stdint.h>

struct render_picture_options {
	const char *integrator; /* must be one that samples pixels */
	const char *test;	/* its name gives the seed */
	uint64_t spp;
	uint32_t max_depth; /* 0: the scene's */
};

/* Renders at the world's film size. R, G, B of the picture are CIE X, Y, Z. picture_fini frees it. */
void render_picture_xyz(const struct world *w, const struct render_picture_options *options, struct picture *out);

#endif
