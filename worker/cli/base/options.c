/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One argp table: each option checks its argument at once and says what would be right. What only the scene can tell
 * (the film's shape, the usual mixture) is filled in by render_plan_from_scene, which ends in plan_make.
 *
 * Errors go through argp_error: one line, the program's name, exit code 2 (docs/design.md, exit codes).
 */
#include "worker/cli/base/options.h"

#include "common/base/mem.h"
#include "common/base/spelling.h"
#include "common/base/text.h"
#include "worker/render/settings/accuracy_settings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
	OPTION_SPP = 1000,
	OPTION_MUTATIONS,
	OPTION_TIME,
	OPTION_TARGET,
	OPTION_SIZE,
	OPTION_CROP,
	OPTION_SEED,
	OPTION_MIN_DEPTH,
	OPTION_MAX_DEPTH,
	OPTION_CHAINS,
	OPTION_GROUPS,
	OPTION_BOOTSTRAP,
	OPTION_EPOCH,
	OPTION_SET,
	OPTION_EFFECTS,
	OPTION_PARTS,
	OPTION_LENIENT,
	OPTION_SENSOR,
	OPTION_PATH,
};

static const struct argp_option options[] = {
	{NULL, 0, NULL, 0, "What to render:", 1},
	{"integrator", 'i', "NAME", 0,
	 "(" RENDER_INTEGRATOR_DEFAULT ": path, bdpt8, bdpt or hslt, by a short pilot); the scene's own is ignored",
	 1}, /* see help */
	{"size", OPTION_SIZE, "W[xH]", 0,
	 "Size of the film; keeps the angle of view. Without H the film keeps its shape", 1},
	{"crop", OPTION_CROP, "X,Y,W,H", 0, "Part of the film, in its pixels", 1},
	{"seed", OPTION_SEED, "S", 0, "Of all random numbers (0)", 1},
	{"min-depth", OPTION_MIN_DEPTH, "K", 0, "Shortest paths, in edges (1: emitters seen directly)", 1},
	{"max-depth", OPTION_MAX_DEPTH, "K", 0, "Longest paths, in edges (the scene's)", 1},
	{"set", OPTION_SET, "NAME=VALUE", 0,
	 "Settings that trade accuracy for time, with commas between; may be given again. help: what each does", 1},
	{"effects", OPTION_EFFECTS, "LIST", 0,
	 "What is simulated although the scene does not call for it, or not although it does: all, or such as -dispersion,+aperture "
	 "(hslt-render --explain lists them)",
	 1},
	{"define", 'D', "NAME=VALUE", 0, "For $NAME in the scene", 1},
	{"path", OPTION_PATH, "FOLDER", 0,
	 "Where files that are not in the scene's folder are searched; may be given again", 1},
	{"sensor", OPTION_SENSOR, "N", 0, "Which of the scene's sensors, from 1 on (1): --set sensor=N", 1},
	{"lenient", OPTION_LENIENT, NULL, 0,
	 "What the scene asks for and is not supported is left out or replaced by what is nearest, and noted: --set lenient=yes",
	 1},
	{NULL, 0, NULL, 0, "When to stop (the first bound met; without any, the scene's sampleCount):", 2},
	{"spp", OPTION_SPP, "N", 0, "Samples a pixel (64, 1.5k), rounded up to whole rounds", 2},
	{"mutations", OPTION_MUTATIONS, "N|LIST", 0,
	 "N: mutations or samples in all. LIST: the strategies that propose mutations, with weights (1), such as "
	 "hslt=0.9,bidirectional=0.1; part of the plan. May be given twice, once for each",
	 2},
	{"time", OPTION_TIME, "SECONDS", 0, "Wall clock (90, 5m, 2h), looked at after complete rounds", 2},
	{"target-error", OPTION_TARGET, "E", 0, "Estimated relative error: 0.02 or 2%", 2},
	{NULL, 0, NULL, 0, "The plan (part of what decides the bits):", 3},
	{"chains", OPTION_CHAINS, "N", 0, "Markov chains (1024, fewer for tiny jobs)", 3},
	{"groups", OPTION_GROUPS, "N", 0, "Independent replicates, for the error (16)", 3},
	{"parts", OPTION_PARTS, "N", 0,
	 "Leases of a group in a round: groups times parts threads at most work on the job (4)", 3},
	{"bootstrap", OPTION_BOOTSTRAP, "N", 0, "Bootstrap samples (1000000, fewer for tiny jobs)", 3},
	{"epoch", OPTION_EPOCH, "N", 0,
	 "Mutations of a chain, or samples a pixel and group, in a round (leases of 20 s at most, where a farm is asked)",
	 3},
	{0},
};

uint64_t option_whole(const struct argp_state *state, const char *option, const char *arg)
{
	uint64_t n = 0;
	if (!text_count(arg, &n))
		argp_error(state, "%s takes a whole number such as 4000 or 1.5k, not '%s'", option, arg);
	return n;
}

unsigned option_threads(const struct argp_state *state, const char *arg)
{
	uint64_t n = option_whole(state, "--threads", arg);
	if (n < 1 || n > 1024)
		argp_error(state, "--threads takes 1 to 1024, not '%s'", arg);
	return (unsigned)n;
}

unsigned option_threads_default(void)
{
	long processors = sysconf(_SC_NPROCESSORS_ONLN);
	return processors > 0 ? (unsigned)processors : 1;
}

static uint32_t whole32(const struct argp_state *state, const char *option, const char *arg)
{
	uint64_t n = option_whole(state, option, arg);
	if (n > UINT32_MAX)
		argp_error(state, "%s takes a number up to %u, not '%s'", option, UINT32_MAX, arg);
	return (uint32_t)n;
}

double option_seconds(const struct argp_state *state, const char *option, const char *arg)
{
	double x = 0;
	if (!text_seconds(arg, &x) || !(x > 0 && x < 1e9))
		argp_error(state, "%s takes a time such as 90, 90s, 5m or 2h, not '%s'", option, arg);
	return x;
}

const char *option_image(const struct argp_state *state, const char *arg)
{
	static const char *const others[] = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".hdr", ".bmp", ".ppm", ".pfm"};
	size_t n = strlen(arg);
	if (strcmp(arg, "-") == 0)
		return "/dev/stdout";
	for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
		size_t k = strlen(others[i]);
		if (n > k && strcasecmp(arg + n - k, others[i]) == 0)
			argp_error(
				state,
				"images are OpenEXR, and '%s' would not be what its name says; hslt-tonemap makes a PNG of one",
				arg);
	}
	return arg;
}

static double target_error(const struct argp_state *state, const char *arg)
{
	double x;
	if (!text_ratio(arg, &x) || !(x > 0 && x < 1e3))
		argp_error(state, "--target-error takes something like 0.02 or 2%%, not '%s'", arg);
	if (x > 1 && !strchr(arg, '%'))
		argp_error(state, "--target-error %s is an error of %g %%; for %s percent write %s%%", arg, 100 * x,
			   arg, arg);
	return x;
}

static void take_define(struct render_arguments *a, char *arg, const struct argp_state *state)
{
	char *equals = strchr(arg, '=');
	if (!equals || equals == arg)
		argp_error(state, "-D takes NAME=VALUE, not '%s'", arg);
	if (a->define_count == OPTION_DEFINES_MAX)
		argp_error(state, "at most %d times -D", OPTION_DEFINES_MAX);
	*equals = 0;
	a->defines[a->define_count++] = (struct scene_define){arg, equals + 1};
}

static void take_numbers(const struct argp_state *state, const char *option, const char *arg, const char *format,
			 uint32_t *out, int count)
{
	const char *at = arg;
	for (int i = 0; i < count; i++) {
		char *end;
		errno = 0;
		unsigned long n = strtoul(at, &end, 10);
		char wanted = i + 1 < count ? format[i] : 0;
		if (*at < '0' || *at > '9' || errno || n > UINT32_MAX || *end != wanted)
			argp_error(state, "%s does not understand '%s' (try --help)", option, arg);
		out[i] = (uint32_t)n;
		at = end + 1;
	}
}

static void take_mutations(struct render_arguments *a, const char *arg, const struct argp_state *state)
{
	if (*arg >= '0' && *arg <= '9') {
		a->plan.mutations = option_whole(state, "--mutations", arg);
		if (a->plan.mutations == 0)
			argp_error(state, "--mutations takes 1 or more");
		return;
	}
	if (plan_strategy_count(arg) < 1)
		argp_error(state, "--mutations takes a number or a list such as hslt=0.9,bidirectional=0.1, not '%s'",
			   arg);
	a->mixture = arg;
}

/* Every setting, its default, its range and what it does. */
static void list_settings(void)
{
	const struct render_setting *k;
	for (size_t i = 0; (k = render_setting_at(i)) != NULL; i++) {
		char standard[32], range[80];
		accuracy_settings_value(&accuracy_settings_default, i, standard, sizeof standard);
		render_setting_range(k, range, sizeof range);
		printf("%s=%s (%s)\n    %s\n", k->name, standard, range, k->summary);
	}
	exit(0);
}

static void take_set(struct render_arguments *a, const char *arg, const struct argp_state *state)
{
	char all[2 * PLAN_ACCURACY_MAX];
	struct error e;
	if (strcmp(arg, "help") == 0)
		list_settings();
	int n = snprintf(all, sizeof all, "%s%s%s", a->render.accuracy, *a->render.accuracy ? "," : "", arg);
	if (n < 0 || (size_t)n >= sizeof all)
		argp_error(state, "--set: the text is too long");
	if (render_settings_canonical(all, a->render.accuracy, &e))
		argp_error(state, "--set: %s", e.text);
}

struct asset_folders option_folders(const struct render_arguments *a, const char *folder)
{
	return asset_folders_of(folder, a->paths, a->path_count);
}

void option_path(const struct argp_state *state, const char *arg, const char **paths, size_t *count)
{
	struct stat st;
	if (stat(arg, &st) || !S_ISDIR(st.st_mode))
		argp_error(state, "--path: '%s' is no folder", arg);
	if (*count == OPTION_PATHS_MAX)
		argp_error(state, "at most %d times --path", OPTION_PATHS_MAX);
	paths[(*count)++] = arg;
}

static void take_sensor(struct render_arguments *a, const char *arg, const struct argp_state *state)
{
	char set[32];
	snprintf(set, sizeof set, "sensor=%u", whole32(state, "--sensor", arg));
	take_set(a, set, state);
}

static void take_effects(struct render_arguments *a, const char *arg, const struct argp_state *state)
{
	struct error e;
	if (render_effects(arg, a->render.effects, &e))
		argp_error(state, "--effects: %s", e.text);
}

bool integrator_is_open(const struct plan_request *r)
{
	return !*r->integrator || strcmp(r->integrator, RENDER_INTEGRATOR_DEFAULT) == 0;
}

static void check_mixture(const struct render_arguments *a, const struct argp_state *state)
{
	const char *name = integrator_is_open(&a->plan) ? RENDER_INTEGRATOR_CHAINS : a->plan.integrator;
	if (a->mixture && !render_integrator_find(name)->has_mutations)
		argp_error(state, "--mutations %s: the integrator %s has no strategies to choose from", a->mixture,
			   name);
}

static void check_integrator(const char *name, const struct argp_state *state)
{
	const struct render_integrator *r;
	char hint[128];
	struct spelling s = {.wanted = name};
	if (render_integrator_find(name) || strcmp(name, RENDER_INTEGRATOR_DEFAULT) == 0)
		return;
	spelling_offer(&s, RENDER_INTEGRATOR_DEFAULT);
	for (size_t i = 0; (r = render_integrator_at(i)) != NULL; i++)
		spelling_offer(&s, r->name);
	argp_error(state, "there is no integrator '%s'%s", name, spelling_hint(&s, hint, sizeof hint));
}

/* "640x360", or "640": the height that keeps the scene's shape. */
static void take_size(struct render_arguments *a, const char *arg, const struct argp_state *state)
{
	uint32_t n[2] = {0, 0};
	bool both = strchr(arg, 'x') != NULL;
	take_numbers(state, "--size", arg, "x", n, both ? 2 : 1);
	if (n[0] == 0 || (both && n[1] == 0))
		argp_error(state, "--size takes a film of at least 1x1 pixels");
	a->render.width = n[0];
	a->render.height = n[1];
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct render_arguments *a = state->input;
	struct plan_request *p = &a->plan;
	uint32_t n[4] = {0};
	switch (key) {
	case 'i':
		check_integrator(arg, state);
		text_copy(p->integrator, sizeof p->integrator, arg);
		return 0;
	case 'D':
		take_define(a, arg, state);
		return 0;
	case OPTION_SPP:
		p->spp = option_whole(state, "--spp", arg);
		if (p->spp == 0)
			argp_error(state, "--spp takes 1 or more");
		return 0;
	case OPTION_MUTATIONS:
		take_mutations(a, arg, state);
		return 0;
	case OPTION_TIME:
		p->seconds = option_seconds(state, "--time", arg);
		return 0;
	case OPTION_TARGET:
		p->target_error = target_error(state, arg);
		return 0;
	case OPTION_SIZE:
		take_size(a, arg, state);
		return 0;
	case OPTION_CROP:
		take_numbers(state, "--crop", arg, ",,,", n, 4);
		p->crop_x = n[0];
		p->crop_y = n[1];
		p->crop_width = n[2];
		p->crop_height = n[3];
		if (n[2] == 0 || n[3] == 0)
			argp_error(state, "--crop takes a part of at least 1x1 pixels");
		return 0;
	case OPTION_SEED:
		p->seed = option_whole(state, "--seed", arg);
		return 0;
	case OPTION_MIN_DEPTH:
		p->min_depth = whole32(state, "--min-depth", arg);
		return 0;
	case OPTION_MAX_DEPTH:
		p->max_depth = a->render.max_depth = whole32(state, "--max-depth", arg);
		return 0;
	case OPTION_PATH:
		option_path(state, arg, a->paths, &a->path_count);
		return 0;
	case OPTION_SENSOR:
		take_sensor(a, arg, state);
		return 0;
	case OPTION_LENIENT:
		take_set(a, RENDER_LENIENT, state);
		return 0;
	case OPTION_EFFECTS:
		take_effects(a, arg, state);
		return 0;
	case OPTION_CHAINS:
		p->chains = whole32(state, "--chains", arg);
		return 0;
	case OPTION_GROUPS:
		p->groups = whole32(state, "--groups", arg);
		return 0;
	case OPTION_PARTS:
		p->parts = whole32(state, "--parts", arg);
		return 0;
	case OPTION_BOOTSTRAP:
		p->bootstrap = option_whole(state, "--bootstrap", arg);
		return 0;
	case OPTION_SET:
		take_set(a, arg, state);
		return 0;
	case OPTION_EPOCH:
		p->epoch = option_whole(state, "--epoch", arg);
		return 0;
	case ARGP_KEY_END:
		check_mixture(a, state);
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

/* The integrators that there are before what the table says of --integrator, the strategies and the settings after what
 * it says of --mutations and --set. argp frees the text. */
static char *help(int key, const char *text, void *input)
{
	(void)input;
	char names[1024] = "";
	const char *name, *summary;
	size_t used = 0;
	const struct render_integrator *r;
	if (key == 'i') {
		for (size_t i = 0; (r = render_integrator_at(i)) != NULL && used < sizeof names; i++) {
			const char *separator = i == 0 ? "" : render_integrator_at(i + 1) ? ", " : " or ";
			int n = snprintf(names + used, sizeof names - used, "%s%s", separator, r->name);
			used += n < 0 ? 0 : (size_t)n;
		}
	} else if (key == OPTION_MUTATIONS) {
		for (size_t i = 0; (name = render_mutation_at(i, &summary)) != NULL && used < sizeof names; i++) {
			int n = snprintf(names + used, sizeof names - used, "%s%s (%s)", i == 0 ? "" : ", ", name,
					 summary);
			used += n < 0 ? 0 : (size_t)n;
		}
	} else if (key == OPTION_SET) {
		const struct render_setting *k;
		for (size_t i = 0; (k = render_setting_at(i)) != NULL && used < sizeof names; i++) {
			char standard[32];
			accuracy_settings_value(&accuracy_settings_default, i, standard, sizeof standard);
			int n = snprintf(names + used, sizeof names - used, "%s%s=%s", i == 0 ? "" : ", ", k->name,
					 standard);
			used += n < 0 ? 0 : (size_t)n;
		}
	} else {
		return text_borrow(text);
	}
	char *all = NULL;
	int n = key == 'i' ? asprintf(&all, "%s %s", names, text) : asprintf(&all, "%s. There are %s", text, names);
	return n < 0 ? text_borrow(text) : all;
}

const struct argp render_argp = {options, parse, NULL, NULL, NULL, help, NULL};

int render_plan_from_scene(struct render_arguments *a, const struct render_summary *summary, struct error *e)
{
	struct plan_request *p = &a->plan;
	const struct scene_settings *s = &summary->settings;
	bool open = integrator_is_open(p), chains = a->mixture || p->chains; /* who says how, wants them */
	if (open)
		text_copy(p->integrator, sizeof p->integrator,
			  chains ? RENDER_INTEGRATOR_CHAINS : RENDER_INTEGRATOR_DEFAULT);
	const struct render_integrator *integrator =
		render_integrator_find(open ? RENDER_INTEGRATOR_CHAINS : p->integrator);
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
	if (!p->min_depth)
		p->min_depth = s->hide_emitters ? 2 : 1;
	if (!p->max_depth)
		p->max_depth = s->max_depth;
	/* Longer paths carry no light; but what was asked for at least must be asked of something. */
	if (p->max_depth > summary->useful_depth && summary->useful_depth >= p->min_depth)
		p->max_depth = summary->useful_depth;
	if (!p->spp && !p->mutations && !(p->seconds > 0) && !(p->target_error > 0))
		p->spp = s->spp;
	return integrator->has_mutations ? render_mutations(a->mixture, summary, p->mixture, e) : 0;
}

int scene_path_split(const char *path, char **folder, char **name, struct error *e)
{
	const char *slash = strrchr(path, '/');
	*name = mem_strdup(slash ? slash + 1 : path);
	*folder = mem_strdup(slash ? path : ".");
	int rc = !*name || !*folder ? error_set(e, ENOMEM, "no memory for the scene's name") : 0;
	if (!rc && slash)
		(*folder)[slash == path ? 1 : slash - path] = 0;
	if (!rc && !**name)
		rc = error_set(e, EINVAL, "%s: is a folder, not a scene file", path);
	if (rc) {
		mem_free(*folder);
		mem_free(*name);
		*folder = *name = NULL;
	}
	return rc;
}
