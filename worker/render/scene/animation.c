/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/animation.h"

#include "worker/render/text/number.h"
#include "worker/render/scene/transform.h"

#include <string.h>

/* Keeps differences between times, and times in units of the shutter's, finite. */
#define TIME_MAX 1e30
/* Smallest size of a transform, and how much more it may stretch in one direction than in another. */
#define TRANSFORM_SIZE_MIN 1e-60
#define STRETCH_RATIO_MAX 1e12

static int read_keyframe(const struct xml_element *el, bool needs_time, struct keyframe *out, struct error *e)
{
	if (strcmp(el->name, "transform") != 0)
		return xml_error(el, e, EINVAL, "has no place in <animation>, which holds transforms");
	const char *time = xml_attribute_value(el, "time");
	int r = element_check_contents(el, "name|time", true, e);
	if (!r)
		r = transform_read(el, &out->transform, e);
	if (!r && needs_time && (!time || !number_parse(time, &out->time)))
		r = xml_error(el, e, EINVAL, "needs a time, a (finite) number");
	if (!r && !(fabs(out->time) <= TIME_MAX))
		r = xml_error(el, e, ERANGE, "time=%g is outside [%g, %g]", out->time, -TIME_MAX, TIME_MAX);
	return r;
}

static double largest_element(const mat4 *m)
{
	double largest = 0;
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			largest = fmax(largest, fabs(m->m[i][k]));
	return largest;
}

/* Checks that the transform can be decomposed into a rotation and a remainder, whose squares and determinant can be
 * represented. */
static int check_decomposable(const struct xml_element *el, const struct keyframe *key, struct error *e)
{
	mat4 inverse;
	double size = largest_element(&key->transform);
	if (!mat4_invert(key->transform, &inverse))
		return xml_error(el, e, EINVAL, "flattens the object (it has no inverse)");
	if (!(size >= TRANSFORM_SIZE_MIN) || !(size * largest_element(&inverse) <= STRETCH_RATIO_MAX))
		return xml_error(
			el, e, ERANGE,
			"makes the object too small, or stretches it more than %g times as far in one direction as in another",
			STRETCH_RATIO_MAX);
	return 0;
}

/* Checks that there is a motion from one keyframe to the next. */
static int check_interval(const struct xml_element *el, const struct keyframe *previous, const struct keyframe *current,
			  struct error *e)
{
	if (!(current->time > previous->time))
		return xml_error(el, e, EINVAL, "time=%g is not after the time of the transform before, %g",
				 current->time, previous->time);
	if ((mat4_det3(previous->transform) < 0) != (mat4_det3(current->transform) < 0))
		return xml_error(el, e, EINVAL,
				 "either this transform or the one before mirrors the object, but not both");
	return 0;
}

int animation_read(const struct xml_element **el, struct arena *arena, const struct animation **out, struct error *e)
{
	const struct xml_element *animation = *el;
	int r = element_check_contents(animation, "name", true, e);
	uint32_t count = 0;
	for (const struct xml_element *c = animation->first_child; c; c = c->next_sibling)
		count++;
	struct animation *a = arena_alloc(arena, 1, sizeof *a);
	struct keyframe *key = arena_alloc(arena, count, sizeof *key);
	bool is_moving = false;
	*out = NULL;
	if (r)
		return r;
	if (!count)
		return xml_error(animation, e, EINVAL, "holds no transform");
	if (!a || !key)
		return error_set(e, ENOMEM, "out of memory");
	*a = (struct animation){count, key};
	for (const struct xml_element *c = animation->first_child; c && !r; c = c->next_sibling, key++) {
		r = read_keyframe(c, count > 1, key, e);
		if (!r && count > 1)
			r = check_decomposable(c, key, e);
		if (!r && key > a->key)
			r = check_interval(c, key - 1, key, e);
		is_moving |= key > a->key && memcmp(&key->transform, &key[-1].transform, sizeof key->transform) != 0;
	}
	*el = animation->first_child;
	*out = is_moving && !r ? a : NULL;
	return r;
}

static bool is_in_shapegroup(const struct xml_element *el)
{
	for (; el; el = el->parent) {
		const char *type = xml_attribute_value(el, "type");
		if (type && strcmp(type, "shapegroup") == 0)
			return true;
	}
	return false;
}

const char *animation_unsupported_kind(const struct scene_node *n, const struct xml_element *el)
{
	return n->cls == PLUGIN_SHAPE && is_in_shapegroup(el) ? "a shape in a shapegroup" : NULL;
}
