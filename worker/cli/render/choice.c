/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/render/choice.h"

#include "common/base/clock.h"
#include "common/json/estimate_json.h"
#include "worker/render/count_rays.h"
#include "worker/render/unseen_light.h"

#include <stdio.h>

static int choose_integrator(const struct world *w, struct render_arguments *a, struct choice *out, struct error *e)
{
	double begin = clock_seconds();
	int rc = render_choose(w, &a->plan, &out->result, e);
	out->seconds = clock_seconds() - begin;
	if (!rc)
		render_choice_text(a->plan.integrator, &out->result, out->summary, sizeof out->summary);
	return rc;
}

int choice_in_world(const struct world *w, struct render_arguments *a, struct choice *out, struct error *e)
{
	*out = (struct choice){.is_made = integrator_is_undecided(&a->plan)};
	int rc = out->is_made ? choose_integrator(w, a, out, e) : 0;
	if (!rc)
		rc = render_unseen_light(w, &a->plan, e);
	return !rc && plan_needs_ray_count(&a->plan) ? render_count_rays(w, &a->plan, &a->plan.rays, e) : rc;
}

int choice_make(struct render_arguments *a, const char *folder, const char *name, struct choice *out, struct error *e)
{
	struct scene scene;
	struct world *w;
	*out = (struct choice){.is_made = false};
	struct asset_folders folders = option_folders(a, folder);
	struct asset_source assets = asset_source_for_folders(&folders);
	int rc = option_scene_read(&scene, &assets, name, a, e);
	if (rc)
		return rc;
	rc = world_new(&w, &scene, &assets, &a->render, e);
	scene_fini(&scene);
	if (!rc) {
		rc = choice_in_world(w, a, out, e);
		world_free(w);
	}
	return rc;
}

void choice_print(const struct choice *c, const char *integrator)
{
	if (c->is_made)
		fprintf(stderr, "integrator %s, chosen by a pilot of %.1f s; hslt-render --explain says why\n",
			integrator, c->seconds);
}

static json_t *found_to_json(const struct render_measurement *f)
{
	return json_pack("{s:o s:o s:o s:o s:o s:o}", "rareShare", json_real_or_null(f->rare_share), "tailIndex",
			 json_real_or_null(f->tail_index), "extremeTailIndex", json_real_or_null(f->extreme_tail_index),
			 "extremeValueIndex", json_real_or_null(f->extreme_value_index), "largestShare",
			 json_real_or_null(f->largest_share), "varianceTimesRays", json_real_or_null(f->cost));
}

static json_t *considered_to_json(void)
{
#define AFTER_A_COMMA(name) , name
	static const char *const names[] = {RENDER_CHOICES(RENDER_CHOICES_FIRST, AFTER_A_COMMA),
					    RENDER_INTEGRATOR_CHAINS};
	json_t *list = json_array();
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		json_array_append_new(list, json_string(names[i]));
	return list;
}

json_t *choice_to_json(const struct choice *c)
{
	if (!c->is_made)
		return json_null();
	const struct render_choice *f = &c->result;
	return json_pack("{s:s s:o s:I s:f s:b s:b s:b s:f s:f s:o s:o}", "why", c->summary, "considered",
			 considered_to_json(), "pilotSamples", (json_int_t)f->sample_count, "pilotSeconds", c->seconds,
			 "pathMissesLight", (int)f->path_misses_light, "surfacesFocusLight", (int)f->has_narrow_lobes,
			 "surfacesRefract", (int)f->has_transmission, "mergedRareShare", f->merging.rare_share,
			 "shareFoundByPath", f->found_fraction, "path", found_to_json(&f->path), "bdpt",
			 f->is_settled ? json_null() : found_to_json(&f->bdpt));
}
