#include "worker/cli/choice.h"

#include "worker/render/choose.h"
#include "worker/scene/scene.h"

int choice_in_world(const struct world *w, struct render_arguments *a, char *text, size_t size, struct error *e)
{
	struct render_choice choice;
	*text = 0;
	if (!integrator_is_open(&a->plan))
		return 0;
	int rc = render_choose(w, &a->plan, &choice, e);
	if (!rc)
		render_choice_text(a->plan.integrator, &choice, text, size);
	return rc;
}

int choice_make(struct render_arguments *a, const char *folder, const char *name, char *text, size_t size, struct error *e)
{
	struct scene scene;
	struct world *w;
	*text = 0;
	if (!integrator_is_open(&a->plan))
		return 0;
	struct asset_source assets = asset_folder(folder);
	int rc = scene_read(&scene, &assets, name, render_plugins(), a->defines, a->define_count, e);
	if (rc)
		return rc;
	rc = world_new(&w, &scene, &assets, &a->render, e);
	scene_fini(&scene);
	if (!rc) {
		rc = choice_in_world(w, a, text, size, e);
		world_free(w);
	}
	return rc;
}
