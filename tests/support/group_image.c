/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/group_image.h"

#include "common/base/mem.h"
#include "common/estimate/merge.h"

#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static const float white[3] = {0.95046F, 1, 1.08906F}; /* of D65, so that red, green and blue are 1 to four digits */
static const float blue_primary[3] = {0.18048F, 0.07219F, 0.95053F};

struct plan group_image_plan(enum plan_kind kind, uint32_t width, uint32_t height)
{
	struct plan p = {.integrator = "path",
			 .kind = kind,
			 .width = width,
			 .height = height,
			 .crop_width = width,
			 .crop_height = height,
			 .groups = GROUP_IMAGE_GROUPS,
			 .parts = 1,
			 .epoch = 1,
			 .bootstrap = GROUP_IMAGE_GROUPS,
			 .rounds = UINT64_MAX,
			 .seconds = 1,
			 .max_depth = 8};
	if (kind == PLAN_CHAINS)
		p.chains = GROUP_IMAGE_GROUPS;
	return p;
}

void group_image_make_with_blue(const struct plan *p, group_image_value *value, group_image_value *blue, void *user,
				struct canvas_image *img)
{
	struct canvas *c;
	assert_int_equal(canvas_new(&c, p, -30, NULL, NULL), 0);
	for (uint32_t g = 0; g < p->groups; g++) {
		struct batch b = {.key = {1, LEASE_RENDER, g, 0, 0}, .tile_count = 1};
		b.tiles = mem_alloc(1, sizeof *b.tiles);
		b.tiles[0] = (struct tile){0, 0, p->width, p->height,
					   mem_alloc((size_t)p->width * p->height * 3, sizeof(float))};
		for (uint32_t i = 0; i < p->width * p->height; i++) {
			double v = value(user, g, i), blue_value = blue ? blue(user, g, i) : 0;
			for (int k = 0; k < 3; k++)
				b.tiles[0].xyz[i * 3 + (uint32_t)k] =
					(float)v * white[k] + (float)blue_value * blue_primary[k];
		}
		b.counters[COUNT_SAMPLES] = p->kind == PLAN_CHAINS ? 1 : p->width * p->height;
		b.counters[COUNT_INDEPENDENT] = 1;
		b.independent_sum = 1;
		b.moment_count = batch_moment_count(p, LEASE_RENDER);
		b.moments = b.moment_count ? mem_alloc(b.moment_count, sizeof *b.moments) : NULL;
		if (p->kind == PLAN_CHAINS) {
			b.state_count = 1;
			b.states = mem_alloc(1, sizeof *b.states);
			b.states[0] = (struct chain_state){mem_alloc(8, 1), 8};
		}
		assert_int_equal(canvas_add(c, &b, NULL), 0);
		batch_fini(&b);
	}
	assert_int_equal(canvas_image_init(c, false, img, NULL), 0);
	canvas_free(c);
}

void group_image_make(const struct plan *p, group_image_value *value, void *user, struct canvas_image *img)
{
	group_image_make_with_blue(p, value, NULL, user, img);
}
