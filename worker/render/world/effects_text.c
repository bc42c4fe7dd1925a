/* SPDX-License-Identifier: Apache-2.0 */
/* Names of effects, what omitting each saves, and the text with which a plan overrides them. */
#include "worker/render/world/effects_text.h"

#include "common/base/spelling.h"
#include "worker/render/world/effects.h"

#include <stdio.h>
#include <string.h>

enum { ON = EFFECT_MAY_FORCE_ON, OFF = EFFECT_MAY_FORCE_OFF, SCENE = EFFECT_MAY_FORCE_OFF | EFFECT_OF_THE_SCENE };

const struct effect_decl effect_table[EFFECTS] = {
	[EFFECT_COLOUR] = {"colour", ON, "no wavelengths are drawn, carried or stored; colours are plain numbers",
			   "a coloured scene has no grey values to replace its colours"},
	[EFFECT_WAVELENGTH] = {"wavelength", ON | OFF, "no proposals for the wavelength", NULL},
	[EFFECT_DISPERSION] =
		{"dispersion", ON | SCENE,
		 "four wavelengths travel together: 4x fewer paths for a colour; no walk and no derivatives when one changes",
		 NULL},
	[EFFECT_APERTURE] = {"aperture", ON | SCENE, "no lens mutation; no points on the aperture are drawn or moved",
			     NULL},
	[EFFECT_EMITTER_MOVE] = {"emitter-move", ON | OFF, "no mutation moves the point on the emitter", NULL},
	[EFFECT_HALF_VECTORS] = {"half-vectors", ON | OFF,
				 "no walks, no derivatives, no step sizes: paths are traced and joined", NULL},
	[EFFECT_SPECULAR] = {"specular", ON | SCENE,
			     "no exactly specular chains; without glossy lobes no half vectors either", NULL},
	[EFFECT_GLOSSY] = {"glossy", ON | SCENE, "no microfacets; without specular lobes no half vectors either", NULL},
	[EFFECT_DIFFUSE] = {"diffuse", ON | SCENE, "nothing: it costs only paths that meet such a surface", NULL},
	[EFFECT_TRANSMISSION] = {"transmission", ON | SCENE, "nothing: it costs only paths that meet such a surface",
				 NULL},
	[EFFECT_ABSORPTION] = {"absorption", ON | SCENE, "no medium and no exponential per edge", NULL},
	[EFFECT_SCATTERING] =
		{"scattering", OFF | EFFECT_OF_THE_SCENE,
		 "paths turn at surfaces only, no distances are drawn, and chains on half vectors can be chosen",
		 "what a medium scatters is the scene's"},
	[EFFECT_TEXTURES] = {"textures", ON, "colours are constants: no look-ups by (u,v)",
			     "without its textures a scene has no colours"},
	[EFFECT_DISPLACEMENT] = {"displacement", ON | SCENE, "no finer meshes are made: time and memory of building",
				 NULL},
	[EFFECT_BUMP] = {"bump", 0, "normals are the mesh's",
			 "bump and normal maps cost nothing where no material has one"},
	[EFFECT_ALPHA] = {"alpha", 0, "no opacity test per ray: one filter less in Embree", "masks are specular lobes"},
	[EFFECT_COINCIDENCE] = {"coincidence", 0, "no test per ray which of two surfaces is present",
				"surfaces coincide or they do not"},
	[EFFECT_INSTANCING] = {"instancing", 0, "no transforms between rays and meshes",
			       "instances share a mesh or they do not"},
	[EFFECT_MOTION] = {"motion", OFF | EFFECT_OF_THE_SCENE,
			   "no time is drawn or stored; everything is where it is when the shutter opens",
			   "what moves is the scene's"},
	[EFFECT_ENVIRONMENT] = {"environment", ON | SCENE, "rays that escape end there", NULL},
	[EFFECT_AREA_LIGHT] = {"area-light", ON | SCENE, "nothing: it costs only paths that end on one", NULL},
	[EFFECT_DELTA_LIGHT] = {"delta-light", ON | SCENE, "nothing: it costs only paths that end on one", NULL},
	[EFFECT_MEDIUM_LIGHT] = {"medium-light", OFF | EFFECT_OF_THE_SCENE,
				 "no light is collected along edges, and chains on half vectors can be chosen",
				 "what a medium emits is the scene's"},
	[EFFECT_DEPTH] = {"depth", ON, "longer paths are not tried", "--max-depth shortens paths"},
};

/* EFFECTS: unknown name. */
static enum effect find(const char *name, size_t length)
{
	int i = 0;
	while (i < EFFECTS &&
	       (strlen(effect_table[i].name) != length || memcmp(effect_table[i].name, name, length) != 0))
		i++;
	return (enum effect)i;
}

static int unknown(const char *name, size_t length, struct error *e)
{
	char wanted[64], hint[96], list[384] = "";
	snprintf(wanted, sizeof wanted, "%.*s", (int)length, name);
	struct spelling s = {.wanted = wanted};
	for (int i = 0; i < EFFECTS; i++) {
		spelling_offer(&s, effect_table[i].name);
		spelling_list(list, sizeof list, effect_table[i].name);
	}
	return error_set(e, EINVAL, "no effect is called '%s'%s; there are %s", wanted,
			 spelling_hint(&s, hint, sizeof hint), list);
}

static int parse_item(const char *item, size_t length, struct effects_choice *out, struct error *e)
{
	if (length == 3 && memcmp(item, "all", 3) == 0) {
		for (int i = 0; i < EFFECTS; i++)
			if ((effect_table[i].may & EFFECT_MAY_FORCE_ON) && !out->of[i])
				out->of[i] = 1;
		return 0;
	}
	if (length < 2 || (*item != '+' && *item != '-'))
		return error_set(e, EINVAL, "takes 'all', or +NAME and -NAME separated by commas, not '%.*s'",
				 (int)length, item);
	enum effect which = find(item + 1, length - 1);
	if (which == EFFECTS)
		return unknown(item + 1, length - 1, e);
	const struct effect_decl *d = &effect_table[which];
	bool on = *item == '+';
	if (!(d->may & (on ? EFFECT_MAY_FORCE_ON : EFFECT_MAY_FORCE_OFF)))
		return error_set(e, EINVAL, "%s cannot be forced %s: %s", d->name, on ? "on" : "off", d->refuse);
	out->of[which] = on ? 1 : -1;
	return 0;
}

int effects_parse(const char *text, struct effects_choice *out, struct error *e)
{
	*out = (struct effects_choice){.any_on = false};
	if (!*text)
		return 0;
	for (const char *at = text;; at++) {
		size_t n = strcspn(at, ",");
		int rc = parse_item(at, n, out, e);
		if (rc)
			return rc;
		at += n;
		if (!*at)
			break;
	}
	for (int i = 0; i < EFFECTS; i++)
		out->any_on |= out->of[i] > 0;
	return 0;
}

void effects_print(const struct effects_choice *c, char text[PLAN_EFFECTS_MAX])
{
	bool all = true;
	for (int i = 0; i < EFFECTS; i++)
		all &= c->of[i] != 0 || !(effect_table[i].may & EFFECT_MAY_FORCE_ON);
	all &= c->any_on;
	memset(text, 0, PLAN_EFFECTS_MAX);
	size_t used = (size_t)snprintf(text, PLAN_EFFECTS_MAX, "%s", all ? "all" : "");
	for (int i = 0; i < EFFECTS && used < PLAN_EFFECTS_MAX; i++)
		if (c->of[i] < 0 || (c->of[i] > 0 && !all))
			used += (size_t)snprintf(text + used, PLAN_EFFECTS_MAX - used, "%s%c%s", used ? "," : "",
						 c->of[i] < 0 ? '-' : '+', effect_table[i].name);
}

int render_effects(const char *text, char canonical[PLAN_EFFECTS_MAX], struct error *e)
{
	struct effects_choice c;
	int rc = effects_parse(text, &c, e);
	if (!rc)
		effects_print(&c, canonical);
	return rc;
}

void render_effects_note(const struct render_summary *scene, char *text, size_t size)
{
	size_t used = 0;
	*text = 0;
	for (size_t i = 0; i < scene->line_count && used < size; i++) {
		const struct effect_line *l = &scene->lines[i];
		if (l->other_scene)
			used += (size_t)snprintf(text + used, size - used, "%s%s",
						 used ? ", " : "the image is of another scene: without ", l->name);
	}
}

bool render_scene_note(const struct render_summary *scene, size_t i, char *text, size_t size)
{
	const struct render_coincident *c = &scene->coincident;
	render_effects_note(scene, text, size);
	if (*text && i-- == 0)
		return true;
	if (scene->settings.unplaced && i-- == 0) {
		snprintf(text, size,
			 "the scene has no <sensor>: as in Mitsuba, a camera in front of it looks along +z%s",
			 scene->brightest > 0 ? "" : "; it has no emitter either: the image is black");
		return true;
	}
	const char *const met[] = {scene->notes.unseen, scene->notes.dark, scene->notes.endless,  scene->notes.backs,
				   scene->notes.scales, scene->notes.flat, scene->notes.materials};
	for (size_t k = 0; k < sizeof met / sizeof *met; k++)
		if (*met[k] && i-- == 0) {
			snprintf(text, size, "%s", met[k]);
			return true;
		}
	if (i < c->count) {
		snprintf(text, size, "%s", c->text[i]);
		return true;
	}
	i -= c->count;
	if (c->total > c->count && i-- == 0) {
		snprintf(text, size, "%zu more pairs of shapes coincide", c->total - c->count);
		return true;
	}
	snprintf(text, size,
		 "more surfaces coincide than were searched for: of the others, it is undefined which one a ray hits");
	return c->incomplete && i == 0;
}

bool render_effect_on(const struct render_summary *scene, const char *name)
{
	for (size_t i = 0; i < scene->line_count; i++)
		if (strcmp(scene->lines[i].name, name) == 0)
			return scene->lines[i].on;
	return false;
}
