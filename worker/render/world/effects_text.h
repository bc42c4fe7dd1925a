/* SPDX-License-Identifier: Apache-2.0 */
/* Effects as text: what overrides them, and what is to be said of them. Pure; any thread; nothing allocates. */
#ifndef WORKER_RENDER_WORLD_EFFECTS_TEXT_H
#define WORKER_RENDER_WORLD_EFFECTS_TEXT_H

#include "worker/render/world/summary.h"

struct effects_choice;

/* The overrides of effects, in the spelling that a plan holds: "all", "-dispersion,+aperture". -EINVAL with a sentence:
 * no such effect, or it cannot be forced. */
int render_effects(const char *text, char canonical[PLAN_EFFECTS_MAX], struct error *e);
/* "the image is of another scene: without dispersion" where an effect that the scene calls for was switched off; else
 * "". */
void render_effects_note(const struct render_summary *scene, char *text, size_t size);
/* The i-th of the sentences about the scene as a whole: the note on effects, scales, surfaces that coincide;
 * false: there are no more. */
bool render_scene_note(const struct render_summary *scene, size_t i, char *text, size_t size);
/* false also where there is no effect of that name. */
bool render_effect_on(const struct render_summary *scene, const char *name);

/* "", "all", "-dispersion,+aperture", "all,-glossy". -EINVAL with a sentence, which names the nearest where a name is
 * none. */
int effects_parse(const char *text, struct effects_choice *out, struct error *e);
/* The same choice always as the same text. */
void effects_print(const struct effects_choice *c, char text[PLAN_EFFECTS_MAX]);

#endif
