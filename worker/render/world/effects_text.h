/* SPDX-License-Identifier: Apache-2.0 */
/* Effects as text: overrides and notes. Pure; any thread; allocates nothing. */
#ifndef WORKER_RENDER_WORLD_EFFECTS_TEXT_H
#define WORKER_RENDER_WORLD_EFFECTS_TEXT_H

#include "worker/render/world/summary.h"

struct effects_choice;

/* The overrides of effects as stored in a plan: "all", "-dispersion,+aperture". -EINVAL with a sentence: an unknown
 * effect, or one that cannot be forced. */
int render_effects(const char *text, char canonical[PLAN_EFFECTS_MAX], struct error *e);
/* "the image is of another scene: without dispersion" if an effect that the scene needs was switched off; otherwise
 * "". */
void render_effects_note(const struct render_summary *scene, char *text, size_t size);
/* The i-th note about the scene as a whole: effects, scales, coinciding surfaces; false: no more. */
bool render_scene_note(const struct render_summary *scene, size_t i, char *text, size_t size);
/* false also for an unknown effect. */
bool render_effect_on(const struct render_summary *scene, const char *name);

/* "", "all", "-dispersion,+aperture", "all,-glossy". -EINVAL with a sentence, with the nearest name if one is
 * unknown. */
int effects_parse(const char *text, struct effects_choice *out, struct error *e);
/* Equal choices give equal texts. */
void effects_print(const struct effects_choice *c, char text[PLAN_EFFECTS_MAX]);

#endif
