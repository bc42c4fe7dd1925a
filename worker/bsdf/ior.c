#include "worker/bsdf/ior.h"

#include <strings.h>

/* Glasses and crystals: value at 587.6 nm of the Sellmeier equations that their makers and Malitson, Peter, Daimon
 * published; liquids and gases: handbook values at room temperature. */
static const struct {
	const char *name;
	double n;
} named[] = {
	{"vacuum", 1.0},	  {"helium", 1.000036},	     {"hydrogen", 1.000132},   {"air", 1.000277},
	{"carbon dioxide", 1.00045}, {"water", 1.33340},     {"acetone", 1.36},	       {"ethanol", 1.361},
	{"carbon tetrachloride", 1.461}, {"glycerol", 1.4729}, {"benzene", 1.501},     {"silicone oil", 1.52045},
	{"bromine", 1.661},	  {"water ice", 1.31},	     {"fused quartz", 1.45846}, {"pyrex", 1.470},
	{"acrylic glass", 1.49},  {"polypropylene", 1.49},   {"bk7", 1.51680},	       {"sodium chloride", 1.544},
	{"amber", 1.55},	  {"pet", 1.5750},	     {"diamond", 2.41748},     {"sf11", 1.78471},
	{"sapphire (o)", 1.76817},
};

int ior_read(const struct scene_node *n, const char *name, double fallback, double *out, struct error *e)
{
	const struct property *p = node_find(n, name);
	if (p && p->value.type == VALUE_STRING) {
		for (size_t i = 0; i < sizeof named / sizeof *named; i++)
			if (strcasecmp(named[i].name, p->value.as.string) == 0) {
				*out = named[i].n;
				return 0;
			}
		return node_error(n, e, ENOTSUP, "%s: no material \"%s\" is known; a number will do", name, p->value.as.string);
	}
	double x = node_float(n, name, fallback);
	if (!(x > 0) || !isfinite(x))
		return node_error(n, e, EINVAL, "%s = %g: an index of refraction must be above 0", name, x);
	*out = x;
	return 0;
}
