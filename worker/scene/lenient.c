#include "worker/scene/lenient.h"

#include <string.h>

static bool is_one_of(const char *name, const char *const *list)
{
	for (; *list; list++)
		if (strcmp(name, *list) == 0)
			return true;
	return false;
}

enum lenient_way lenient_plugin(enum plugin_class cls, const char *type, const char **stand_in)
{
	static const char *const metals[] = {"ward", "measured", NULL};
	*stand_in = NULL;
	switch (cls) {
	case PLUGIN_BSDF:
		*stand_in = is_one_of(type, metals) ? "roughplastic" : "diffuse";
		return LENIENT_INNER;
	case PLUGIN_RFILTER:
		*stand_in = "gaussian"; /* filters with negative lobes are sharper */
		return LENIENT_REPLACE;
	case PLUGIN_SHAPE:
	case PLUGIN_EMITTER:
	case PLUGIN_TEXTURE:
	case PLUGIN_MEDIUM:
		return LENIENT_LEAVE_OUT;
	default:
		return LENIENT_REFUSE;
	}
}

const char *lenient_param(const char *stand_in, const char *name)
{
	static const char *const colors[] = {"base_color", "diffuse_reflectance", "color", "diffuse", "albedo", NULL};
	if (strcmp(stand_in, "diffuse") == 0 && is_one_of(name, colors))
		return "reflectance";
	return name;
}
