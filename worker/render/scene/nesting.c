/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/nesting.h"

#include "worker/render/plugin/plugin.h"

int nesting_add(struct xml_nesting *owner, enum plugin_class cls, const struct xml_element *el,
		const struct xml_element *part, bool is_shared, struct error *e)
{
	bool is_evaluated = cls == PLUGIN_BSDF || cls == PLUGIN_TEXTURE || cls == PLUGIN_PHASE;
	uint64_t limit = is_evaluated ? NESTING_PARTS_MAX : NESTING_OBJECTS_MAX;
	/* Cannot overflow: both terms are within the limit. */
	uint64_t object_count = owner->object_count + (is_shared ? 0 : part->nesting.object_count);
	uint32_t height = part->nesting.height + 1;
	if (part->nesting.exceeds_limits || owner->exceeds_limits) {
		owner->exceeds_limits = true;
		return REPORT_ALREADY_REPORTED;
	}
	owner->exceeds_limits = height > NESTING_HEIGHT_MAX || object_count > limit;
	if (height > NESTING_HEIGHT_MAX)
		return xml_error(el, e, E2BIG, "objects are nested more than %d deep", NESTING_HEIGHT_MAX);
	if (object_count > limit)
		return xml_error(el, e, E2BIG, "makes a %s of more than %llu objects when all references are followed",
				 plugin_class_name(cls), (unsigned long long)limit);
	if (height > owner->height)
		owner->height = height;
	owner->object_count = object_count;
	return 0;
}

int nesting_add_to_scene(uint64_t *scene_object_count, struct xml_element *el, struct error *e)
{
	if (el->is_counted)
		return 0;
	el->is_counted = true;
	if (el->nesting.exceeds_limits || *scene_object_count > NESTING_OBJECTS_MAX)
		return REPORT_ALREADY_REPORTED;
	if (el->nesting.object_count > NESTING_OBJECTS_MAX - *scene_object_count) {
		*scene_object_count = NESTING_OBJECTS_MAX + 1;
		return xml_error(el, e, E2BIG,
				 "the scene has more than %d objects with this one, when all references are followed",
				 NESTING_OBJECTS_MAX);
	}
	*scene_object_count += el->nesting.object_count;
	return 0;
}
