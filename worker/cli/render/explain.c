/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/render/explain.h"

#include "common/base/mem.h"
#include "worker/cli/render/choice.h"

#include <jansson.h>
#include <stdio.h>

enum { PLACEHOLDER_SPP = 64 }; /* makes the plan complete if no samples were requested; nothing is rendered */

static const char *effect_state(const struct effect_line *l)
{
	if (l->is_forced)
		return l->is_on ? "on (forced)" : "off (forced)";
	return l->is_on ? "on" : "off";
}

/* Returns the number of edges of the longest path in the image. */
static uint32_t simulated_depth(const struct plan_request *p)
{
	const struct integrator_properties *integrator = render_integrator_find(p->integrator);
	return integrator && integrator->max_depth < p->max_depth ? integrator->max_depth : p->max_depth;
}

static void print_explanation(const char *name, const struct render_summary *m, const struct plan_request *p,
			      const struct choice *c)
{
	char note[512];
	printf("%s: %llu shape%s, %llu triangle%s\n\n", name, (unsigned long long)m->shapes, m->shapes == 1 ? "" : "s",
	       (unsigned long long)m->triangles, m->triangles == 1 ? "" : "s");
	for (size_t i = 0; i < m->effect_line_count; i++) {
		const struct effect_line *l = &m->effect_lines[i];
		printf("%-13s %-12s  %s\n%27s %s: %s\n", l->name, effect_state(l), l->reason, "",
		       l->is_on ? "omitting it would save" : "saves", l->savings);
	}
	printf("\n%s, paths of at most %u edge%s", p->integrator, p->max_depth, p->max_depth == 1 ? "" : "s");
	if (simulated_depth(p) < p->max_depth)
		printf(" requested, at most %u simulated (longer ones are missing in the image; its note says how much)",
		       simulated_depth(p));
	if (*p->mixture)
		printf(", mutations %s", p->mixture);
	printf("\n%s\n", c->is_made ? c->summary
				    : "as requested; otherwise a pilot would choose among " RENDER_CHOICES_TEXT
				      " and " RENDER_INTEGRATOR_CHAINS);
	for (size_t i = 0; render_scene_note(m, i, note, sizeof note); i++)
		printf("note: %s\n", note);
}

static int print_json(const char *name, const struct render_summary *m, const struct plan_request *p,
		      const struct choice *c, struct error *e)
{
	char note[512];
	render_other_scene_note(m, note, sizeof note);
	json_t *effects = json_array();
	for (size_t i = 0; i < m->effect_line_count; i++) {
		const struct effect_line *l = &m->effect_lines[i];
		json_array_append_new(effects,
				      json_pack("{s:s s:b s:b s:s s:s}", "name", l->name, "on", (int)l->is_on, "forced",
						(int)l->is_forced, "why", l->reason, "saves", l->savings));
	}
	json_t *o = json_pack("{s:i s:s s:s s:s s:i s:i s:o s:o s:s}", "schema", 1, "scene", name, "integrator",
			      p->integrator, "mixture", p->mixture, "maxDepth", (int)p->max_depth, "heldDepth",
			      (int)simulated_depth(p), "choice", choice_to_json(c), "effects", effects, "note", note);
	if (!o)
		return error_set(e, ENOMEM, "no memory for the list of effects");
	json_dumpf(o, stdout, JSON_COMPACT);
	putchar('\n');
	json_decref(o);
	return 0;
}

static int summarise_scene(const char *folder, const char *name, struct render_arguments *a, struct render_summary *m,
			   struct error *e)
{
	struct scene scene;
	struct asset_folders folders = option_folders(a, folder);
	struct asset_source assets = asset_source_for_folders(&folders);
	int rc = option_scene_read(&scene, &assets, name, a, e);
	if (rc)
		return rc;
	rc = world_check(&scene, &assets, &a->render, m, e);
	scene_fini(&scene);
	return rc;
}

int explain_scene(const char *path, struct render_arguments *a, bool json, bool *is_usage_error, struct error *e)
{
	char *folder, *name;
	static struct render_summary m; /* too large for the stack */
	*is_usage_error = false;
	int rc = scene_path_split(path, a, &folder, &name, e);
	if (rc)
		return rc;
	struct choice choice;
	rc = summarise_scene(folder, name, a, &m, e);
	if (!rc) {
		rc = render_plan_from_scene(a, &m, e);
		if (!plan_request_is_bounded(&a->plan))
			a->plan.spp = PLACEHOLDER_SPP;
		if (!rc)
			rc = choice_make(a, folder, name, &choice, e);
		*is_usage_error = rc == -EINVAL;
	}
	if (!rc && json)
		rc = print_json(name, &m, &a->plan, &choice, e);
	else if (!rc)
		print_explanation(name, &m, &a->plan, &choice);
	mem_free(folder);
	mem_free(name);
	return rc;
}
