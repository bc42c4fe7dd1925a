/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Prints the page docs/compatibility.md. One function prints each part, from a table by which the reader of scenes
 * works: plug-ins by class, the images of integrators, elements of values, kinds of spectra, names of older versions,
 * and the replacements of --lenient. The page therefore cannot disagree with the reader.
 *
 * Only writing to the stream can fail; the caller checks that.
 */
#include "worker/cli/scene/compatibility.h"

#include "worker/render/render.h"
#include "worker/render/scene/depth.h"
#include "worker/render/scene/integrators.h"
#include "worker/render/scene/lenient.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/scene/spectral.h"
#include "worker/render/scene/subsurface.h"
#include "worker/render/xml/upgrade.h"
#include "worker/render/scene/value.h"

#include <string.h>

static const char *const headings[PLUGIN_CLASSES] = {
	[PLUGIN_SHAPE] = "Shapes",     [PLUGIN_BSDF] = "Materials",	   [PLUGIN_TEXTURE] = "Textures",
	[PLUGIN_EMITTER] = "Emitters", [PLUGIN_SENSOR] = "Sensors",	   [PLUGIN_FILM] = "Films",
	[PLUGIN_RFILTER] = "Filters",  [PLUGIN_SAMPLER] = "Samplers",	   [PLUGIN_INTEGRATOR] = "Integrators",
	[PLUGIN_MEDIUM] = "Media",     [PLUGIN_PHASE] = "Phase functions", [PLUGIN_VOLUME] = "Volumes",
};

static void print_params(FILE *out, const struct plugin_decl *d, enum param_status status)
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

static bool shows_same_light(const struct integrator_image *a, const struct integrator_image *b)
{
	return a->shows_other == b->shows_other && a->is_direct == b->is_direct && a->is_prb == b->is_prb &&
	       a->lacks_media == b->lacks_media;
}

static void print_image(FILE *out, const struct integrator_image *image)
{
	if (image->shows_other)
		fprintf(out, "all light, or that of the integrator inside, with a note");
	else if (image->is_direct)
		fprintf(out, "light that is scattered once, with a note");
	else
		fprintf(out, "all light");
	if (image->is_prb)
		fprintf(out, ", by paths of %d edges if there is no `max_depth`", SCENE_PRB_DEPTH);
	fprintf(out, image->lacks_media ? "; no media without `--set media=shown`, with a note |\n" : " |\n");
}

/* Prints a table of the light that the image shows for each integrator of a scene, with one row for all integrators
 * that show the same. Their parameters are those of the type "any" in the table before. */
static void print_integrators(FILE *out)
{
	struct integrator_image image, other;
	const char *type;
	fprintf(out, "\n`--integrator` chooses how light is found; the scene's own says which light:\n\n"
		     "| type | the image shows |\n|---|---|\n");
	for (size_t i = 0; integrator_type_at(i, &image); i++) {
		size_t first = 0;
		while (integrator_type_at(first, &other) && !shows_same_light(&image, &other))
			first++;
		if (first < i)
			continue;
		const char *before = "| ";
		for (size_t k = i; (type = integrator_type_at(k, &other)); k++)
			if (shows_same_light(&image, &other)) {
				fprintf(out, "%s`%s`", before, type);
				before = ", ";
			}
		fprintf(out, " | ");
		print_image(out, &image);
	}
	fprintf(out, "| any other | all light, with a note |\n");
}

static void print_samplers(FILE *out)
{
	enum plugin_class cls;
	const char *type, *before = "\nAny sampler is accepted, and samples are independent; Mitsuba's are ";
	for (size_t i = 0; (type = plugin_mitsuba_at(i, &cls)); i++)
		if (cls == PLUGIN_SAMPLER) {
			fprintf(out, "%s`%s`", before, type);
			before = ", ";
		}
	fprintf(out, ".\n");
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
	if (cls == PLUGIN_INTEGRATOR)
		print_integrators(out);
	else if (cls == PLUGIN_SAMPLER)
		print_samplers(out);
}

/* Prints the list "a|b|c" as `a`, `b`, `c`. */
static void print_names(FILE *out, const char *list)
{
	char name[64];
	const char *before = "";
	while ((list = element_next_name(list, name, sizeof name))) {
		fprintf(out, "%s`%s`", before, name);
		before = ", ";
	}
}

static void print_values(FILE *out)
{
	const char *name, *holds;
	fprintf(out, "\n## Values, colours and spectra\n\n| element | attributes |\n|---|---|\n");
	for (size_t i = 0; (name = value_element_at(i, &holds)); i++) {
		fprintf(out, "| `<%s>` | ", name);
		print_names(out, holds);
		fprintf(out, " |\n");
	}
	fprintf(out, "\n| `<spectrum>` with | holds |\n|---|---|\n");
	for (size_t i = 0; (name = spectral_form_at(i, &holds)); i++)
		fprintf(out, "| `%s` | %s |\n", name, holds);
	fprintf(out,
		"\nOther types are refused, with the nearest name.\n\n| `<spectrum type>` | understood |\n|---|---|\n");
	for (size_t i = 0; (name = spectral_type_at(i, &holds)); i++) {
		fprintf(out, "| `%s` | ", name);
		print_names(out, holds);
		fprintf(out, " |\n");
	}
}

static void print_subsurfaces(FILE *out)
{
	const char *type, *becomes;
	fprintf(out, "\n## Subsurface scattering of 0.6\n\nRefused; media inside shapes are supported.\n\n"
		     "| `<subsurface type>` | with `--lenient` |\n|---|---|\n");
	for (size_t i = 0; (type = subsurface_model_at(i, &becomes)); i++)
		fprintf(out, "| `%s` | %s |\n", type, becomes);
}

static void print_renamed(FILE *out, const struct renamed_name *n, const char *versions)
{
	if (!n->element)
		fprintf(out, "| `<%s>` | `<%s>` | %s |\n", n->old, n->current, versions);
	else if (!n->is_parameter)
		fprintf(out, "| %s `%s` | `%s` | %s |\n", n->element, n->old, n->current, versions);
	else if (n->type)
		fprintf(out, "| `%s` of the %s `%s` | `%s` | %s |\n", n->old, n->element, n->type, n->current,
			versions);
	else
		fprintf(out, "| `%s` of each %s | `%s` | %s |\n", n->old, n->element, n->current, versions);
}

static void print_other_names(FILE *out)
{
	struct renamed_name n;
	char versions[32];
	fprintf(out, "\n## Other names\n\nThose of older versions, read as the ones of today.\n\n"
		     "| name | read as | in files of |\n|---|---|---|\n");
	for (size_t i = 0; upgrade_rename_at(i, &n); i++) {
		snprintf(versions, sizeof versions, "before 0.%d", n.dropped_in_minor);

		print_renamed(out, &n, n.dropped_in_minor ? versions : "2.x and 3.x");
	}
	for (size_t i = 0; plugin_renamed_param(i, &n); i++)
		print_renamed(out, &n, "0.5 and 0.6");
}

static void print_stand_in(FILE *out, enum plugin_class cls, const char *type)
{
	const char *stand_in;
	fprintf(out, "| %s | `%s` | ", plugin_class_name(cls), type);
	switch (lenient_plugin_action(cls, type, &stand_in)) {
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
		"materials with a specular lobe or a mask,\nand maps inside others, do without `flip_invalid_normals`, "
		"which is on in Mitsuba since 3.7.\n\n"
		"| class | type | with `--lenient` |\n|---|---|---|\n");
	enum plugin_class cls;
	for (size_t i = 0; (type = plugin_mitsuba_at(i, &cls)); i++) {
		const struct plugin_decl *d = plugin_find(render_plugins(), cls, type);
		if (!d)
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
	print_values(out);
	print_subsurfaces(out);
	print_other_names(out);
	print_unsupported(out);
}
