/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A whole picture of a world by plain leases, on two threads, with neither farm nor program: for comparing with
 * references. The same bits at each run. Anything wrong fails the test, contributions that were refused too.
 */
#ifndef TESTS_SUPPORT_RENDER_PICTURE_H
#define TESTS_SUPPORT_RENDER_PICTURE_H

#include "worker/cli/image/picture.h"
#include "worker/render/render.h"

#include <stdint.h>

struct render_picture_how {
	const char *integrator; /* one that samples pixels */
	const char *test;	/* the seed is this name's */
	uint64_t spp;
	uint32_t max_depth; /* 0: the scene's */
};

/* At the world's film size. R, G, B of the picture are CIE X, Y, Z. picture_fini frees it. */
void render_picture_xyz(const struct world *w, const struct render_picture_how *how, struct picture *out);

#endif
