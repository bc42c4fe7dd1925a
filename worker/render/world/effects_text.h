/* SPDX-License-Identifier: Apache-2.0 */
/* Effects as text: overrides and notes. Pure; any thread; allocates nothing. */
#ifndef WORKER_RENDER_WORLD_EFFECTS_TEXT_H
#define WORKER_RENDER_WORLD_EFFECTS_TEXT_H

#include "worker/render/world/summary.h"

struct effects_override;

/* Parses overrides of effects and writes them in canonical form, as stored in a plan: "all", "-dispersion,+aperture".
 * Returns -EINVAL and an error message for an unknown effect or one that cannot be forced. */
int render_canonical_effects(const char *text, char canonical[PLAN_EFFECTS_MAX], struct error *e);
/* Writes "the image is of another scene: without dispersion" if an effect that the scene needs was
 * switched off; otherwise "". */
void render_other_scene_note(const struct render_summary *scene, char *text, size_t size);
/* Writes the i-th note about the scene as a whole: effects, scales, coinciding surfaces.
 * Returns false if there is none. */
bool render_scene_note(const struct render_summary *scene, size_t i, char *text, size_t size);
/* Whether an effect is on; false for an unknown effect. */
bool render_effect_is_on(const struct render_summary *scene, const char *name);

/* Parses "", "all", "-dispersion,+aperture" or "all,-glossy". Returns -EINVAL and an error message, which suggests the
 * nearest name if one is unknown. */
int effects_parse(const char *text, struct effects_override *out, struct error *e);
/* Writes a choice as text; equal choices give equal texts. */
void effects_print(const struct effects_override *c, char text[PLAN_EFFECTS_MAX]);

#endif
