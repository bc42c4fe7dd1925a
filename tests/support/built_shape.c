/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/built_shape.h"

#include "tests/support/failing_memory.h"

#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

struct built_shape built_shape_make(const struct memory_file *files, const struct plugin_decl *plugins)
{
	struct asset_source assets = memory_assets(files);
	struct built_shape b = {0};
	b.result = scene_read(&b.scene, &assets, "s.xml", plugins, NULL, 0, &b.error);
	if (!b.result)
		b.result =
			shape_build(b.scene.objects[0], &assets, &b.arena, &b.geometry, &b.dropped_triangles, &b.error);
	return b;
}

void built_shape_fini(struct built_shape *b)
{
	arena_fini(&b->arena);
	scene_fini(&b->scene);
}

void built_shape_check_out_of_memory(const struct scene *scene, const struct memory_file *files, long min_allocations)
{
	struct asset_source assets = memory_assets(files);
	uint64_t dropped;
	struct error e;
	int r = -1;
	long n;
	for (n = 0; r && n < 100; n++) {
		struct arena arena = {0};
		struct shape_geometry g;
		mem_fail_after(n);
		r = shape_build(scene->objects[0], &assets, &arena, &g, &dropped, &e);
		mem_fail_after(-1);
		assert_true(r == 0 || r == -ENOMEM);
		arena_fini(&arena);
	}
	assert_int_equal(r, 0);
	assert_true(n > min_allocations);
}

vec3 built_shape_corner(const struct mesh *m, uint32_t triangle, int k)
{
	return vec3_load(m->position[m->index[triangle][k]]);
}

double built_shape_area(const struct mesh *m)
{
	double sum = 0;
	for (uint32_t t = 0; t < m->triangle_count; t++) {
		vec3 a = built_shape_corner(m, t, 0);
		sum += 0.5 * vec3_length(vec3_cross(vec3_sub(built_shape_corner(m, t, 1), a),
						    vec3_sub(built_shape_corner(m, t, 2), a)));
	}
	return sum;
}

double built_shape_volume(const struct mesh *m)
{
	double sum = 0;
	for (uint32_t t = 0; t < m->triangle_count; t++)
		sum += vec3_dot(built_shape_corner(m, t, 0),
				vec3_cross(built_shape_corner(m, t, 1), built_shape_corner(m, t, 2))) /
		       6;
	return sum;
}
