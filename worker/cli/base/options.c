/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The table of the options that several programs share, and the functions that take their arguments. Each option checks
 * its argument at once and says what is expected. Values that depend on the scene, such as the film's size and the
 * default mixture, are filled in by render_plan_from_scene; the plan itself is made by plan_make.
 *
 * A wrong argument is -EINVAL with a sentence that names the option. The arguments are then half filled, and the
 * programs exit with a usage error.
 */
#include "worker/cli/base/options.h"

#include "common/base/mem.h"
#include "common/base/picture_name.h"
#include "common/base/spelling.h"
#include "common/base/output_target.h"
#include "common/base/text.h"
#include "worker/render/choose_integrator.h"
#include "worker/render/settings/accuracy_settings.h"

#include <dirent.h>
#include <errno.h>
#include <float.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

unsigned option_threads_default(void)
{
	long processors = sysconf(_SC_NPROCESSORS_ONLN);
	return processors > 0 ? (unsigned)processors : 1;
}

int option_scene(void *target, size_t index, char *word, struct error *e)
{
	((struct render_arguments *)target)->scene = word;
	return index == 0 ? 0 : error_set(e, EINVAL, "one scene at a time");
}

int option_image(void *target, char *arg, struct error *e)
{
	const char *format = picture_name_format(arg);
	((struct render_arguments *)target)->output = output_target_from_arg(arg);
	if (!format || strcmp(format, ".exr") == 0)
		return 0;
	return error_set(
		e, EINVAL,
		"-o %s: an OpenEXR file is written, so the name should end in .exr; hslt-tonemap converts it to PNG",
		arg);
}

int option_path(void *target, char *arg, struct error *e)
{
	struct render_arguments *a = target;
	struct stat st;
	if (stat(arg, &st) || !S_ISDIR(st.st_mode))
		return error_set(e, EINVAL, "--path: '%s' is not a folder", arg);
	if (a->path_count == OPTION_PATHS_MAX)
		return error_set(e, EINVAL, "at most %d times --path", OPTION_PATHS_MAX);
	a->paths[a->path_count++] = arg;
	return 0;
}

int option_define(void *target, char *arg, struct error *e)
{
	struct render_arguments *a = target;
	char *equals = strchr(arg, '=');
	if (!equals || equals == arg)
		return error_set(e, EINVAL, "-D takes NAME=VALUE, not '%s'", arg);
	if (a->define_count == OPTION_DEFINES_MAX)
		return error_set(e, EINVAL, "at most %d times -D", OPTION_DEFINES_MAX);
	*equals = 0;
	a->defines[a->define_count++] = (struct scene_define){arg, equals + 1};
	return 0;
}

struct asset_folders option_folders(const struct render_arguments *a, const char *folder)
{
	return asset_folders_make(folder, a->paths, a->path_count);
}

_Static_assert((int)OPTION_PATHS_MAX <= (int)PLAN_PATHS_MAX, "all folders are listed");
void option_plan_scene(const struct render_arguments *a, struct plan_scene *out)
{
	*out = (struct plan_scene){.define_count = a->define_count, .path_count = a->path_count};
	for (size_t i = 0; i < a->define_count; i++)
		out->defines[i] = (struct plan_define){a->defines[i].name, a->defines[i].value};
	for (size_t i = 0; i < a->path_count; i++)
		out->paths[i] = a->paths[i];
}

bool integrator_is_undecided(const struct plan_request *r)
{
	return !*r->integrator || strcmp(r->integrator, RENDER_INTEGRATOR_DEFAULT) == 0;
}

/* ---- arguments ---- */

static int parse_integrator(void *target, char *arg, struct error *e)
{
	struct render_arguments *a = target;
	(void)e;
	text_copy(a->plan.integrator, sizeof a->plan.integrator, arg);
	return 0;
}

/* Takes "640x360", or "640" if the height is to follow from the scene's aspect ratio. */
static int parse_size(void *target, char *arg, struct error *e)
{
	struct render_arguments *a = target;
	uint32_t n[2] = {0, 0};
	bool has_height = strchr(arg, 'x') != NULL;
	if (!text_parse_counts(arg, "x", n, has_height ? 2 : 1))
		return error_set(e, EINVAL, "--size takes W or WxH, such as 640x360 or 1.5k, not '%s'", arg);
	if (n[0] == 0 || (has_height && n[1] == 0))
		return error_set(e, EINVAL, "--size takes a film of at least 1x1 pixels");
	if (n[0] > PLAN_SIDE_MAX || n[1] > PLAN_SIDE_MAX || (uint64_t)n[0] * n[1] > PLAN_FILM_PIXELS_MAX)
		return error_set(e, EINVAL, "--size %s: a film has at most %d pixels a side and %d in all", arg,
				 PLAN_SIDE_MAX, PLAN_FILM_PIXELS_MAX);
	a->render.width = n[0];
	a->render.height = n[1];
	return 0;
}

static int parse_crop(void *target, char *arg, struct error *e)
{
	struct render_arguments *a = target;
	uint32_t n[4];
	if (!text_parse_counts(arg, ",,,", n, 4))
		return error_set(e, EINVAL, "--crop takes X,Y,W,H in pixels, such as 0,0,320,360, not '%s'", arg);
	if (n[2] == 0 || n[3] == 0)
		return error_set(e, EINVAL, "--crop takes a part of at least 1x1 pixels");
	a->plan.crop_x = n[0];
	a->plan.crop_y = n[1];
	a->plan.crop_width = n[2];
	a->plan.crop_height = n[3];
	return 0;
}

static int parse_mutations(void *target, char *arg, struct error *e)
{
	struct render_arguments *a = target;
	bool is_count = *arg >= '0' && *arg <= '9';
	if (is_count && !text_parse_count(arg, &a->plan.mutations))
		return error_set(e, EINVAL, "--mutations takes a whole number such as 4000 or 1.5k, not '%s'", arg);
	if (is_count)
		return a->plan.mutations ? 0 : error_set(e, EINVAL, "--mutations takes 1 or more");
	if (plan_strategy_count(arg) < 1)
		return error_set(e, EINVAL,
				 "--mutations takes a number or a list such as hslt=0.9,bidirectional=0.1, not '%s'",
				 arg);
	a->mixture = arg;
	return 0;
}

/* Prints every setting with its default, range and meaning, and exits. */
static void list_settings(void)
{
	const struct render_setting *k;
	for (size_t i = 0; (k = render_setting_at(i)) != NULL; i++) {
		char standard[32], range[80];
		accuracy_settings_print_value(&accuracy_settings_default, i, standard, sizeof standard);
		render_setting_print_range(k, range, sizeof range);
		printf("%s=%s (%s)\n    %s\n", k->name, standard, range, k->summary);
	}
	exit(0);
}

static int add_setting(struct render_arguments *a, const char *text, struct error *e)
{
	char combined[2 * PLAN_ACCURACY_MAX];
	int n = snprintf(combined, sizeof combined, "%s%s%s", a->render.accuracy, *a->render.accuracy ? "," : "", text);
	if (n < 0 || (size_t)n >= sizeof combined)
		return error_set(e, EINVAL, "--set: the text is too long");
	int rc = accuracy_settings_canonicalize(combined, a->render.accuracy, e);
	return rc ? error_prefix(e, -EINVAL, "--set") : 0;
}

static int parse_setting(void *target, char *arg, struct error *e)
{
	if (strcmp(arg, "help") == 0)
		list_settings();
	struct spelling s = {.wanted_name = arg};
	char hint[64];
	spelling_offer(&s, "help");
	if (s.best_match)
		return error_set(e, EINVAL, "--set: '%s' is no setting%s", arg, spelling_hint(&s, hint, sizeof hint));
	return add_setting(target, arg, e);
}

static int set_sensor(struct render_arguments *a, uint32_t n, struct error *e)
{
	char set[32];
	snprintf(set, sizeof set, "sensor=%u", n);
	a->sensor = NULL;
	return add_setting(a, set, e);
}

/* Takes the number of a sensor. Anything else is an id, which is looked up later in the scene (find_sensor). */
static int parse_sensor(void *target, char *arg, struct error *e)
{
	struct render_arguments *a = target;
	uint32_t n = 0;
	if (*arg && arg[strspn(arg, "0123456789")]) {
		a->sensor = arg;
		return 0;
	}
	if (!text_parse_counts(arg, "", &n, 1))
		return error_set(e, EINVAL, "--sensor takes the number of a sensor or its id, not '%s'", arg);
	return set_sensor(a, n, e);
}

static int find_sensor(const struct scene *s, struct render_arguments *a, struct error *e)
{
	char hint[128], ids[256] = "";
	struct spelling spelling = {.wanted_name = a->sensor};
	uint32_t count = 0;
	for (uint32_t i = 0; i < s->object_count; i++) {
		const struct scene_node *n = s->objects[i];
		if (n->cls != PLUGIN_SENSOR)
			continue;
		count++;
		if (n->id && strcmp(n->id, a->sensor) == 0)
			return set_sensor(a, count, e);
		if (n->id) {
			spelling_offer(&spelling, n->id);
			spelling_append_to_list(ids, sizeof ids, n->id);
		}
	}
	return error_set(e, EINVAL,
			 "--sensor: the scene has no sensor with the id '%.64s'%s (it has %u, numbered from 1%s%s)",
			 a->sensor, spelling_hint(&spelling, hint, sizeof hint), count, *ids ? "; ids: " : "", ids);
}

int option_scene_read(struct scene *s, const struct asset_source *assets, const char *name, struct render_arguments *a,
		      struct error *e)
{
	int rc = render_scene_read(s, assets, name, a->defines, a->define_count, &a->render, e);
	if (rc || !a->sensor)
		return rc;
	rc = find_sensor(s, a, e);
	if (rc)
		scene_fini(s);
	return rc;
}

static int parse_lenient(void *target, char *arg, struct error *e)
{
	(void)arg;
	return add_setting(target, RENDER_LENIENT, e);
}

static int parse_effects(void *target, char *arg, struct error *e)
{
	struct render_arguments *a = target;
	return render_canonical_effects(arg, a->render.effects, e) ? error_prefix(e, -EINVAL, "--effects") : 0;
}

/* ---- lists of choices ---- */

static const char *integrator_name(size_t i)
{
	const struct integrator_properties *r = render_integrator_at(i);
	if (r)
		return r->name;
	return i == 0 || render_integrator_at(i - 1) ? RENDER_INTEGRATOR_DEFAULT : NULL;
}

static void list_strategies(char *text, size_t size)
{
	struct text t = {text, size};
	const char *name, *summary;
	for (size_t i = 0; (name = render_mutation_at(i, &summary)) != NULL; i++)
		text_appendf(&t, "%s%s (%s)", i == 0 ? ". There are " : ", ", name, summary);
}

static void list_setting_defaults(char *text, size_t size)
{
	struct text t = {text, size};
	const struct render_setting *k;
	for (size_t i = 0; (k = render_setting_at(i)) != NULL; i++) {
		char standard[32];
		accuracy_settings_print_value(&accuracy_settings_default, i, standard, sizeof standard);
		text_appendf(&t, "%s%s=%s", i == 0 ? ". There are " : ", ", k->name, standard);
	}
}

/* ---- the table ---- */

#define RENDER struct render_arguments

static const struct option_row scene_rows[] = {
	{"integrator", 'i', "NAME",
	 "(" RENDER_INTEGRATOR_DEFAULT ": " RENDER_CHOICES_TEXT " or " RENDER_INTEGRATOR_CHAINS
	 ", chosen by a short pilot); the scene's own is ignored",
	 OPTION_CUSTOM(parse_integrator), .values = integrator_name},
	{"size", 0, "W[xH]",
	 "Size of the film in pixels, with the scene's field of view; without H also with its aspect ratio",
	 OPTION_CUSTOM(parse_size)},
	{"crop", 0, "X,Y,W,H", "Render only this part of the film, in pixels", OPTION_CUSTOM(parse_crop)},
	{"seed", 0, "S", "Seed of all random numbers", OPTION_COUNT(RENDER, plan.seed, 0, DBL_MAX),
	 .default_value = "0"},
	{"min-depth", 0, "K", "Length of the shortest paths, in edges (1: emitters seen directly)",
	 OPTION_COUNT(RENDER, plan.min_depth, 1, PLAN_DEPTH_MAX)},
	{"max-depth", 0, "K", "Length of the longest paths, in edges (the scene's)",
	 OPTION_COUNT(RENDER, plan.max_depth, 1, PLAN_DEPTH_MAX)},
	{"set", 0, "NAME=VALUE",
	 "Settings that trade accuracy for time, separated by commas; may be repeated; --set help describes them",
	 OPTION_CUSTOM(parse_setting), .append_default = list_setting_defaults},
	{"effects", 0, "LIST",
	 "Effects to simulate or omit, whether or not the scene needs them: all, or a list such as -dispersion,+aperture "
	 "(hslt-render --explain shows them)",
	 OPTION_CUSTOM(parse_effects)},
	{"define", 'D', "NAME=VALUE", "Value of $NAME in the scene", OPTION_CUSTOM(option_define)},
	{"path", 0, "FOLDER", "Search here for files that are not in the scene's folder; may be repeated",
	 OPTION_CUSTOM(option_path)},
	{"sensor", 0, "N|ID",
	 "Sensor of the scene to use: its number, counted from 1 (1), or its id; the same as --set sensor=N",
	 OPTION_CUSTOM(parse_sensor)},
	{"lenient", 0, NULL,
	 "Leave out or replace what is not supported, with a note for each; the same as --set lenient=yes",
	 OPTION_CUSTOM(parse_lenient)},
	{0},
};

static const struct option_row bound_rows[] = {
	{"spp", 0, "N", "Samples per pixel (64, 1.5k), rounded up to whole rounds",
	 OPTION_COUNT(RENDER, plan.spp, 1, DBL_MAX)},
	{"mutations", 0, "N|LIST",
	 "N: total number of mutations or samples. LIST: the strategies that propose mutations, with weights "
	 "(1), such as hslt=0.9,bidirectional=0.1; part of the plan. May be given twice, once as each",
	 OPTION_CUSTOM(parse_mutations), .append_default = list_strategies},
	{"time", 0, "SECONDS", "Wall-clock time (90, 5m, 2h), checked after complete rounds",
	 OPTION_SECONDS(RENDER, plan.seconds, 0, 1e9), .excludes_min = true, .excludes_max = true},
	{"target-error", 0, "E", "Estimated relative error: 0.02 or 2%", OPTION_RATIO(RENDER, plan.target_error, 0, 1),
	 .excludes_min = true},
	{0},
};

static const struct option_row plan_rows[] = {
	{"chains", 0, "N", "Markov chains (1024, fewer for short jobs)",
	 OPTION_COUNT(RENDER, plan.chains, 1, PLAN_CHAINS_MAX)},
	{"groups", 0, "N", "Independent replicates; their spread gives the error (16)",
	 OPTION_COUNT(RENDER, plan.groups, 1, PLAN_GROUPS_MAX)},
	{"parts", 0, "N", "Leases of a group in a round: at most groups times parts threads work on the job (4)",
	 OPTION_COUNT(RENDER, plan.parts, 1, PLAN_PARTS_MAX)},
	{"bootstrap", 0, "N", "Bootstrap samples (1000000, fewer for short jobs)",
	 OPTION_COUNT(RENDER, plan.bootstrap, 1, PLAN_BOOTSTRAP_MAX / 2)},
	{"epoch", 0, "N",
	 "Mutations per chain, or samples per pixel and group, in a round (on a farm: leases of at most 20 s)",
	 OPTION_COUNT(RENDER, plan.epoch, 1, DBL_MAX)},
	{0},
};

static const struct option_group groups[] = {
	{"What to render:", scene_rows},
	{"When to stop (at the first bound reached; without any, at the scene's sampleCount):", bound_rows},
	{"The plan (affects the bits):", plan_rows},
	{0},
};

static int check_options(void *target, struct error *e)
{
	struct render_arguments *a = target;
	const char *name = integrator_is_undecided(&a->plan) ? RENDER_INTEGRATOR_CHAINS : a->plan.integrator;
	a->render.max_depth = a->plan.max_depth;
	if (a->plan.chains && render_integrator_find(name)->kind != PLAN_CHAINS)
		return error_set(e, EINVAL, "--chains %u: the integrator %s has no chains that could be counted",
				 a->plan.chains, name);
	if (a->mixture && !render_integrator_find(name)->has_mutations)
		return error_set(e, EINVAL, "--mutations %s: the integrator %s has no strategies to choose from",
				 a->mixture, name);
	return 0;
}

const struct option_table render_option_table = {groups, check_options};

/* Checks that the integrator can render everything in the scene. is_undecided: the integrator is still to be chosen. */
static int check_integrator(const struct integrator_properties *i, const struct render_summary *summary,
			    bool is_undecided, struct error *e)
{
	if (i->is_camera_only && summary->has_beam)
		return error_set(e, EINVAL, RENDER_NO_BEAMS, i->name);
	if (!i->is_camera_only && summary->has_rolling_shutter)
		return error_set(e, EINVAL, RENDER_NO_ROLLING_SHUTTER, i->name);
	if (i->must_end_on_emitter && !is_undecided && render_effect_is_on(summary, "medium-light"))
		return error_set(e, EINVAL, RENDER_NO_MEDIUM_LIGHT, i->name);
	return 0;
}

int render_plan_from_scene(struct render_arguments *a, const struct render_summary *summary, struct error *e)
{
	struct plan_request *p = &a->plan;
	const struct scene_settings *s = &summary->settings;
	bool is_undecided = integrator_is_undecided(p),
	     chains = a->mixture || p->chains; /* options for chains imply chains */
	if (is_undecided)
		text_copy(p->integrator, sizeof p->integrator,
			  chains ? RENDER_INTEGRATOR_CHAINS : RENDER_INTEGRATOR_DEFAULT);
	if (is_undecided && !chains &&
	    summary->has_rolling_shutter) { /* only `path` can render it, so nothing is left to choose */
		text_copy(p->integrator, sizeof p->integrator, "path");
		is_undecided = false;
	}
	const struct integrator_properties *integrator =
		render_integrator_find(is_undecided ? RENDER_INTEGRATOR_CHAINS : p->integrator);
	int rc = check_integrator(integrator, summary, is_undecided && !chains, e);
	if (rc)
		return rc;
	p->kind = integrator->kind;
	p->width = s->width;
	p->height = s->height;
	p->border = s->border;
	if (!p->crop_width) {
		p->crop_x = s->crop_x;
		p->crop_y = s->crop_y;
		p->crop_width = s->crop_width;
		p->crop_height = s->crop_height;
	}
	memcpy(p->accuracy, a->render.accuracy, sizeof p->accuracy);
	memcpy(p->effects, a->render.effects, sizeof p->effects);
	if (!p->max_depth)
		p->max_depth = s->max_depth;
	if (!p->min_depth && s->hides_emitters && p->max_depth == 1)
		return error_set(
			e, EINVAL,
			"nothing is left to render: paths of one edge show emitters alone, and the scene hides "
			"these (hide_emitters); --max-depth 2 shows what they light");
	if (!p->min_depth)
		p->min_depth = s->hides_emitters ? 2 : 1;
	/* Leaves out longer paths, which carry no light in this scene; but not if the requested minimum is longer
	 * still, because no paths would be left. */
	if (p->max_depth > summary->useful_depth && summary->useful_depth >= p->min_depth)
		p->max_depth = summary->useful_depth;
	if (!plan_request_is_bounded(p))
		p->spp = s->spp;
	return integrator->has_mutations ? render_canonical_mutations(a->mixture, summary, p->mixture, e) : 0;
}

void option_depth_note(const char *integrator, uint32_t max_depth, char *text, size_t size)
{
	const struct integrator_properties *i = render_integrator_find(integrator);
	*text = 0;
	if (i && i->max_depth < max_depth)
		text_print(
			text, size,
			"the chains of %s hold paths of up to %u edges; light of longer ones is missing, and reported if it is more "
			"than 0.1 %%",
			i->name, i->max_depth);
}

/* Sets the error for a scene file that does not exist, with the nearest name in its folder. */
static int missing_scene_error(const char *path, const char *folder, const char *name, struct error *e)
{
	struct spelling suggestion = {.wanted_name = name};
	struct dirent *entry;
	char hint[512] = "";
	struct stat link;
	if (lstat(path, &link) == 0) /* a dangling link, whose own name would be the nearest one */
		return error_set(e, ENOENT, "%s: a link to a file that is not there", path);
	DIR *d = opendir(folder);
	while (d && (entry = readdir(d)))
		spelling_offer(&suggestion, entry->d_name);
	if (d)
		closedir(d);
	return error_set(e, ENOENT, "%s: no such file%s", path, spelling_hint(&suggestion, hint, sizeof hint));
}

int scene_path_split(const char *path, const struct render_arguments *a, char **folder, char **name, struct error *e)
{
	const char *slash = strrchr(path, '/');
	*name = mem_strdup(slash ? slash + 1 : path);
	*folder = mem_strdup(slash ? path : ".");
	int rc = !*name || !*folder ? error_set(e, ENOMEM, "no memory for the scene's name") : 0;
	if (!rc && slash)
		(*folder)[slash == path ? 1 : slash - path] = 0;
	if (!rc && !**name)
		rc = error_set(e, EINVAL,
			       *path ? "%s is a folder, not a scene file" : "the name of the scene is empty%s", path);
	if (!rc && !a->path_count && access(path, F_OK) && errno == ENOENT)
		rc = missing_scene_error(path, *folder, *name, e);
	if (rc) {
		mem_free(*folder);
		mem_free(*name);
		*folder = *name = NULL;
	}
	return rc;
}
