/* SPDX-License-Identifier: Apache-2.0 */
/* A picture is decoded once for all textures that use the same pixels, and again for those that use others. */
#include "tests/support/nodes.h"
#include "tests/support/pictures.h"
#include "worker/render/texture/picture_cache.h"
#include "worker/render/texture/raster.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static const struct raster_options reflectance_range = {0, 1, false, IMAGE_ALL},
				   light_range = {0, 1e30, false, IMAGE_ALL},
				   height_range = {-1e30, 1e30, true, IMAGE_ALL};

struct counted {
	struct asset_source inner_source;
	int open_count;
};

static int open_counted(void *user, const char *name, struct asset *out, struct error *e)
{
	struct counted *c = user;
	c->open_count++;
	return c->inner_source.open(c->inner_source.user, name, out, e);
}

static void close_counted(void *user, struct asset *a)
{
	struct counted *c = user;
	c->inner_source.close(c->inner_source.user, a);
}

/* The maximum is the same, whether another texture has computed it before or not. */
static void check_maximum(const struct raster *r)
{
	double m = 0;
	for (uint32_t i = 0; i < r->image.width * r->image.height * r->image.channels; i++)
		m = fmax(m, (double)indexed_image_value(&r->image, i));
	assert_true(raster_max(r) == m && raster_max(r) == m);
}

static struct indexed_image read_image(const struct asset_source *s, const char *text,
				       const struct raster_options *range, struct arena *a)
{
	struct raster r = {.is_nearest = false};
	struct error e;
	char plugin[128];
	snprintf(plugin, sizeof plugin, "bitmap %s", text);
	if (raster_read(&r, node_make(a, PLUGIN_TEXTURE, plugin), s, range, a, &e))
		fail_msg("%s: %s", text, e.text);
	check_maximum(&r);
	return r.image;
}

static void test_equal_images_are_shared(void **state)
{
	(void)state;
	struct pictures p = {.count = 0};
	struct arena a = {0}, other = {0};
	struct picture_cache cache = {.arena = &a};
	/* p0 lies within [0, 1], p1 does not. */
	pictures_add(&p, 2, 1, (const double[]){0.5, 0.25, 0.75, 0.75, 0.5, 0.5});
	pictures_add(&p, 2, 1, (const double[]){0.5, 0.25, 4, 0.75, 0.5, 0.5});
	struct counted c = {.inner_source = pictures_source(&p)};
	const struct asset_source s = {
		.user = &c, .open = open_counted, .close = close_counted, .picture_cache = &cache};
	const uint8_t *first = read_image(&s, "filename=p0", &reflectance_range, &a).index8;
	assert_ptr_equal(read_image(&s, "filename=p0 wrap_mode=clamp", &reflectance_range, &a).index8, first);
	assert_ptr_equal(read_image(&s, "filename=p0", &light_range, &a).index8, first);
	assert_int_equal(c.open_count, 1);
	assert_ptr_not_equal(read_image(&s, "filename=p0 channel=r", &reflectance_range, &a).index8, first);
	assert_ptr_not_equal(read_image(&s, "filename=p0 threshold=0.5", &reflectance_range, &a).index8, first);
	assert_ptr_not_equal(read_image(&s, "filename=p0", &height_range, &a).index8, first); /* not decoded as sRGB */
	assert_ptr_not_equal(read_image(&s, "filename=p0 gamma=1", &reflectance_range, &a).index8,
			     read_image(&s, "filename=p0 gamma=2", &reflectance_range, &a).index8);
	assert_int_equal(c.open_count, 5); /* gamma=1 reads the same numbers as a height */
	const struct indexed_image bright = read_image(&s, "filename=p1", &light_range, &a),
				   cut = read_image(&s, "filename=p1", &reflectance_range, &a);
	assert_true(indexed_image_value(&bright, 2) == 4 && indexed_image_value(&cut, 2) == 1);
	assert_ptr_equal(read_image(&s, "filename=p1", &reflectance_range, &a).index8, cut.index8);
	assert_ptr_equal(read_image(&s, "filename=p1", &light_range, &a).index8, bright.index8);
	assert_int_equal(c.open_count, 7);
	/* Memory with another lifetime is not shared. */
	assert_ptr_not_equal(read_image(&s, "filename=p0", &reflectance_range, &other).index8, first);
	assert_ptr_equal(read_image(&s, "filename=p0", &reflectance_range, &a).index8, first);
	arena_fini(&other);
	arena_fini(&a);
	pictures_fini(&p);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_equal_images_are_shared)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
