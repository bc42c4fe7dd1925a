/* SPDX-License-Identifier: Apache-2.0 */
/* Points within a distance, against a search through all points. */
#include "worker/render/math/point_tree.h"
#include "worker/render/math/rng.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { POINTS_MAX = 3000 };

static unsigned found_counts[POINTS_MAX];

static void count_found(void *user, uint32_t id)
{
	(void)user;
	found_counts[id]++;
}

enum cloud { CLOUD_UNIFORM, CLOUD_ON_A_PLANE, CLOUD_ON_A_GRID, CLOUD_IN_ONE_PLACE, CLOUDS };

static vec3 point_of_cloud(enum cloud cloud, uint64_t i)
{
	double u[4];
	rng_uniform4(1, RNG_TEST, i, cloud, 0, u);
	switch (cloud) {
	case CLOUD_UNIFORM:
		return (vec3){u[0], u[1], u[2]};
	case CLOUD_ON_A_PLANE:
		return (vec3){u[0], 0.5, u[2]};
	case CLOUD_ON_A_GRID:
		return (vec3){floor(4 * u[0]) / 4, floor(4 * u[1]) / 4, floor(4 * u[2]) / 4};
	default:
		return (vec3){0.5, 0.5, 0.5};
	}
}

static void tree_finds_the_points_of_a_full_search(void **state)
{
	(void)state;
	static struct point_tree_node nodes[POINTS_MAX];
	static vec3 points[POINTS_MAX];
	static const double radii[] = {0, 0.01, 0.25, 2};
	for (int cloud = 0; cloud < CLOUDS; cloud++)
		for (size_t n = 0; n <= POINTS_MAX; n = n < 9 ? n + 1 : n * 7) {
			struct point_tree t = {nodes, n};
			for (size_t i = 0; i < n; i++) {
				points[i] = point_of_cloud((enum cloud)cloud, i);
				nodes[i] = (struct point_tree_node){points[i], (uint32_t)i};
			}
			point_tree_build(&t);
			for (unsigned k = 0; k < 40; k++) {
				double r = radii[k % 4];
				vec3 q = k % 8 < 4 ? point_of_cloud(CLOUD_UNIFORM, POINTS_MAX + k)
						   : point_of_cloud((enum cloud)cloud, k);
				memset(found_counts, 0, sizeof found_counts);
				point_tree_visit_within(&t, q, r, count_found, NULL);
				for (size_t i = 0; i < n; i++) {
					vec3 d = vec3_sub(points[i], q);
					assert_int_equal(found_counts[i], vec3_dot(d, d) <= r * r);
				}
			}
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(tree_finds_the_points_of_a_full_search)};
	return cmocka_run_group_tests_name("worker/render/math/point_tree", tests, NULL, NULL);
}
