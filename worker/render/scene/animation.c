/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/animation.h"

#include "worker/render/text/number.h"
#include "worker/render/scene/transform.h"

#include <string.h>

/* Keeps differences between times, and times in units of the shutter's, finite. */
#define TIME_MAX 1e30
/* Smallest size of a transform, and how much more it may stretch in one direction than in another. */
#define LEAST_SIZE 1e-60
#define UNEVEN 1e12

static int read_keyframe(const struct xml_element *el, bool timed, struct keyframe *out, struct error *e)
{
	if (strcmp(el->name, "transform") != 0)
		return xml_error(el, e, EINVAL, "has no place in <animation>, which holds transforms");
	const char *time = xml_attribute(el, "time");
	int r = element_check(el, "name|time", true, e);
	if (!r)
		r = transform_read(el, &out->place, e);
	if (!r && timed && (!time || !number_parse(time, &out->time)))
		r = xml_error(el, e, EINVAL, "needs a time, a (finite) number");
	if (!r && !(fabs(out->time) <= TIME_MAX))
		r = xml_error(el, e, ERANGE, "time=%g is outside [%g, %g]", out->time, -TIME_MAX, TIME_MAX);
	return r;
}

static double largest_element(const mat4 *m)
{
	double most = 0;
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			most = fmax(most, fabs(m->m[i][k]));
	return most;
}

/* Checks that the transform can be decomposed into a rotation and a remainder, whose squares and determinant can be
 * represented. */
static int check_even(const struct xml_element *el, const struct keyframe *key, struct error *e)
{
	mat4 inverse;
	double size = largest_element(&key->place);
	if (!mat4_invert(key->place, &inverse))
		return xml_error(el, e, EINVAL, "flattens the object (it has no inverse)");
	if (!(size >= LEAST_SIZE) || !(size * largest_element(&inverse) <= UNEVEN))
		return xml_error(
			el, e, ERANGE,
			"makes the object too small, or stretches it more than %g times as far in one direction as in another",
			UNEVEN);
	return 0;
}

/* Checks that there is a motion from one keyframe to the next. */
static int check_step(const struct xml_element *el, const struct keyframe *from, const struct keyframe *to,
		      struct error *e)
{
	if (!(to->time > from->time))
		return xml_error(el, e, EINVAL, "time=%g is not after the time of the transform before, %g", to->time,
				 from->time);
	if ((mat4_det3(from->place) < 0) != (mat4_det3(to->place) < 0))
		return xml_error(el, e, EINVAL,
				 "either this transform or the one before mirrors the object, but not both");
	return 0;
}

int animation_read(const struct xml_element **el, struct arena *arena, const struct animation **out, struct error *e)
{
	const struct xml_element *animation = *el;
	int r = element_check(animation, "name", true, e);
	uint32_t count = 0;
	for (const struct xml_element *c = animation->first; c; c = c->next)
		count++;
	struct animation *a = arena_alloc(arena, 1, sizeof *a);
	struct keyframe *key = arena_alloc(arena, count, sizeof *key);
	bool moves = false;
	*out = NULL;
	if (r)
		return r;
	if (!count)
		return xml_error(animation, e, EINVAL, "holds no transform");
	if (!a || !key)
		return error_set(e, ENOMEM, "out of memory");
	*a = (struct animation){count, key};
	for (const struct xml_element *c = animation->first; c && !r; c = c->next, key++) {
		r = read_keyframe(c, count > 1, key, e);
		if (!r && count > 1)
			r = check_even(c, key, e);
		if (!r && key > a->key)
			r = check_step(c, key - 1, key, e);
		moves |= key > a->key && memcmp(&key->place, &key[-1].place, sizeof key->place) != 0;
	}
	*el = animation->first;
	*out = moves && !r ? a : NULL;
	return r;
}

static bool is_in_group(const struct xml_element *el)
{
	for (; el; el = el->parent) {
		const char *type = xml_attribute(el, "type");
		if (type && strcmp(type, "shapegroup") == 0)
			return true;
	}
	return false;
}

const char *animation_refused(const struct scene_node *n, const struct xml_element *el)
{
	return n->cls == PLUGIN_SHAPE && is_in_group(el) ? "a shape in a shapegroup" : NULL;
}
