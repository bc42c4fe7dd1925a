/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/render/stats.h"

#include "common/json/estimate_json.h"
#include "common/exr/image_file.h"
#include "common/estimate/stated_error.h"
#include "common/estimate/strategy.h"

#include <stdlib.h>
#include <string.h>

static const char *const counter_names[BATCH_COUNTERS] = {
	[COUNT_SAMPLES] = "samples",
	[COUNT_ACCEPTED] = "accepted",
	[COUNT_INDEPENDENT] = "independent",
	[COUNT_NAN] = "nan",
	[COUNT_INFINITE] = "infinite",
	[COUNT_NEGATIVE] = "negative",
	[COUNT_RAYS_CLOSEST] = "raysClosest",
	[COUNT_RAYS_SHADOW] = "raysShadow",
	[COUNT_STUCK] = "stuck",
	[COUNT_LONGEST_STUCK] = "longestStuck",
	[COUNT_STATES_LOST] = "statesLost",
	[COUNT_REDISTRIBUTED] = "spread",
	[COUNT_REDISTRIBUTION_MUTATIONS] = "spreadMutations",
	[COUNT_REDISTRIBUTION_RAYS] = "spreadRays",
};

static json_t *plan_to_json(const struct stats *s)
{
	const struct plan *p = s->run->plan;
	char plan[PLAN_TEXT_MAX], options[PLAN_OPTIONS_TEXT_MAX];
	plan_describe(p, plan, sizeof plan);
	plan_print_options_with_scene(p, s->image->rounds, s->inputs, options, sizeof options);
	return json_pack(
		"{s:i s:s s:s s:s s:s s:I s:I s:f s:f s:f s:f s:I s:I}", "schema", 1, "scene", s->scene, "integrator",
		p->integrator, "plan", plan, "options", options, "rounds", (json_int_t)s->image->rounds, "threads",
		(json_int_t)s->run->threads, "buildSeconds", s->build_seconds, "wallSeconds", s->run->seconds,
		"cpuSeconds", s->run->cpu_seconds, "bootstrapCpuSeconds", s->run->bootstrap_cpu_seconds, "triangles",
		(json_int_t)s->summary->triangles, "embreeBytes", (json_int_t)world_embree_bytes(s->run->world));
}

static json_t *image_to_json(const struct canvas_image *i)
{
	json_t *counters = json_object();
	for (int k = 0; k < BATCH_COUNTERS; k++)
		if (counter_names[k])
			json_object_set_new(counters, counter_names[k],
					    json_integer((json_int_t)i->counts.counters[k]));
	char doubt[STATED_ERROR_TEXT_MAX], b_doubt[STATED_ERROR_TEXT_MAX];
	stated_error_print_doubt(i, doubt, sizeof doubt);
	stated_error_print_b_doubt(i, b_doubt, sizeof b_doubt);
	return json_pack("{s:o s:o s:s s:o s:o s:[oo] s:s s:s s:f s:I s:o s:o}", "b", json_real_or_null(i->b), "bError",
			 *b_doubt ? json_null() : json_real_or_null(i->b_error), "bErrorDoubt", b_doubt, "relMSE",
			 json_real_or_null(i->rel_mse), "relMSEUpper",
			 *doubt ? json_null() : json_real_or_null(i->rel_mse_upper), "relMSE95",
			 json_real_or_null(i->rel_mse_interval_95[0]), json_real_or_null(i->rel_mse_interval_95[1]),
			 "relMSEDefinition", REL_MSE_DEFINITION, "relMSEDoubt", doubt, "relMSEUnseen",
			 i->rel_mse_unseen, "unvisitedPixels", (json_int_t)i->unvisited_count, "beyondShare",
			 json_real_or_null(i->overlong_share), "counters", counters);
}

double stats_chains_rays(const struct canvas_image *i)
{
	const uint64_t *c = i->counts.counters;
	double total = (double)c[COUNT_RAYS_CLOSEST] + (double)c[COUNT_RAYS_SHADOW];
	return total > 0 ? (double)c[COUNT_REDISTRIBUTION_RAYS] / total : 0;
}

static json_t *part_to_json(const char *name, double energy, double variance, double rays)
{
	return json_pack("{s:s s:o s:o s:o}", "part", name, "energy", json_real_or_null(energy), "varianceOfB",
			 json_real_or_null(variance), "rays", json_real_or_null(rays));
}

/* Returns the shares of samples and of chains in light, noise and work, for a render in which chains spread light that
 * is too bright for samples; otherwise an empty array. */
static json_t *parts_to_json(const struct canvas_image *i)
{
	json_t *parts = json_array();
	double rays = stats_chains_rays(i);
	if (i->counts.counters[COUNT_REDISTRIBUTED] > 0) {
		json_array_append_new(parts, part_to_json("samples", 1 - i->chains_energy_share,
							  1 - i->chains_variance_share, 1 - rays));
		json_array_append_new(parts,
				      part_to_json("chains", i->chains_energy_share, i->chains_variance_share, rays));
	}
	return parts;
}

static json_t *effects_to_json(const struct render_summary *m)
{
	json_t *effects = json_array();
	for (size_t i = 0; i < m->effect_line_count; i++)
		json_array_append_new(
			effects, json_pack("{s:s s:b s:b s:s s:s}", "name", m->effect_lines[i].name, "on",
					   (int)m->effect_lines[i].is_on, "forced", (int)m->effect_lines[i].is_forced,
					   "why", m->effect_lines[i].reason, "saves", m->effect_lines[i].savings));
	return effects;
}

static json_t *end_to_json(const struct stats *s)
{
	const struct plan *p = s->run->plan;
	char note[STRATEGY_NOTE_MAX];
	strategy_print_note(p, &s->image->counts, s->image->is_black, note, sizeof note);
	strategy_append_overlong(s->image->overlong_share, note, sizeof note);
	convergence_append_note(s->convergence, note, sizeof note);
	return json_pack("{s:s s:s s:o s:s s:o s:o}", "end",
			 merge_end_name(s->run->end, s->run->bootstrap_result.is_black), "mixture", p->mutations,
			 "strategies", strategy_to_json(p->mutations, &s->image->counts), "note", note, "agreement",
			 convergence_to_json(s->convergence), "classes", classes_to_json(s->image->classes));
}

int stats_write(const char *path, const struct stats *s, struct error *e)
{
	json_t *o = plan_to_json(s);
	bool is_complete = json_object_update_new(o, image_to_json(s->image)) == 0 &&
			   json_object_set_new(o, "choice", choice_to_json(s->choice)) == 0 &&
			   json_object_set_new(o, "effects", effects_to_json(s->summary)) == 0 &&
			   json_object_set_new(o, "parts", parts_to_json(s->image)) == 0 &&
			   json_object_set_new(o, "looks", forecast_looks_to_json(s->looks)) == 0 &&
			   json_object_update_new(o, end_to_json(s)) == 0;
	char *text = is_complete ? json_dumps(o, JSON_INDENT(2)) : NULL;
	json_decref(o);
	if (!text)
		return error_set(e, ENOMEM, "no memory for the statistics");
	int rc = image_file_write(path, (const unsigned char *)text, strlen(text), e);
	free(text);
	return rc;
}
