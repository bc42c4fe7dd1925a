/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/nesting.h"

#include "worker/render/plugin/plugin.h"

int nesting_take(struct xml_nesting *owner, enum plugin_class cls, const struct xml_element *el,
		 const struct xml_element *taken, bool once, struct error *e)
{
	bool evaluated = cls == PLUGIN_BSDF || cls == PLUGIN_TEXTURE || cls == PLUGIN_PHASE;
	uint64_t limit = evaluated ? NESTING_PARTS_MAX : NESTING_OBJECTS_MAX;
	/* Cannot overflow: both terms are within the limit. */
	uint64_t objects = owner->objects + (once ? 0 : taken->nesting.objects);
	uint32_t height = taken->nesting.height + 1;
	if (taken->nesting.beyond || owner->beyond) {
		owner->beyond = true;
		return REPORT_TOLD;
	}
	owner->beyond = height > NESTING_HEIGHT_MAX || objects > limit;
	if (height > NESTING_HEIGHT_MAX)
		return xml_error(el, e, E2BIG, "objects are nested more than %d deep", NESTING_HEIGHT_MAX);
	if (objects > limit)
		return xml_error(el, e, E2BIG, "makes a %s of more than %llu objects when all references are followed",
				 plugin_class_name(cls), (unsigned long long)limit);
	if (height > owner->height)
		owner->height = height;
	owner->objects = objects;
	return 0;
}

int nesting_count(uint64_t *objects, struct xml_element *el, struct error *e)
{
	if (el->counted)
		return 0;
	el->counted = true;
	if (el->nesting.beyond || *objects > NESTING_OBJECTS_MAX)
		return REPORT_TOLD;
	if (el->nesting.objects > NESTING_OBJECTS_MAX - *objects) {
		*objects = NESTING_OBJECTS_MAX + 1;
		return xml_error(el, e, E2BIG,
				 "the scene has more than %d objects with this one, when all references are followed",
				 NESTING_OBJECTS_MAX);
	}
	*objects += el->nesting.objects;
	return 0;
}
