/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/scene/compatibility.h"

#include "worker/render/render.h"
#include "worker/render/scene/lenient.h"
#include "worker/render/scene/plugin.h"

#include <string.h>

static const char *const headings[PLUGIN_CLASSES] = {
	[PLUGIN_SHAPE] = "Shapes",     [PLUGIN_BSDF] = "Materials",	   [PLUGIN_TEXTURE] = "Textures",
	[PLUGIN_EMITTER] = "Emitters", [PLUGIN_SENSOR] = "Sensors",	   [PLUGIN_FILM] = "Films",
	[PLUGIN_RFILTER] = "Filters",  [PLUGIN_SAMPLER] = "Samplers",	   [PLUGIN_INTEGRATOR] = "Integrators",
	[PLUGIN_MEDIUM] = "Media",     [PLUGIN_PHASE] = "Phase functions", [PLUGIN_VOLUME] = "Volumes",
};

static void print_params(FILE *out, const struct plugin_decl *d, enum param_class status)
{
	const char *before = "";
	for (const struct param *p = d->params; p && p->name; p++)
		if (p->status == status) {
			fprintf(out, strcmp(p->name, "*") == 0 ? "%sall others" : "%s`%s`", before, p->name);
			before = ", ";
		}
}

static void print_supported(FILE *out, const struct plugin_decl *d)
{
	fprintf(out, strcmp(d->type, "*") == 0 ? "| any | " : "| `%s` | ", d->type);
	print_params(out, d, PARAM_UNDERSTOOD);
	fprintf(out, " | ");
	print_params(out, d, PARAM_IGNORED);
	fprintf(out, " | ");
	print_params(out, d, PARAM_DIFFERS);
	fprintf(out, " | ");
	print_params(out, d, PARAM_REFUSED);
	fprintf(out, " |\n");
}

static void print_class(FILE *out, enum plugin_class cls)
{
	bool any = false;
	for (const struct plugin_decl *d = render_plugins(); d->type; d++) {
		if (d->cls != cls)
			continue;
		if (!any)
			fprintf(out,
				"\n## %s\n\n| type | understood | ignored | differs | refused |\n|---|---|---|---|---|\n",
				headings[cls]);
		any = true;
		print_supported(out, d);
	}
}

static void print_stand_in(FILE *out, enum plugin_class cls, const char *type)
{
	const char *stand_in;
	fprintf(out, "| %s | `%s` | ", plugin_class_name(cls), type);
	switch (lenient_plugin(cls, type, &stand_in)) {
	case LENIENT_REFUSE:
		fprintf(out, "refused |\n");
		break;
	case LENIENT_LEAVE_OUT:
		fprintf(out, "nothing: it is left out |\n");
		break;
	case LENIENT_REPLACE:
		fprintf(out, "`%s` |\n", stand_in);
		break;
	case LENIENT_INNER:
		if (stand_in)
			fprintf(out, "the BSDF inside, else `%s` |\n", stand_in);
		else
			fprintf(out, "the %s inside |\n", plugin_class_name(cls));
		break;
	}
}

static void print_unsupported(FILE *out)
{
	const char *type;
	fprintf(out,
		"\n## Mitsuba's plug-ins that are not supported\n\n"
		"Refused, with file, line and the nearest name; with `--lenient` replaced. Light is unpolarised here, and\n"
		"what polarizes acts as in Mitsuba's unpolarized modes. Bump and normal maps of "
		"materials with a specular lobe or a mask do without\n`flip_invalid_normals`, which is on in Mitsuba since "
		"3.7.\n\n"
		"| class | type | with `--lenient` |\n|---|---|---|\n");
	enum plugin_class cls;
	for (size_t i = 0; (type = plugin_of_mitsuba(i, &cls)); i++) {
		const struct plugin_decl *d = plugin_find(render_plugins(), cls, type);
		if (!d || strcmp(d->type, "*") == 0)
			print_stand_in(out, cls, type);
	}
}

void compatibility_print(FILE *out)
{
	fprintf(out,
		"# What is supported of Mitsuba's scenes\n\n"
		"Written by `hslt-scene compatibility`, from the tables that the reader works by. Names are those of 3.x; 0.5/0.6 has "
		"them in camelCase.\n\n"
		"- *Understood*: has the same effect as in Mitsuba.\n"
		"- *Ignored*: has no effect on light; a note says so.\n"
		"- *Differs*: not supported; the image differs a little from Mitsuba's, and a warning says so.\n"
		"- *Refused*: would change the image.\n\n"
		"[worker/render/scene/README.md](../worker/render/scene/README.md) says how the plug-ins behave and where they "
		"differ,\n[tests/corpus/README.md](../tests/corpus/README.md) how many public scenes load.\n");
	for (int cls = 0; cls < PLUGIN_CLASSES; cls++)
		print_class(out, (enum plugin_class)cls);
	print_unsupported(out);
}
