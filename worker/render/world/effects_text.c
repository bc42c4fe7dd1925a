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
static enum effect find(const char *name, size_t length)
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
	if (length < 2 || (*item != '+' && *item != '-')) {
		char wanted[64], hint[96] = "";
		snprintf(wanted, sizeof wanted, "%.*s", (int)length, item);
		struct spelling s = {.wanted = wanted};
		for (int i = 0; i < EFFECTS; i++)
			spelling_offer(&s, effect_table[i].name);
		spelling_offer(&s, "all");
		if (s.best && strcmp(s.best, "all") == 0)
			spelling_hint(&s, hint, sizeof hint);
		else if (s.best)
			snprintf(hint, sizeof hint, "; did you mean `+%s` or `-%s`?", s.best, s.best);
		return error_set(e, EINVAL, "takes 'all', or +NAME and -NAME separated by commas, not '%s'%s", wanted,
				 hint);
	}
	enum effect which = find(item + 1, length - 1);
	if (which == EFFECTS)
		return refuse_unknown(item + 1, length - 1, e);
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
	struct text t = {text, PLAN_EFFECTS_MAX};
	memset(text, 0, PLAN_EFFECTS_MAX);
	text_put(&t, "%s", all ? "all" : "");
	for (int i = 0; i < EFFECTS; i++)
		if (c->of[i] < 0 || (c->of[i] > 0 && !all))
			text_put(&t, "%s%c%s", *text ? "," : "", c->of[i] < 0 ? '-' : '+', effect_table[i].name);
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
	struct text t = {text, size};
	*text = 0;
	for (size_t i = 0; i < scene->line_count; i++)
		if (scene->lines[i].other_scene)
			text_put(&t, "%s%s", *text ? ", " : "the image is of another scene: without ",
				 scene->lines[i].name);
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
	const char *const met[] = {scene->notes.unseen,	 scene->notes.negative, scene->notes.dark,
				   scene->notes.endless, scene->notes.backs,	scene->notes.scales,
				   scene->notes.flat,	 scene->notes.normals,	scene->notes.close,
				   scene->notes.without, scene->notes.gone,	scene->notes.materials};
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
	snprintf(
		text, size,
		"the search for coinciding surfaces stopped at its limit: where others coincide, it is undefined which one a ray hits");
	return c->incomplete && i == 0;
}

bool render_effect_on(const struct render_summary *scene, const char *name)
{
	for (size_t i = 0; i < scene->line_count; i++)
		if (strcmp(scene->lines[i].name, name) == 0)
			return scene->lines[i].on;
	return false;
}
