/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The text by which a plan overrides effects, and the notes about the effects of a scene.
 *
 * Only parsing fails, with -EINVAL: for an unknown effect (the message suggests the nearest name), an effect that
 * cannot be forced, or text that is not a list of signed names.
 */
#include "worker/render/world/effects_text.h"

#include "common/base/spelling.h"
#include "common/base/text.h"
#include "worker/render/world/effects.h"

#include <stdio.h>
#include <string.h>

/* Returns the effect of that name; EFFECTS if it is unknown. */
static enum effect find_effect(const char *name, size_t length)
{
	int i = 0;
	while (i < EFFECTS &&
	       (strlen(effect_table[i].name) != length || memcmp(effect_table[i].name, name, length) != 0))
		i++;
	return (enum effect)i;
}

static int refuse_unknown(const char *name, size_t length, struct error *e)
{
	char wanted[64], hint[96], list[384] = "";
	snprintf(wanted, sizeof wanted, "%.*s", (int)length, name);
	struct spelling s = {.wanted_name = wanted};
	for (int i = 0; i < EFFECTS; i++) {
		spelling_offer(&s, effect_table[i].name);
		spelling_append_to_list(list, sizeof list, effect_table[i].name);
	}
	return error_set(e, EINVAL, "no effect is called '%s'%s; there are %s", wanted,
			 spelling_hint(&s, hint, sizeof hint), list);
}

static int parse_item(const char *item, size_t length, struct effects_override *out, struct error *e)
{
	if (length == 3 && memcmp(item, "all", 3) == 0) {
		for (int i = 0; i < EFFECTS; i++)
			if ((effect_table[i].override_flags & EFFECT_MAY_FORCE_ON) && !out->states[i])
				out->states[i] = 1;
		return 0;
	}
	if (length < 2 || (*item != '+' && *item != '-')) {
		char wanted[64], hint[96] = "";
		snprintf(wanted, sizeof wanted, "%.*s", (int)length, item);
		struct spelling s = {.wanted_name = wanted};
		for (int i = 0; i < EFFECTS; i++)
			spelling_offer(&s, effect_table[i].name);
		spelling_offer(&s, "all");
		if (s.best_match && strcmp(s.best_match, "all") == 0)
			spelling_hint(&s, hint, sizeof hint);
		else if (s.best_match)
			snprintf(hint, sizeof hint, "; did you mean `+%s` or `-%s`?", s.best_match, s.best_match);
		return error_set(e, EINVAL, "takes 'all', or +NAME and -NAME separated by commas, not '%s'%s", wanted,
				 hint);
	}
	enum effect which = find_effect(item + 1, length - 1);
	if (which == EFFECTS)
		return refuse_unknown(item + 1, length - 1, e);
	const struct effect_decl *d = &effect_table[which];
	bool is_on = *item == '+';
	if (!(d->override_flags & (is_on ? EFFECT_MAY_FORCE_ON : EFFECT_MAY_FORCE_OFF)))
		return error_set(e, EINVAL, "%s cannot be forced %s: %s", d->name, is_on ? "on" : "off", d->refusal);
	out->states[which] = is_on ? 1 : -1;
	return 0;
}

int effects_parse(const char *text, struct effects_override *out, struct error *e)
{
	*out = (struct effects_override){.forces_any_on = false};
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
		out->forces_any_on |= out->states[i] > 0;
	return 0;
}

void effects_print(const struct effects_override *c, char text[PLAN_EFFECTS_MAX])
{
	bool is_all = true;
	for (int i = 0; i < EFFECTS; i++)
		is_all &= c->states[i] != 0 || !(effect_table[i].override_flags & EFFECT_MAY_FORCE_ON);
	is_all &= c->forces_any_on;
	struct text t = {text, PLAN_EFFECTS_MAX};
	memset(text, 0, PLAN_EFFECTS_MAX);
	text_appendf(&t, "%s", is_all ? "all" : "");
	for (int i = 0; i < EFFECTS; i++)
		if (c->states[i] < 0 || (c->states[i] > 0 && !is_all))
			text_appendf(&t, "%s%c%s", *text ? "," : "", c->states[i] < 0 ? '-' : '+',
				     effect_table[i].name);
}

int render_canonical_effects(const char *text, char canonical[PLAN_EFFECTS_MAX], struct error *e)
{
	struct effects_override c;
	int rc = effects_parse(text, &c, e);
	if (!rc)
		effects_print(&c, canonical);
	return rc;
}

void render_other_scene_note(const struct render_summary *scene, char *text, size_t size)
{
	struct text t = {text, size};
	*text = 0;
	for (size_t i = 0; i < scene->effect_line_count; i++)
		if (scene->effect_lines[i].changes_scene)
			text_appendf(&t, "%s%s", *text ? ", " : "the image is of another scene: without ",
				     scene->effect_lines[i].name);
}

bool render_scene_note(const struct render_summary *scene, size_t i, char *text, size_t size)
{
	const struct coincidence_notes *c = &scene->coincidence_notes;
	render_other_scene_note(scene, text, size);
	if (*text && i-- == 0)
		return true;
	if (scene->settings.is_unplaced && i-- == 0) {
		snprintf(text, size,
			 "the scene has no <sensor>: as in Mitsuba, a camera in front of it looks along +z%s",
			 scene->brightness_bound > 0 ? "" : "; it has no emitter either: the image is black");
		return true;
	}
	const char *const notes[] = {
		scene->notes.nothing_visible, scene->notes.negative_pixels, scene->notes.no_light,
		scene->notes.endless_medium,  scene->notes.black_backs,	    scene->notes.small_shape,
		scene->notes.flat_triangles,  scene->notes.bad_normals,	    scene->notes.near_camera,
		scene->notes.empty_meshes,    scene->notes.tiny_shapes,	    scene->notes.unread_materials};
	for (size_t k = 0; k < sizeof notes / sizeof *notes; k++)
		if (*notes[k] && i-- == 0) {
			snprintf(text, size, "%s", notes[k]);
			return true;
		}
	if (i < c->count) {
		snprintf(text, size, "%s", c->text[i]);
		return true;
	}
	i -= c->count;
	if (c->pair_count > c->count && i-- == 0) {
		snprintf(text, size, "%zu more pairs of shapes coincide", c->pair_count - c->count);
		return true;
	}
	snprintf(
		text, size,
		"the search for coinciding surfaces stopped at its limit: where others coincide, it is undefined which one a ray hits");
	return c->is_incomplete && i == 0;
}

bool render_effect_is_on(const struct render_summary *scene, const char *name)
{
	for (size_t i = 0; i < scene->effect_line_count; i++)
		if (strcmp(scene->effect_lines[i].name, name) == 0)
			return scene->effect_lines[i].is_on;
	return false;
}
