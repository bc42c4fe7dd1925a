/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads <transform> and vectors given as attributes.
 *
 * Happy path: transform_read goes through the elements in order, finds each in the table `steps`, and multiplies its
 * matrix from the left, so that it applies to the result of the previous ones.
 *
 * Failures are errors with file and line: an unknown element (with the most similar name), a missing or malformed
 * attribute, a matrix that is not affine, a lookat without a direction, a number outside PARAM_LENGTH_MAX. The first
 * failure ends the reading; transform_report then reports those of all elements.
 */
#include "worker/render/scene/transform.h"

#include "common/base/spelling.h"
#include "worker/render/math/frame.h"
#include "worker/render/text/number.h"

#include <string.h>

/* Allowed error of the last row: matrices inverted in float by scripts have such errors there. */
#define AFFINE_TOLERANCE 1e-6

/* Refuses numbers whose size would keep squares of areas from being represented. */
static int check_number(const struct xml_element *el, const char *attribute, double x, struct error *e)
{
	if (fabs(x) <= PARAM_LENGTH_MAX)
		return 0;
	return xml_error(el, e, ERANGE, "%s=%g is outside [%g, %g]", attribute, x, -PARAM_LENGTH_MAX, PARAM_LENGTH_MAX);
}

static int read_triple(const struct xml_element *el, const char *attribute, vec3 *out, struct error *e)
{
	const char *text = xml_attribute_value(el, attribute);
	double v[3];
	if (!text)
		return element_refuse_missing_attribute(el, attribute, e);
	if (number_parse_list(text, v, 3) != 3)
		return xml_error(el, e, EINVAL, "%s=\"%.64s\" is not three numbers", attribute, text);
	for (int i = 0; i < 3; i++) {
		int r = check_number(el, attribute, v[i], e);
		if (r)
			return r;
	}
	*out = (vec3){v[0], v[1], v[2]};
	return 0;
}

int transform_read_vec3(const struct xml_element *el, double fallback, bool allow_single, vec3 *out, struct error *e)
{
	static const char *const axes[3] = {"x", "y", "z"};
	double v[3];
	const char *text = xml_attribute_value(el, "value");
	bool has_component = false;
	for (int i = 0; i < 3; i++) {
		const char *component = xml_attribute_value(el, axes[i]);
		v[i] = fallback;
		has_component |= component != NULL;
		if (component && !number_parse(component, &v[i]))
			return xml_error(el, e, EINVAL, "%s=\"%.64s\" is not a (finite) number", axes[i], component);
	}
	if (has_component == (text != NULL))
		return xml_error(el, e, EINVAL, "needs either x, y, z or value");
	if (text) {
		int n = number_parse_list(text, v, 3);
		bool single_allowed = allow_single || !el->is_camel_case; /* in 3.x also for positions and directions */
		if (n == 1 && single_allowed)
			v[1] = v[2] = v[0];
		else if (n != 3)
			return xml_error(el, e, EINVAL, "value=\"%.64s\" is not three numbers%s", text,
					 single_allowed ? " or one" : "");
	}
	for (int i = 0; i < 3; i++) {
		int r = check_number(el, text ? "value" : axes[i], v[i], e);
		if (r)
			return r;
	}
	*out = (vec3){v[0], v[1], v[2]};
	return 0;
}

static int read_translate(const struct xml_element *el, mat4 *m, struct error *e)
{
	vec3 v;
	int r = transform_read_vec3(el, 0, false, &v, e);
	*m = r ? *m : mat4_translate(v);
	return r;
}

static int read_scale(const struct xml_element *el, mat4 *m, struct error *e)
{
	vec3 v;
	int r = transform_read_vec3(el, 1, true, &v, e);
	*m = r ? *m : mat4_scale(v);
	return r;
}

static int read_rotate(const struct xml_element *el, mat4 *m, struct error *e)
{
	vec3 axis;
	double degrees;
	int r = transform_read_vec3(el, 0, false, &axis, e);
	if (r)
		return r;
	const char *angle = xml_attribute_value(el, "angle");
	if (!angle || !number_parse(angle, &degrees))
		return xml_error(el, e, EINVAL, "needs an angle in degrees");
	r = check_number(el, "angle", degrees, e);
	if (r)
		return r;
	double length = vec3_length(axis);
	if (degrees == 0) { /* whatever the axis, even none */
		*m = mat4_identity();
		return 0;
	}
	if (!(length > 0) || !isfinite(length))
		return xml_error(el, e, EINVAL, "has no axis: x, y, z are (%g, %g, %g)", axis.x, axis.y, axis.z);
	*m = mat4_rotate(axis, degrees);
	return 0;
}

static bool is_in_range(const mat4 *m)
{
	for (int i = 0; i < 4; i++)
		for (int j = 0; j < 4; j++)
			if (!(fabs(m->m[i][j]) <= PARAM_LENGTH_MAX))
				return false;
	return true;
}

/* Returns the default for `up`: in each version of Mitsuba, the first axis that its own function makes perpendicular
 * to the view. */
static vec3 default_up(const struct xml_element *el, vec3 view)
{
	if (!el->is_camel_case)
		return frame_around(view).s;
	vec3 side = fabs(view.x) > fabs(view.y) ? (vec3){view.z, 0, -view.x} : (vec3){0, view.z, -view.y};
	return vec3_cross(vec3_normalize(side), view);
}

static int read_lookat(const struct xml_element *el, mat4 *m, struct error *e)
{
	vec3 origin, target, up;
	int r = read_triple(el, "origin", &origin, e);
	if (!r)
		r = read_triple(el, "target", &target, e);
	bool has_up = xml_attribute_value(el, "up") != NULL;
	if (!r && has_up)
		r = read_triple(el, "up", &up, e);
	if (r)
		return r;
	if (!has_up || (up.x == 0 && up.y == 0 && up.z == 0))
		up = default_up(el, vec3_normalize(vec3_sub(target, origin)));
	*m = mat4_look_at(origin, target, up);
	if (!is_in_range(m))
		return xml_error(el, e, EINVAL, "origin and target are equal, or up is parallel to the view");
	return 0;
}

static int read_matrix(const struct xml_element *el, mat4 *m, struct error *e)
{
	const char *text = xml_attribute_value(el, "value");
	double v[16];
	int n = text ? number_parse_list(text, v, 16) : -1;
	if (n != 16 && n != 9)
		return xml_error(el, e, EINVAL, "needs value=\"...\" with 16 or 9 numbers, row by row");
	*m = mat4_identity();
	int side = n == 16 ? 4 : 3;
	for (int i = 0; i < n; i++) {
		int r = check_number(el, "value", v[i], e);
		if (r)
			return r;
		m->m[i / side][i % side] = v[i];
	}
	bool is_affine = true;
	for (int i = 0; i < 4; i++) {
		is_affine &= fabs(m->m[3][i] - (i == 3)) <= AFFINE_TOLERANCE;
		m->m[3][i] = i == 3;
	}
	if (!is_affine)
		return xml_error(el, e, EINVAL, "the last row must be 0 0 0 1: only affine transforms are supported");
	return 0;
}

static const struct step {
	const char *element, *attributes;
	int (*read)(const struct xml_element *el, mat4 *m, struct error *e);
} steps[] = {
	{"translate", "x|y|z|value", read_translate},
	{"rotate", "x|y|z|value|angle", read_rotate},
	{"scale", "x|y|z|value", read_scale},
	{"lookat", "origin|target|up", read_lookat},
	{"lookAt", "origin|target|up", read_lookat},
	{"look_at", "origin|target|up", read_lookat},
	{"matrix", "value", read_matrix},
};
enum { STEPS = sizeof steps / sizeof *steps };

static const struct step *find_step(const char *name, struct spelling *s)
{
	for (int i = 0; i < STEPS; i++) {
		if (strcmp(steps[i].element, name) == 0)
			return &steps[i];
		spelling_offer(s, steps[i].element);
	}
	return NULL;
}

static int read_step(const struct xml_element *el, mat4 *out, struct error *e)
{
	struct spelling s = {.wanted_name = el->name};
	const struct step *step = find_step(el->name, &s);
	char hint[128];
	if (!step)
		return xml_error(el, e, EINVAL,
				 "is not a transform%s (supported: translate, rotate, scale, lookat, matrix)",
				 spelling_hint(&s, hint, sizeof hint));
	int r = element_check_contents(el, step->attributes, false, e);
	return r ? r : step->read(el, out, e);
}

int transform_read(const struct xml_element *el, mat4 *out, struct error *e)
{
	mat4 m = mat4_identity();
	for (const struct xml_element *c = el->first_child; c; c = c->next_sibling) {
		if (c->is_ignored)
			continue;
		mat4 step_matrix;
		int r = read_step(c, &step_matrix, e);
		if (r)
			return r;
		m = mat4_mul(step_matrix, m);
		if (!is_in_range(&m))
			return xml_error(c, e, ERANGE, "the transform is out of range: an element is outside [%g, %g]",
					 -PARAM_LENGTH_MAX, PARAM_LENGTH_MAX);
	}
	*out = m;
	return 0;
}

/* Reports the problems of all steps, except for the known one. */
static int report_steps(const struct xml_element *el, const struct error *reported, struct report *report,
			struct error *e)
{
	int r = 0;
	for (const struct xml_element *c = el->first_child; c && !r; c = c->next_sibling) {
		mat4 unused;
		if (strcmp(c->name, "transform") == 0) /* of an animation */
			r = report_steps(c, reported, report, e);
		else if (!c->is_ignored && !c->is_unset && read_step(c, &unused, e) &&
			 strcmp(e->text, reported->text) != 0)
			r = report_problem(report, -EINVAL, e);
	}
	return r;
}

int transform_report(const struct xml_element *el, int failure, struct report *report, struct error *e)
{
	const struct error first = *e;
	bool has_steps = strcmp(el->name, "transform") == 0 || strcmp(el->name, "animation") == 0;
	if (!has_steps || (failure != -EINVAL && failure != -ERANGE))
		return failure;
	int r = report_problem(report, failure, e);
	if (!r)
		r = report_steps(el, &first, report, e);
	return r ? r : REPORT_ALREADY_REPORTED;
}
