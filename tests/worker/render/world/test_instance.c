/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Instances that share a mesh, against the same meshes written out: the surface at each point, coinciding primitives,
 * shapes that cannot share, and the image (tests/support/agreement.h).
 */
#include "tests/support/agreement.h"
#include "tests/support/dice.h"
#include "tests/support/memory_assets.h"
#include "tests/support/worlds.h"
#include "worker/render/geom/coincide.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define VIEW SENSOR("0,2.5,5", "0,0.6,0")
#define SKY "<emitter type='constant'/>"
#define TO(inner) "<transform name='to_world'>" inner "</transform>"
#define FILE_OF(inner) "<shape type='obj'><string name='filename' value='m.obj'/>" inner "</shape>"
/* clang-format off */
#define FLOOR \
	"<shape type='rectangle'>" \
		TO("<scale value='5'/><rotate x='1' angle='-90'/>") \
		"<bsdf type='diffuse' id='f'/>" \
	"</shape>"
#define LAMP \
	"<shape type='rectangle'>" \
		TO("<scale value='2'/><rotate x='1' angle='90'/><translate y='4'/>") \
		"<emitter type='area'><float name='radiance' value='3'/></emitter>" \
	"</shape>"
/* clang-format on */

/* Transforms of instances: a plain one, a stretched and turned one, a mirrored one, and one that combines all. */
static const char *const instance_transforms[] = {
	"<translate x='-1.6' y='0.47'/>",
	"<scale x='0.7' y='1.5' z='1'/><rotate z='1' angle='20'/><translate y='0.9' z='-0.4'/>",
	"<scale x='-0.8' y='0.8' z='0.8'/><translate x='1.6' y='0.376' z='0.3'/>",
	"<scale x='0.5' y='0.5' z='-0.3'/><rotate x='1' y='1' angle='75'/><translate x='0.6' y='0.4' z='1.3'/>",
};
enum { INSTANCE_COUNT = 4 };

/* Writes a pot with a flat foot at y = -0.47, which is no float in its frame: n vertices around, `rows` rows upwards,
 * smooth normals and texture coordinates. */
static size_t print_pot(char *out, size_t size, int sides, int rows)
{
	size_t at = 0;
	for (int j = 0; j <= rows; j++)
		for (int i = 0; i <= sides; i++) {
			double a = 2 * M_PI * i / sides, h = (double)j / rows, r = 0.5 * (0.6 + 0.4 * sin(3 * h + 0.4)),
			       slope = 0.6 * cos(3 * h + 0.4);
			at += (size_t)snprintf(
				out + at, size - at, "v %.9g %.9g %.9g\nvn %.9g %.9g %.9g\nvt %.9g %.9g\n", r * cos(a),
				0.97 * h - 0.47, -r * sin(a), cos(a), -slope, -sin(a), (double)i / sides, h);
		}
	for (int j = 0; j < rows; j++)
		for (int i = 1; i <= sides; i++) {
			int a = j * (sides + 1) + i, b = a + 1, c = a + sides + 1, d = c + 1;
			at += (size_t)snprintf(out + at, size - at,
					       "f %d/%d/%d %d/%d/%d %d/%d/%d\nf %d/%d/%d %d/%d/%d %d/%d/%d\n", a, a, a,
					       b, b, b, d, d, d, a, a, a, d, d, d, c, c, c);
		}
	int foot = (rows + 1) * (sides + 1) + 1;
	at += (size_t)snprintf(out + at, size - at, "v 0 -0.47 0\nv 0 0.5 0\nvn 0 -1 0\nvn 0 1 0\nvt 0.5 0.5\n");
	for (int i = 1; i <= sides; i++) {
		int t = rows * (sides + 1) + i;
		at += (size_t)snprintf(out + at, size - at,
				       "f %d/%d/%d %d/%d/%d %d/%d/%d\nf %d/%d/%d %d/%d/%d %d/%d/%d\n", foot, foot, foot,
				       i + 1, i + 1, foot, i, i, foot, foot + 1, foot, foot + 1, t, t, foot + 1, t + 1,
				       t + 1, foot + 1);
	}
	assert_true(at + 1 < size);
	return at;
}

/* `preamble` precedes the instances, and `inside` is the content of each. shared: all instances refer to one group;
 * otherwise each has its own group, which is used once and therefore built as if it were written out. */
static struct world *world_of_pots(bool shared, const char *preamble, const char *inside, int sides, int rows)
{
	static char obj[1 << 19], xml[1 << 14];
	size_t size = print_pot(obj, sizeof obj, sides, rows), at = 0;
	at += (size_t)snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s", preamble);
	for (int k = 0; k < INSTANCE_COUNT; k++) {
		if (k == 0 || !shared)
			at += (size_t)snprintf(xml + at, sizeof xml - at,
					       "<shape type='shapegroup' id='g%d'>%s</shape>", k, inside);
		at += (size_t)snprintf(xml + at, sizeof xml - at,
				       "<shape type='instance'><ref id='g%d'/>" TO("%s") "</shape>", shared ? 0 : k,
				       instance_transforms[k]);
	}
	at += (size_t)snprintf(xml + at, sizeof xml - at, "</scene>");
	assert_true(at + 1 < sizeof xml);
	const struct memory_file files[] = {{"s.xml", xml, at}, {"m.obj", obj, size}, {NULL, NULL, 0}};
	return world_from_files(32, 32, files);
}

#define GLASS "<bsdf type='dielectric'/>"
#define BUMPS                                                                                              \
	"<bsdf type='bumpmap'><float name='scale' value='0.02'/><texture type='checkerboard' name='any'/>" \
	"<bsdf type='diffuse'/></bsdf>"

/* Positions differ because vertices are rounded in the mesh's frame instead of the world's: by 2^-24 of either size. */
static double distance(vec3 a, vec3 b)
{
	return vec3_length(vec3_sub(a, b));
}

/* turn: allowed rotation of the frames. Tangents are weighted by angles, and a stretched instance has the angles of
 * its mesh. */
static void compare_surfaces(const char *shape, bool tangents, double turn)
{
	struct dice d = dice_for_test("surfaces of instances");
	struct world *a = world_of_pots(true, VIEW SKY, shape, 24, 16),
		     *b = world_of_pots(false, VIEW SKY, shape, 24, 16);
	assert_int_equal(a->shape_count, INSTANCE_COUNT);
	assert_int_equal(b->shape_count, INSTANCE_COUNT);
	assert_int_equal(a->sharing_shape_count, INSTANCE_COUNT);
	assert_int_equal(a->instance_count, INSTANCE_COUNT);
	assert_int_equal(a->shared_mesh_count, 1);
	assert_int_equal(b->sharing_shape_count, 0);
	for (uint32_t k = 0; k < INSTANCE_COUNT; k++) {
		const struct geom_shape *s = &a->shapes[k], *t = &b->shapes[k];
		assert_ptr_equal(s->position, a->shapes[0].position);
		assert_ptr_equal(s->normal, a->shapes[0].normal);
		assert_true((s->tangent != NULL) == tangents && (t->tangent != NULL) == tangents);
		/* Instances that are mirrored in the same way share their arrays. */
		for (uint32_t l = 0; l < k; l++)
			assert_true((s->tangent == a->shapes[l].tangent) ==
				    (!tangents || s->placement->is_mirrored == a->shapes[l].placement->is_mirrored));
		assert_int_equal(s->triangle_count, t->triangle_count);
		for (int i = 0; i < 200; i++) {
			struct surface_point x, y;
			struct surface_derivatives c, e;
			const struct prim_ref prim = {k, dice_below(&d, s->triangle_count), 0};
			double root = sqrt(dice_uniform(&d)), b1 = 1 - root, b2 = root * dice_uniform(&d);
			surface_on_triangle(s, prim, b1, b2, &x);
			surface_on_triangle(t, prim, b1, b2, &y);
			/* The bounding boxes of the two scenes differ, and with them their centres. */
			vec3 p = vec3_madd(a->center, 1 / a->scale, x.p), q = vec3_madd(b->center, 1 / b->scale, y.p);
			assert_true(distance(p, q) < 1e-6);
			assert_true(distance(x.ng, y.ng) < 1e-4 && distance(x.sh.n, y.sh.n) < 1e-5);
			assert_true(distance(x.sh.s, y.sh.s) < turn && distance(x.sh.t, y.sh.t) < turn);
			assert_true(fabs(x.u - y.u) < 1e-6 && fabs(x.v - y.v) < 1e-6);
			surface_compute_derivatives(s, &x, &c);
			surface_compute_derivatives(t, &y, &e);
			for (int m = 0; m < 2; m++)
				assert_true(distance(vec3_scale(a->scale, c.dn[m]), vec3_scale(b->scale, e.dn[m])) <
					    2 * turn * (1 + vec3_length(c.dn[m])));
		}
	}
	world_free(a);
	world_free(b);
}

static void test_shared_instances_have_the_same_surfaces(void **state)
{
	(void)state;
	compare_surfaces(FILE_OF(GLASS), false, 1e-3);
	compare_surfaces(FILE_OF("<bsdf type='roughconductor'><float name='alpha_u' value='0.3'/><float name='alpha_v' "
				 "value='0.1'/></bsdf>"),
			 true, 0.1);
}

/* Glass pots stand with their feet on the floor: the same primitives must hide the same others. */
static void test_coincident_surfaces_of_instances_are_hidden(void **state)
{
	(void)state;
	for (int lift = 0; lift < 2; lift++) {
		const char *floor =
			lift ? VIEW SKY "<shape type='rectangle'>" TO(
				       "<scale value='5'/><rotate x='1' angle='-90'/><translate y='0.01'/>") "</shape>"
			     : VIEW SKY FLOOR;
		struct world *a = world_of_pots(true, floor, FILE_OF(GLASS), 24, 16),
			     *b = world_of_pots(false, floor, FILE_OF(GLASS), 24, 16);
		assert_int_equal(a->sharing_shape_count, INSTANCE_COUNT);
		assert_true((a->coincidence != NULL) == !lift && (b->coincidence != NULL) == !lift);
		if (!lift) {
			/* The plain instance and a mirrored one coincide with the floor; the others are tilted, or
			 * stand elsewhere. */
			assert_int_equal(a->coincidence->pair_count, b->coincidence->pair_count);
			assert_true(a->coincidence->pair_count >= 48);
			for (size_t i = 0; i < a->coincidence->pair_count; i++)
				assert_memory_equal(&a->coincidence->pairs[i].hidden, &b->coincidence->pairs[i].hidden,
						    sizeof(struct prim_ref));
		}
		world_free(a);
		world_free(b);
	}
}

/* Displacement is in scene units: a stretched instance has a mesh of its own, displaced by the same height as the
 * others. */
static void test_stretched_instances_have_their_own_displacement(void **state)
{
	(void)state;
#define DISPLACED                                                                               \
	"<float name='displacement' value='1'/><float name='displacement_scale' value='0.05'/>" \
	"<integer name='displacement_level' value='1'/>"
	struct world *a = world_of_pots(true, VIEW SKY, FILE_OF(DISPLACED), 12, 8),
		     *b = world_of_pots(false, VIEW SKY, FILE_OF(DISPLACED), 12, 8);
	assert_int_equal(a->sharing_shape_count, 1); /* only one of the four is merely moved */
	for (uint32_t k = 0; k < INSTANCE_COUNT; k++) {
		struct surface_point x, y;
		surface_on_triangle(&a->shapes[k], (struct prim_ref){k, 77, 0}, 0.3, 0.3, &x);
		surface_on_triangle(&b->shapes[k], (struct prim_ref){k, 77, 0}, 0.3, 0.3, &y);
		assert_true(distance(vec3_madd(a->center, 1 / a->scale, x.p), vec3_madd(b->center, 1 / b->scale, y.p)) <
			    1e-6);
	}
	world_free(a);
	world_free(b);
}

static void test_only_suitable_meshes_are_shared(void **state)
{
	(void)state;
	static const char *const inside[] = {
		"<shape type='sphere'/>",
		"<shape type='cube'/>",
		FILE_OF("<emitter type='area'><float name='radiance' value='1'/></emitter>"),
	};
	for (size_t i = 0; i < sizeof inside / sizeof *inside; i++) {
		struct world *w = world_of_pots(true, VIEW SKY, inside[i], 12, 8);
		assert_int_equal(w->sharing_shape_count, 0);
		assert_int_equal(w->shape_count, INSTANCE_COUNT);
		world_free(w);
	}
	world_check_refused("<shape type='shapegroup' id='g'><shape type='cube'/></shape>\n\n"
			    "<shape type='instance'><ref id='g'/>" TO("<scale x='1' y='0' z='1'/>") "</shape>",
			    ":3: <shape type=\"instance\">: to_world flattens");
}

static void test_images(void **state)
{
	(void)state;
	const char *room =
		"<integrator type='path'><integer name='max_depth' value='4'/></integrator>" VIEW SKY FLOOR LAMP;
	/* clang-format off */
	const char *inside =
		FILE_OF(BUMPS)
		"<shape type='obj'>"
			"<string name='filename' value='m.obj'/>"
			TO("<scale value='0.5'/><translate x='0.5' z='0.7'/>")
			"<bsdf type='roughdielectric'><float name='alpha' value='0.3'/></bsdf>"
		"</shape>";
	/* clang-format on */
	struct world *a = world_of_pots(true, room, inside, 24, 16), *b = world_of_pots(false, room, inside, 24, 16);
	assert_int_equal(a->sharing_shape_count, 2 * INSTANCE_COUNT);
	static struct agreement_image shared, written, chains;
	agreement_render(a, __func__, "instances", &(struct agreement_options){"path", 640, 32, 0, 0}, &shared);
	agreement_render(b, __func__, "copies", &(struct agreement_options){"path", 640, 32, 0, 0}, &written);
	agreement_check(__func__, &shared, &written);
	agreement_render(a, __func__, "chains", &(struct agreement_options){"hslt", 160, 32, 0, 0}, &chains);
	agreement_check_any_power(__func__, &chains, &shared);
	world_free(a);
	world_free(b);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_shared_instances_have_the_same_surfaces),
		cmocka_unit_test(test_coincident_surfaces_of_instances_are_hidden),
		cmocka_unit_test(test_stretched_instances_have_their_own_displacement),
		cmocka_unit_test(test_only_suitable_meshes_are_shared),
		cmocka_unit_test(test_images),
	};
	return cmocka_run_group_tests_name("instance", tests, NULL, NULL);
}
