/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/leases.h"

#include "worker/render/world/world.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct batch leases_run(const struct world *w, const struct plan *p, struct lease_key k, const struct lease_input *in)
{
	struct batch b;
	struct error e = {""};
	enum lease_outcome end;
	if (render_lease(w, p, &k, in, NULL, &end, &b, &e) || batch_check(&b, p, &e))
		fail_msg("%s: %s", p->integrator, e.text);
	assert_int_equal(end, LEASE_DONE);
	return b;
}

float *leases_render_image(struct world *w, uint32_t side, uint64_t spp, uint32_t max_depth)
{
	struct plan p = {.kind = PLAN_SAMPLES,
			 .integrator = "path",
			 .width = side,
			 .height = side,
			 .crop_width = side,
			 .crop_height = side,
			 .groups = 1,
			 .parts = 1,
			 .bootstrap = 1,
			 .epoch = spp,
			 .rounds = 1,
			 .min_depth = 1,
			 .max_depth = max_depth};
	size_t bytes = (size_t)side * side * 3 * sizeof(float);
	accuracy_settings_print(&w->accuracy, p.accuracy);
	struct batch b = leases_run(w, &p, (struct lease_key){1, LEASE_RENDER, 0, 0, 0}, NULL);
	float *image = calloc(1, bytes);
	assert_non_null(image);
	assert_true(b.tile_count <= 1); /* a black image has no tile */
	if (b.tile_count) {
		assert_int_equal(b.tiles[0].width * b.tiles[0].height, side * side);
		memcpy(image, b.tiles[0].xyz, bytes);
	}
	batch_fini(&b);
	world_free(w);
	return image;
}

double leases_mean_luminance(struct world *w, uint32_t side, uint64_t spp, uint32_t max_depth)
{
	float *xyz = leases_render_image(w, side, spp, max_depth);
	double sum = 0, count = (double)(side * side * spp);
	for (uint32_t i = 0; i < side * side; i++)
		sum += (double)xyz[3 * i + 1] / count;
	free(xyz);
	return sum;
}
