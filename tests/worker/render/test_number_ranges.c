/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Every number in every table of plug-ins has a range. Values beyond it are refused with file, line, value and range;
 * the ends and values between them render without an invalid operation, or are refused with their place by a rule of
 * their own (two numbers that contradict each other, a scene that is too large). Each trial is a whole scene in a
 * process of its own.
 */
#include "tests/support/measured_file.h"
#include "tests/support/test_length.h"
#include "tests/support/scene_trial.h"
#include "worker/render/render.h"
#include "worker/render/plugin/plugin.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { TEXT = 8192 };
static const unsigned numeric_types = VALUE_INT | VALUE_FLOAT | VALUE_POINT | VALUE_RGB | VALUE_SPECTRUM;

static const unsigned char sky_bytes[] =
	"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x80\x80\x80\x80\x90\x70\x80";
static const char obj_text[] = "v -1 0 -1\nv 1 0 -1\nv 0 0 1\nv 0 1 0\nf 1 2 3\nf 1 4 2\n";
static const char ply_text[] =
	"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
	"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/* A volume with two bytes along x. */
static const char vol_bytes[] = "VOL\3\3\0\0\0\2\0\0\0\1\0\0\0\1\0\0\0\1\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0"
				"\0\0\200?\0\0\200?\0\0\200?\10\20";

/* Prints the property as XML; returns 0 if the parameter takes no value of this type. */
static int print_value(char *out, size_t size, const struct param *p, enum value_type type, double x)
{
	switch (type) {
	case VALUE_INT:
		return x == nearbyint(x) && fabs(x) < 1e15
			       ? snprintf(out, size, "<integer name='%s' value='%.0f'/>", p->name, x)
			       : 0;
	case VALUE_FLOAT:
		return snprintf(out, size, "<float name='%s' value='%.17g'/>", p->name, x);
	case VALUE_POINT:
		return snprintf(out, size, "<point name='%s' x='%.17g' y='%.17g' z='%.17g'/>", p->name, 0.25 * x, x, x);
	case VALUE_RGB:
		return snprintf(out, size, "<rgb name='%s' value='%.17g %.17g %.17g'/>", p->name, x, 0.5 * x, x);
	default:
		return snprintf(out, size, "<spectrum name='%s' value='400:%.17g, 500:%.17g, 600:%.17g'/>", p->name, x,
				0.5 * x, x);
	}
}

/* Returns other properties without which this one has no effect. */
static const char *companion_properties(const struct plugin_decl *d, const struct param *p)
{
	if (strcmp(p->name, "displacement") == 0)
		return "<integer name='displacement_level' value='1'/>";
	if (strcmp(p->name, "displacement_scale") == 0)
		return "<float name='displacement' value='0.1'/><integer name='displacement_level' value='1'/>";
	if (strcmp(p->name, "displacement_level") == 0)
		return "<float name='displacement' value='0.1'/>";
	if (strcmp(d->type, "blendphase") == 0)
		return "<phase type='isotropic'/><phase type='hg'/>";
	if (strcmp(d->type, "thinlens") == 0 && strcmp(p->name, "aperture_radius") != 0)
		return "<float name='aperture_radius' value='0.01'/>";
	return "";
}

static const char *file_of(const struct plugin_decl *d)
{
	return strcmp(d->type, "obj") == 0		    ? "<string name='filename' value='m.obj'/>"
	       : strcmp(d->type, "ply") == 0		    ? "<string name='filename' value='m.ply'/>"
	       : strcmp(d->type, "gridvolume") == 0	    ? "<string name='filename' value='m.vol'/>"
	       : strcmp(d->type, "measured_polarized") == 0 ? "<string name='filename' value='polarized.pbsdf'/>"
	       : strcmp(d->type, "bitmap") == 0 || strcmp(d->type, "envmap") == 0
		       ? "<string name='filename' value='sky.hdr'/>"
		       : "";
}

#define PROPERTY "%s%s%s" /* file, companions, the property itself */
#define LOOK_AT "<transform name='to_world'><lookat origin='0.1,1,4' target='0,0.3,0' up='0,1,0'/></transform>"
#define FLOOR \
	"<shape type='rectangle'><transform name='to_world'><scale value='2'/><rotate x='1' angle='-90'/></transform>%s</shape>"
#define BALL \
	"<shape type='sphere'><point name='center' x='0' y='0.5' z='0'/><float name='radius' value='0.4'/>%s</shape>"

/* Prints a scene whose image depends on the plug-in. */
static void print_scene(char *text, const struct plugin_decl *d, const char *companion, const char *property)
{
	char own[2048], sensor[2600], ball[2600] = "", light[2600] = "";
	bool medium = d->cls == PLUGIN_MEDIUM, volume = d->cls == PLUGIN_VOLUME,
	     in_medium = volume || d->cls == PLUGIN_PHASE, emission = strcmp(d->type, "volumelight") == 0;
	snprintf(own, sizeof own, "\n%s<%s type='%s'%s>" PROPERTY "</%s>%s%s\n",
		 volume	     ? "<medium type='heterogeneous' name='interior'>"
		 : in_medium ? "<medium type='homogeneous' name='interior'>"
			     : "",
		 plugin_class_name(d->cls), d->type,
		 medium	  ? " name='interior'"
		 : volume ? " name='sigma_t'"
			  : "",
		 file_of(d), companion, property, plugin_class_name(d->cls), in_medium ? "</medium>" : "",
		 medium || in_medium ? "<bsdf type='null'/>"
		 : emission	     ? "<bsdf type='null'/><medium type='homogeneous' name='interior'/>"
				     : "");
	bool nested = d->cls == PLUGIN_FILM || d->cls == PLUGIN_RFILTER || d->cls == PLUGIN_SAMPLER;
	if (d->cls == PLUGIN_SENSOR)
		snprintf(sensor, sizeof sensor, "\n<sensor type='%s'>" LOOK_AT "%s%s</sensor>", d->type, companion,
			 property);
	else
		snprintf(sensor, sizeof sensor, "<sensor type='perspective'>" LOOK_AT "%s%s%s</sensor>",
			 d->cls == PLUGIN_RFILTER ? "<film type='hdrfilm'>" : "", nested ? own : "",
			 d->cls == PLUGIN_RFILTER ? "</film>" : "");
	if (d->cls == PLUGIN_BSDF || medium || in_medium)
		snprintf(ball, sizeof ball, BALL, own);
	else if (d->cls == PLUGIN_TEXTURE)
		snprintf(ball, sizeof ball,
			 "<shape type='cube'><bsdf type='diffuse'>\n<texture name='reflectance' type='%s'>" PROPERTY
			 "</texture></bsdf></shape>",
			 d->type, file_of(d), companion, property);
	else if (d->cls == PLUGIN_EMITTER && (emission || strcmp(d->type, "area") == 0))
		snprintf(light, sizeof light, BALL, own);
	else if (d->cls == PLUGIN_EMITTER || d->cls == PLUGIN_SHAPE || d->cls == PLUGIN_INTEGRATOR)
		snprintf(light, sizeof light, "%s", own);
	snprintf(text, TEXT, "<scene version='3.0.0'>%s" FLOOR "%s%s%s</scene>", sensor, "", ball, light,
		 d->cls == PLUGIN_EMITTER ? "" : "<emitter type='constant'/>");
}

struct counts {
	size_t params, trials, rendered, refused, failures;
};

static int render_with_value(const struct plugin_decl *d, const struct param *p, enum value_type type, double x,
			     char *error_text, size_t size, char *text)
{
	char property[512];
	if (!print_value(property, sizeof property, p, type, x))
		return 0;
	print_scene(text, d, companion_properties(d, p), property);
	const struct memory_file files[] = {{"s.xml", text, strlen(text)},
					    {"sky.hdr", sky_bytes, sizeof sky_bytes - 1},
					    {"m.obj", obj_text, sizeof obj_text - 1},
					    {"m.ply", ply_text, sizeof ply_text - 1},
					    {"m.vol", vol_bytes, sizeof vol_bytes - 1},
					    measured_file_all()[3],
					    {NULL, NULL, 0}};
	return scene_trial_run(files, error_text, size);
}

static void check_value_in_range(const struct plugin_decl *d, const struct param *p, enum value_type type, double x,
				 struct counts *c)
{
	char error_text[1024], text[TEXT], own[120], positive[120];
	int end = render_with_value(d, p, type, x, error_text, sizeof error_text, text);
	if (!end)
		return;
	snprintf(own, sizeof own, "%s=%.9g is outside [", p->name, x);
	snprintf(positive, sizeof positive, "%s=%g must be positive", p->name, x);
	c->trials++;
	c->rendered += end == TRIAL_RENDERED;
	c->refused += end == TRIAL_REFUSED;
	if (end == TRIAL_RENDERED ||
	    (end == TRIAL_REFUSED && !strstr(error_text, own) && !strstr(error_text, positive)))
		return;
	c->failures++;
	print_message("%s, %s = %g: ends with %d: %s\n", d->type, p->name, x, end, error_text);
}

static void check_value_out_of_range(const struct plugin_decl *d, const struct param *p, enum value_type type, double x,
				     struct counts *c)
{
	char error_text[1024], text[TEXT];
	int end = render_with_value(d, p, type, x, error_text, sizeof error_text, text);
	if (!end)
		return;
	c->trials++;
	if (end == TRIAL_REFUSED && strstr(error_text, "s.xml:2: ") &&
	    (strstr(error_text, "is outside [") || strstr(error_text, " must be positive")))
		return;
	c->failures++;
	print_message("%s, %s = %g, beyond its range [%g, %g]: ends with %d: %s\n", d->type, p->name, x, p->min, p->max,
		      end, error_text);
}

/* Returns the next representable number towards `toward`; for integers the next whole number. */
static double next_number(enum value_type type, double x, double toward)
{
	return type == VALUE_INT ? x + (toward > x ? 1 : -1) : x == 0 ? copysign(1e-6, toward) : nextafter(x, toward);
}

static void check_param(const struct plugin_decl *d, const struct param *p, struct counts *c)
{
	c->params++;
	if (!(p->min < p->max)) {
		c->failures++;
		print_message("%s of %s has no range\n", p->name, d->type);
		return;
	}
	for (unsigned type = 1; type <= p->types; type <<= 1) {
		if (!(p->types & type & numeric_types))
			continue;
		enum value_type t = (enum value_type)type;
		check_value_in_range(d, p, t, p->min, c);
		if (strcmp(p->name, "displacement_level") != 0) /* 2^27 triangles: gigabytes */
			check_value_in_range(d, p, t, p->max, c);
		if (type == VALUE_FLOAT && p->min >= 0)
			check_value_in_range(d, p, t, sqrt(fmax(p->min, 1e-30)) * sqrt(p->max), c);
		void (*check)(const struct plugin_decl *, const struct param *, enum value_type, double,
			      struct counts *) = (p->types & VALUE_CLAMPED) && t != VALUE_SPECTRUM
							 ? check_value_in_range
							 : check_value_out_of_range;
		check(d, p, t, next_number(t, p->max, INFINITY), c);
		check(d, p, t, next_number(t, p->min, -INFINITY), c);
	}
}

static void every_number_has_a_range_that_is_enforced(void **state)
{
	(void)state;
	struct counts c = {0};
	const struct param *seen[256];
	size_t seen_count = 0, numbers = 0; /* every fourth number under sanitizers */
	for (const struct plugin_decl *d = render_plugins(); d->type; d++) {
		bool is_repeated = false; /* tables shared by several plug-ins */
		for (size_t i = 0; i < seen_count; i++)
			is_repeated |= seen[i] == d->params;
		assert_true(seen_count < 256);
		seen[seen_count++] = d->params;
		for (const struct param *p = d->params; p && p->name && !is_repeated; p++)
			if (p->status == PARAM_UNDERSTOOD && (p->types & numeric_types) &&
			    (!test_is_scaled() || numbers++ % 4 == 0))
				check_param(d, p, &c);
	}
	print_message("%zu numbers, %zu trials: %zu rendered, %zu refused by another rule, %zu bad\n", c.params,
		      c.trials, c.rendered, c.refused, c.failures);
	assert_int_equal(c.failures, 0);
	assert_true(c.params > 60 && c.rendered > c.params);
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(every_number_has_a_range_that_is_enforced)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
