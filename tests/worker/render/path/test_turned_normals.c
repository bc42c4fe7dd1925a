/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shading normals that relief tilts away from the camera: seen from the camera, the surface must scatter like one
 * whose normal map is mirrored in x and y, and sampling from the light must not use such normals. Checked against
 * worlds with the mirrored map, and by comparing integrators (tests/support/agreement.h).
 */
#include "tests/support/agreement.h"
#include "tests/support/memory_assets.h"
#include "tests/support/stats.h"
#include "tests/support/worlds.h"
#include "worker/render/emitter/uniform.h"
#include "worker/render/math/rng.h"
#include "worker/render/path/path.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* One triangle whose vertex normals differ from its geometric normal. */
static const char mesh[] = "v 0 0 0\nv 2 0 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0.3 0 1\nvn 0.2 0.3 1\nvn 0 -0.2 1\n"
			   "f 1/1/1 2/2/2 3/3/3\n";

static struct world *world_of(const char *shape, const char *color, bool flip, const char *inner)
{
	static char xml[2048];
	snprintf(xml, sizeof xml,
		 "<scene version='3.0.0'><sensor type='perspective'><film type='hdrfilm'/></sensor><emitter "
		 "type='constant'/>"
		 "<shape type='%s'>%s<bsdf type='normalmap'><rgb name='normalmap' value='%s'/>"
		 "<boolean name='flip_invalid_normals' value='%s'/>%s</bsdf></shape></scene>",
		 shape, strcmp(shape, "obj") == 0 ? "<string name='filename' value='m.obj'/>" : "", color,
		 flip ? "true" : "false", inner);
	const struct memory_file files[] = {
		{"s.xml", xml, strlen(xml)}, {"m.obj", mesh, sizeof mesh - 1}, {NULL, NULL, 0}};
	return world_from_files(8, 8, files);
}

static struct path_vertex vertex_on(const struct world *w, uint64_t i)
{
	double u[4];
	rng_uniform4(stats_seed(__func__), RNG_TEST, i, 0, 0, u);
	struct path_vertex v = {.kind = VERTEX_SURFACE, .emitter = -1, .bsdf = &w->bsdfs[w->shape_bindings[0].bsdf]};
	if (w->shapes[0].is_sphere)
		surface_on_sphere(&w->shapes[0], (struct prim_ref){0, 0, 0}, sphere_from_square(u), &v.x);
	else
		surface_on_triangle(&w->shapes[0], (struct prim_ref){0, 0, 0}, u[0] * (1 - u[1]), u[1] * u[0], &v.x);
	return v;
}

static struct path_vertex vertex_beside(const struct path_vertex *v, vec3 d)
{
	struct path_vertex to = {.kind = VERTEX_SURFACE, .emitter = -1};
	to.x.p = vec3_add(v->x.p, d);
	to.x.ng = d;
	return to;
}

static bool is_on_front_side(const struct path_vertex *v, vec3 w)
{
	return vec3_dot(v->x.ng, w) * vec3_dot(v->x.sh.n, w) > 0;
}

/* f: scattering towards o of light from i; to_light: density of i seen from o; to_camera: density of o seen from i. */
struct scattering_values {
	double f, to_light, to_camera;
};

static struct scattering_values scattering_at(const struct world *w, const struct path_vertex *v, vec3 o, vec3 i)
{
	static struct path_context c;
	c.w = w;
	c.wl = (struct wavelengths){.nm = {450, 500, 550, 600}};
	const struct path_vertex camera = vertex_beside(v, o), light = vertex_beside(v, i);
	return (struct scattering_values){spectrum_mean(path_scatter(&c, v, o, i)),
					  path_pdf(&c, &camera, v, &light, TRANSPORT_RADIANCE),
					  path_pdf(&c, &light, v, &camera, TRANSPORT_IMPORTANCE)};
}

static void assert_same(double got, double expected)
{
	if (!(fabs(got - expected) <= 1e-9 * fabs(expected)))
		fail_msg("%.12g is not %.12g", got, expected);
}

/* turns: the material turns such normals. */
static void check(const char *shape, const char *inner, bool turns)
{
	enum { POINTS = 4000 };
	static const char color[] = "0.9,0.35,0.8", mirrored[] = "0.1,0.65,0.8";
	struct world *w = world_of(shape, color, true, inner), *plain = world_of(shape, color, false, inner),
		     *other = world_of(shape, mirrored, false, inner);
	int lit = 0;
	for (uint64_t k = 0; k < POINTS; k++) {
		double u[4];
		rng_uniform4(stats_seed(__func__), RNG_TEST, k, 0, 0, u);
		vec3 o = sphere_from_square(u), i = sphere_from_square(u + 2);
		struct path_vertex v = vertex_on(w, k), p = vertex_on(plain, k), q = vertex_on(other, k);
		bool away = !is_on_front_side(&p, o) && is_on_front_side(&q, o);
		struct scattering_values got = scattering_at(w, &v, o, i), as_it_is = scattering_at(plain, &p, o, i),
					 turned = scattering_at(other, &q, o, i);
		struct surface_point room;
		assert_true((path_point_facing_camera(&v, o, &room) == &room) == (away && turns));
		if (!(away && turns)) {
			assert_true(got.f == as_it_is.f && got.to_light == as_it_is.to_light &&
				    got.to_camera == as_it_is.to_camera);
			continue;
		}
		assert_true(as_it_is.f == 0 && got.to_camera == 0);
		assert_same(got.f, turned.f);
		assert_same(got.to_light, turned.to_light);
		lit += got.f > 0;
	}
	print_message("%s: %d turned\n", inner, lit);
	assert_true(turns == (lit > POINTS / 50));
	world_free(w);
	world_free(plain);
	world_free(other);
}

static void normals_away_from_the_camera_scatter_like_mirrored_maps(void **state)
{
	(void)state;
	static const char *const shapes[] = {"sphere", "rectangle", "obj"};
	for (int k = 0; k < 3; k++) {
		check(shapes[k], "<bsdf type='diffuse'/>", true);
		check(shapes[k], "<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf>", true);
		check(shapes[k], "<bsdf type='roughdielectric'><float name='alpha' value='0.4'/></bsdf>", true);
		check(shapes[k], "<bsdf type='plastic'/>", false);
	}
}

/* Files of version 0.6 turn normals only if they say so. */
static void version_0_6_turns_normals_only_on_request(void **state)
{
	(void)state;
	static const char inside[] =
		"<sensor type='perspective'><film type='hdrfilm'/></sensor><emitter type='constant'/><shape "
		"type='sphere'><bsdf type='normalmap'><rgb name='normalmap' value='0.6,0.5,0.9'/>%s<bsdf "
		"type='diffuse'/></bsdf></shape></scene>";
	static const struct {
		const char *version, *param;
		bool turns;
	} cases[] = {
		{"3.0.0", "", true},
		{"0.6.0", "", false},
		{"0.6.0", "<boolean name='flipInvalidNormals' value='true'/>", true},
		{"3.0.0", "<boolean name='flip_invalid_normals' value='false'/>", false},
	};
	for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
		char xml[1024];
		int n = snprintf(xml, sizeof xml, "<scene version='%s'>", cases[k].version);
		snprintf(xml + n, sizeof xml - (size_t)n, inside, cases[k].param);
		const struct memory_file files[] = {{"s.xml", xml, strlen(xml)}, {NULL, NULL, 0}};
		struct world *w = world_from_files(8, 8, files);
		assert_true(w->shapes[0].relief->flips_invalid_normals == cases[k].turns);
		world_free(w);
	}
}

/* clang-format off */
#define STEEP(inner)                                                                                                           \
	"<bsdf type='normalmap'><texture type='checkerboard'><rgb name='color0' value='0.5,0.93,0.75'/>"                       \
	"<rgb name='color1' value='0.5,0.07,0.75'/></texture>" inner "</bsdf>"
/* Half of the floor's normals lean away from the camera, the other half away from the wall behind it. */
static const char room[] =
	"<integrator type='path'><integer name='max_depth' value='5'/></integrator>" SENSOR("0,1.2,5", "0,0.7,0")
	"<shape type='rectangle'><transform name='to_world'><scale value='2'/><rotate x='1' angle='-90'/></transform>"
	STEEP("<bsdf type='roughplastic'><float name='alpha' value='0.3'/></bsdf>") "</shape>"
	"<shape type='rectangle'><transform name='to_world'><scale value='2'/><translate z='-2'/></transform></shape>"
	"<shape type='sphere'><point name='center' x='0.7' y='0.6' z='0.3'/><float name='radius' value='0.5'/>"
	STEEP("<bsdf type='roughconductor'><float name='alpha' value='0.4'/></bsdf>") "</shape>"
	"<shape type='rectangle'><transform name='to_world'><scale value='0.8'/><rotate x='1' angle='90'/>"
	"<translate x='-0.5' y='2.5'/></transform><emitter type='area'><float name='radiance' value='3'/></emitter></shape>";
/* clang-format on */

static void integrators_agree_on_turned_normals(void **state)
{
	(void)state;
	struct world *w = world_from_text(32, 32, "%s", room);
	static struct agreement_image path, other;
	agreement_render(w, __func__, "path", &(struct agreement_options){"path", 2560, 32, 0, 0}, &path);
	agreement_render(w, __func__, "bdpt", &(struct agreement_options){"bdpt", 2048, 32, 0, 0}, &other);
	agreement_check(__func__, &other, &path);
	world_free(w);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(normals_away_from_the_camera_scatter_like_mirrored_maps),
					   cmocka_unit_test(version_0_6_turns_normals_only_on_request),
					   cmocka_unit_test(integrators_agree_on_turned_normals)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
