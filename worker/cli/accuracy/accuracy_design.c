/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes the list of settings to compare: the default, the reference, each accuracy setting with the values of its
 * sweep, other depths, other shares of independent proposals, mixtures of strategies with one removed or added, and
 * presets. A parameter without effect in this scene (because the integrator has no chains, or an effect is off) is left
 * out with the reason, so that no time is spent on it. What does not fit into the tables is left out.
 *
 * Fails if --parameters names a parameter that does not exist (-EINVAL, with the nearest name).
 */
#include "worker/cli/accuracy/accuracy_design.h"

#include "common/base/spelling.h"
#include "common/base/text.h"
#include "worker/render/settings/accuracy_settings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The settings of the reference: values whose bias is far too small to be measured. Those of roughness and tessellation
 * are the finest values of their sweeps. */
static const struct {
	const char *parameter, *value;
} reference_values[] = {{"tolerance", "1e-06"},
			{"iterations", "30"},
			{"reverse-tolerance", "1e-05"},
			{"roughness", "0"},
			{"tessellation", "2"}};

/* Settings that belong together and are tried as one. */
static const struct {
	const char *name, *accuracy;
} presets[] = {{"fast", "tolerance=0.01,iterations=6,reverse-tolerance=0.01"}};

/* Names of the parameters that are not settings of worker/render/settings/accuracy_settings.h. */
#define DEPTH "max-depth"
#define SHARE "independent"
#define MIXTURE "mixture"
#define PRESET "preset"

struct planner {
	struct accuracy_design *design;
	const struct plan_request *base;
	const struct render_summary *scene;
	const struct integrator_properties *integrator;
	const char *parameters;
	struct error *e;
};

static bool is_listed(const char *list, const char *name)
{
	size_t n = strlen(name);
	for (const char *at = list; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL)
		if (strncmp(at, name, n) == 0 && (at[n] == ',' || at[n] == 0))
			return true;
	return list == NULL;
}

static const struct render_setting *find_setting(const char *name)
{
	const struct render_setting *k;
	for (size_t i = 0; (k = render_setting_at(i)) != NULL; i++)
		if (strcmp(k->name, name) == 0)
			return k;
	return NULL;
}

static void skip_parameter(struct planner *p, const char *parameter, const char *reason)
{
	if (p->design->skipped_count == ACCURACY_SWEEPS_MAX)
		return;
	struct accuracy_skipped *l = &p->design->skipped[p->design->skipped_count++];
	text_copy(l->parameter, sizeof l->parameter, parameter);
	text_copy(l->reason, sizeof l->reason, reason);
}

static struct accuracy_sweep *new_sweep(struct planner *p, const char *parameter, const char *summary)
{
	if (p->design->sweep_count == ACCURACY_SWEEPS_MAX)
		return NULL;
	struct accuracy_sweep *s = &p->design->sweeps[p->design->sweep_count++];
	*s = (struct accuracy_sweep){.summary = summary};
	text_copy(s->parameter, sizeof s->parameter, parameter);
	return s;
}

/* Adds a setting that equals the default except for what the caller changes; NULL: the table is full. */
static struct accuracy_setting *new_setting(struct planner *p, const char *parameter, const char *value)
{
	struct accuracy_design *d = p->design;
	if (d->count == ACCURACY_SETTINGS_MAX)
		return NULL;
	struct accuracy_setting *s = &d->settings[d->count++];
	*s = (struct accuracy_setting){.time_share = 1, .max_depth = p->base->max_depth};
	text_copy(s->parameter, sizeof s->parameter, parameter);
	text_copy(s->value, sizeof s->value, value);
	text_copy(s->accuracy, sizeof s->accuracy, p->base->accuracy);
	text_copy(s->mixture, sizeof s->mixture, p->base->mixture);
	return s;
}

/* Appends a value to the sweep. setting: the index of the setting that has it; ACCURACY_DEFAULT if it is the default's
 * value. Returns false if the sweep is full. */
static bool add_value(struct accuracy_sweep *s, const char *value, size_t setting)
{
	if (s->count == ACCURACY_VALUES_MAX)
		return false;
	text_copy(s->values[s->count], sizeof s->values[0], value);
	s->setting_indices[s->count++] = setting;
	return true;
}

static struct accuracy_setting *add_swept_setting(struct planner *p, struct accuracy_sweep *s, const char *value)
{
	if (!add_value(s, value, p->design->count))
		return NULL;
	struct accuracy_setting *setting = new_setting(p, s->parameter, value);
	if (!setting)
		s->count--;
	return setting;
}

/* Sets one value in the settings `base`. Returns false if it is the base's value already, or is invalid. */
static bool set_value(const char *base, const char *name, const char *value, char out[PLAN_ACCURACY_MAX])
{
	char text[2 * PLAN_ACCURACY_MAX];
	struct error e;
	snprintf(text, sizeof text, "%s%s%s=%s", base, *base ? "," : "", name, value);
	return accuracy_settings_canonicalize(text, out, &e) == 0 && strcmp(out, base) != 0;
}

/* Returns why a setting of the renderer has no effect in this scene; NULL if it has one. */
static const char *no_effect_reason(const struct planner *p, const struct render_setting *k)
{
	if (!k->sweep[0])
		return "it determines what is rendered, not how accurately";
	if (k->scope == SETTING_CHAINS && !p->integrator->has_mutations)
		return "the integrator has no strategies that walk";
	if (strcmp(k->name, "tessellation") == 0 && !render_effect_is_on(p->scene, "displacement"))
		return "no shape is displaced";
	if (strcmp(k->name, "roughness") == 0 && !render_effect_is_on(p->scene, "glossy"))
		return "no material has a rough lobe of finite width";
	if (strcmp(k->name, "wavelengths") == 0 && !render_effect_is_on(p->scene, "colour"))
		return "nothing varies with wavelength";
	return NULL;
}

static void sweep_setting(struct planner *p, const struct render_setting *k)
{
	struct accuracy_settings current;
	char standard[32];
	size_t index = 0;
	while (render_setting_at(index) != k)
		index++;
	if (accuracy_settings_read(p->base->accuracy, &current, NULL))
		return;
	accuracy_settings_print_value(&current, index, standard, sizeof standard);
	struct accuracy_sweep *s = new_sweep(p, k->name, k->summary);
	bool placed = false;
	for (size_t i = 0; s && k->sweep[i]; i++) {
		char accuracy[PLAN_ACCURACY_MAX];
		if (!set_value(p->base->accuracy, k->name, k->sweep[i], accuracy)) {
			placed |= add_value(s, standard, ACCURACY_DEFAULT);
			continue;
		}
		struct accuracy_setting *setting = add_swept_setting(p, s, k->sweep[i]);
		if (!setting)
			continue;
		memcpy(setting->accuracy, accuracy, sizeof accuracy);
		setting->changes_image = k->scope == SETTING_WORLD;
	}
	if (s && !placed)
		add_value(s, standard, ACCURACY_DEFAULT);
}

static void sweep_depth(struct planner *p)
{
	static const uint32_t depths[] = {2, 3, 5, 8, 12, 20, 32};
	char value[32];
	struct accuracy_sweep *s = new_sweep(p, DEPTH, "Longest paths, in edges; longer ones are missing in the image");
	for (size_t i = 0; s && i < sizeof depths / sizeof *depths && depths[i] < p->base->max_depth; i++) {
		snprintf(value, sizeof value, "%u", depths[i]);
		struct accuracy_setting *setting = add_swept_setting(p, s, value);
		if (!setting)
			continue;
		setting->max_depth = depths[i];
		setting->changes_image = true;
	}
	snprintf(value, sizeof value, "%u", p->base->max_depth);
	if (s)
		add_value(s, value, ACCURACY_DEFAULT);
}

struct weighted_strategy {
	char name[32];
	double weight;
	bool is_independent;
};

/* Reads a canonical mixture, which has NAME=WEIGHT for each strategy. Returns the number of strategies. */
static int read_entries(const char *mixture, struct weighted_strategy entry[PLAN_STRATEGIES_MAX])
{
	int n = plan_strategy_count(mixture);
	const char *at = mixture;
	for (int i = 0; i < n; i++) {
		plan_strategy_name(mixture, (uint32_t)i, entry[i].name, sizeof entry[i].name);
		const char *equals = strchr(at, '=');
		entry[i].weight = equals ? strtod(equals + 1, NULL) : 1;
		entry[i].is_independent =
			strcmp(entry[i].name, "bidirectional") == 0 || strcmp(entry[i].name, "independent") == 0;
		at = strchr(at, ',') ? strchr(at, ',') + 1 : at;
	}
	return n;
}

static bool print_entries(struct planner *p, const struct weighted_strategy *entry, int n, char out[PLAN_MUTATIONS_MAX])
{
	char text[PLAN_MUTATIONS_MAX];
	struct text t = {text, sizeof text};
	struct error e;
	for (int i = 0, k = 0; i < n; i++)
		if (entry[i].weight > 0)
			text_appendf(&t, "%s%s=%.4g", k++ ? "," : "", entry[i].name, entry[i].weight);
	return t.remaining > 1 && render_canonical_mutations(text, p->scene, out, &e) == 0;
}

static double independent_share(const struct weighted_strategy *entry, int n)
{
	double total = 0, independent = 0;
	for (int i = 0; i < n; i++) {
		total += entry[i].weight;
		independent += entry[i].is_independent ? entry[i].weight : 0;
	}
	return total > 0 ? independent / total : 0;
}

static void sweep_independent_share(struct planner *p)
{
	static const double shares[] = {0.01, 0.03, 0.06, 0.2, 0.4, 0.7};
	struct weighted_strategy base[PLAN_STRATEGIES_MAX];
	int n = read_entries(p->base->mixture, base);
	double current = independent_share(base, n);
	char value[48];
	if (!(current > 0 && current < 1)) {
		skip_parameter(p, SHARE, "the mixture has no other proposals, or none that are independent");
		return;
	}
	struct accuracy_sweep *s =
		new_sweep(p, SHARE, "Share of independent proposals, which find new light and estimate the brightness");
	bool placed = false;
	for (size_t k = 0; s && k < sizeof shares / sizeof *shares; k++) {
		struct weighted_strategy changed[PLAN_STRATEGIES_MAX];
		char mixture[PLAN_MUTATIONS_MAX];
		if (fabs(log(shares[k] / current)) < 0.2)
			continue;
		if (!placed && current < shares[k]) {
			snprintf(value, sizeof value, "%.2g", current);
			placed = add_value(s, value, ACCURACY_DEFAULT);
		}
		for (int i = 0; i < n; i++) {
			changed[i] = base[i];
			changed[i].weight *=
				base[i].is_independent ? shares[k] / current : (1 - shares[k]) / (1 - current);
		}
		snprintf(value, sizeof value, "%.2g", shares[k]);
		struct accuracy_setting *setting =
			print_entries(p, changed, n, mixture) ? add_swept_setting(p, s, value) : NULL;
		if (setting)
			memcpy(setting->mixture, mixture, sizeof mixture);
	}
	snprintf(value, sizeof value, "%.2g", current);
	if (s && !placed)
		add_value(s, value, ACCURACY_DEFAULT);
}

static void try_mixture(struct planner *p, struct accuracy_sweep *s, const struct weighted_strategy *entry, int n,
			const char *value)
{
	char mixture[PLAN_MUTATIONS_MAX];
	if (n > PLAN_STRATEGIES_MAX || !print_entries(p, entry, n, mixture) || strcmp(mixture, p->base->mixture) == 0)
		return;
	struct accuracy_setting *setting = add_swept_setting(p, s, value);
	if (setting)
		memcpy(setting->mixture, mixture, sizeof mixture);
}

/* Adds mixtures with one strategy removed, for each that is present and has less than half of the weight, and with one
 * added, for each that is absent and has an effect in this scene. */
static void sweep_mixture(struct planner *p)
{
	struct weighted_strategy base[PLAN_STRATEGIES_MAX], changed[PLAN_STRATEGIES_MAX + 1];
	int n = read_entries(p->base->mixture, base);
	const char *name, *summary;
	char value[48];
	struct accuracy_sweep *s = new_sweep(
		p, MIXTURE,
		"Strategies that propose mutations: one removed, or one added (a fifth of the others' weight)");
	if (!s)
		return;
	add_value(s, "default", ACCURACY_DEFAULT);
	double total = 0;
	for (int i = 0; i < n; i++)
		total += base[i].weight;
	for (int i = 0; i < n; i++) {
		memcpy(changed, base, sizeof base);
		changed[i].weight = 0;
		snprintf(value, sizeof value, "without %.31s", base[i].name);
		if (!base[i].is_independent && base[i].weight < 0.5 * total)
			try_mixture(p, s, changed, n, value);
	}
	for (size_t k = 0; (name = render_mutation_at(k, &summary)) != NULL; k++) {
		bool is_excluded = strcmp(name, "independent") == 0 ||
				   (strcmp(name, "wavelength") == 0 && !render_effect_is_on(p->scene, "colour")) ||
				   (strcmp(name, "lens") == 0 && !render_effect_is_on(p->scene, "aperture"));
		for (int i = 0; i < n; i++)
			is_excluded |= strcmp(base[i].name, name) == 0;
		if (is_excluded)
			continue;
		memcpy(changed, base, sizeof base);
		changed[n] = (struct weighted_strategy){.weight = 0.2 * total};
		text_copy(changed[n].name, sizeof changed[n].name, name);
		snprintf(value, sizeof value, "with %.31s", name);
		try_mixture(p, s, changed, n + 1, value);
	}
}

static void sweep_presets(struct planner *p)
{
	struct accuracy_sweep *s = new_sweep(p, PRESET, "Several settings at once");
	for (size_t i = 0; s && i < sizeof presets / sizeof *presets; i++) {
		char text[2 * PLAN_ACCURACY_MAX], accuracy[PLAN_ACCURACY_MAX];
		snprintf(text, sizeof text, "%s%s%s", p->base->accuracy, *p->base->accuracy ? "," : "",
			 presets[i].accuracy);
		struct accuracy_setting *setting = accuracy_settings_canonicalize(text, accuracy, p->e) == 0
							   ? add_swept_setting(p, s, presets[i].name)
							   : NULL;
		if (setting)
			memcpy(setting->accuracy, accuracy, sizeof accuracy);
	}
	if (s) {
		add_value(s, "default", ACCURACY_DEFAULT);
		struct accuracy_setting *reference = add_swept_setting(p, s, "careful");
		if (reference)
			memcpy(reference->accuracy, p->design->settings[ACCURACY_REFERENCE].accuracy,
			       sizeof reference->accuracy);
	}
}

static void add_reference(struct planner *p)
{
	struct accuracy_setting *s = new_setting(p, "reference", "");
	s->time_share = ACCURACY_REFERENCE_SHARE;
	for (size_t i = 0; i < sizeof reference_values / sizeof *reference_values; i++) {
		const struct render_setting *k = find_setting(reference_values[i].parameter);
		char accuracy[PLAN_ACCURACY_MAX];
		if (k && !no_effect_reason(p, k) &&
		    set_value(s->accuracy, reference_values[i].parameter, reference_values[i].value, accuracy))
			memcpy(s->accuracy, accuracy, sizeof accuracy);
	}
}

/* Returns the i-th name that --parameters accepts; NULL after the last. */
static const char *parameter_at(size_t i)
{
	static const char *const extra_names[] = {DEPTH, SHARE, MIXTURE, PRESET};
	enum { OWN = sizeof extra_names / sizeof *extra_names };
	const struct render_setting *k = i < OWN ? NULL : render_setting_at(i - OWN);
	return i < OWN ? extra_names[i] : k ? k->name : NULL;
}

static int check_parameters(struct planner *p)
{
	char name[32], hint[128], names[300];
	const char *parameter;
	for (const char *at = p->parameters; at && *at;) {
		size_t n = strcspn(at, ",");
		struct spelling s = {.wanted_name = name};
		bool found = false;
		*names = 0;
		snprintf(name, sizeof name, "%.*s", (int)(n < sizeof name ? n : sizeof name - 1), at);
		for (size_t i = 0; (parameter = parameter_at(i)) != NULL; i++) {
			found |= strcmp(name, parameter) == 0;
			spelling_offer(&s, parameter);
			spelling_append_to_list(names, sizeof names, parameter);
		}
		if (!found)
			return error_set(p->e, EINVAL, "there is no parameter '%s'%s; there are %s", name,
					 spelling_hint(&s, hint, sizeof hint), names);
		at += n + (at[n] == ',');
	}
	return 0;
}

int accuracy_make_design(struct accuracy_design *d, const struct plan_request *base, const struct render_summary *scene,
			 const char *parameters, struct error *e)
{
	struct planner p = {d, base, scene, render_integrator_find(base->integrator), parameters, e};
	int rc = check_parameters(&p);
	if (rc)
		return rc;
	*d = (struct accuracy_design){.count = 0};
	new_setting(&p, "default", "");
	add_reference(&p);
	const struct render_setting *k;
	for (size_t i = 0; (k = render_setting_at(i)) != NULL; i++) {
		const char *reason = no_effect_reason(&p, k);
		if (!is_listed(parameters, k->name))
			continue;
		if (reason)
			skip_parameter(&p, k->name, reason);
		else
			sweep_setting(&p, k);
	}
	if (is_listed(parameters, DEPTH))
		sweep_depth(&p);
	if (!p.integrator->has_mutations) {
		skip_parameter(&p, SHARE, "the integrator has no mixture of strategies");
		skip_parameter(&p, MIXTURE, "the integrator has no mixture of strategies");
		return 0;
	}
	if (is_listed(parameters, SHARE))
		sweep_independent_share(&p);
	if (is_listed(parameters, MIXTURE))
		sweep_mixture(&p);
	if (is_listed(parameters, PRESET))
		sweep_presets(&p);
	return 0;
}

void accuracy_setting_name(const struct accuracy_setting *s, char *text, size_t size)
{
	struct text t = {text, size};
	text_appendf(&t, "%s%s%s", s->parameter, *s->value ? " " : "", s->value);
}
