/* SPDX-License-Identifier: Apache-2.0 */
/*
 * maker_make_node finds the plug-in of an object by its type, makes the node, and has fill_node read its contents:
 * read_property reads parameters, and read_object reads nested or referenced objects, for which it calls
 * maker_make_node in turn. An element is made into a node once; later references share the node.
 *
 * Failures: a problem is reported and reading goes on. With `is_lenient`, what is not supported is left out or
 * replaced, with a note. Circular references are an error, and the depth and number of objects are limited (nesting.h).
 */
#include "worker/render/scene/maker.h"

#include "worker/render/scene/animation.h"
#include "worker/render/gltf/gltf.h"
#include "worker/render/scene/lenient.h"
#include "worker/render/scene/nesting.h"
#include "worker/render/scene/old_values.h"
#include "worker/render/scene/limit_to_one.h"
#include "worker/render/scene/param_check.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/scene/refuse.h"
#include "worker/render/scene/difference_notes.h"
#include "worker/render/text/snake_case.h"
#include "worker/render/scene/substitute.h"
#include "worker/render/scene/transform.h"
#include "worker/render/scene/value.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* A node while it is being made: its lists, constant afterwards, still grow. */
struct draft {
	struct scene_node *node;
	const struct plugin_decl *decl;
	bool is_stand_in;   /* replaces a plug-in that is not supported */
	bool lacks_content; /* something inside it is missing: left out, or already reported as a problem */
	bool may_be_flawed; /* something that decides whether the object itself is sound is missing or wrong */
	bool is_flat;	    /* its transform has no inverse */
	struct property *properties;
	const struct scene_node **children;
	struct xml_nesting nesting;
};

int maker_out_of_memory(struct maker *m)
{
	return error_set(m->error, ENOMEM, "out of memory, or the scene files take more than %d MB of it",
			 XML_MEMORY_MAX >> 20);
}

int maker_add_asset(struct maker *m, const char *name, const struct xml_element *element)
{
	return asset_list_add(&m->assets, name, element, m->arena) ? maker_out_of_memory(m) : 0;
}

static const char *property_name(struct maker *m, const struct xml_element *el, const char *name)
{
	if (!el->is_camel_case)
		return name;
	char *snake = arena_alloc(m->arena, 2 * strlen(name) + 1, 1);
	if (snake)
		snake_case_from_camel(name, snake);
	return snake;
}

static int add_property(struct maker *m, struct draft *d, const struct xml_element *el, const struct param *p,
			struct value v)
{
	int r = param_check(el, p, &v, m->error);
	if (r == -ERANGE && limit_to_one_applies(d->node->cls, p, &v)) {
		const struct error why = *m->error;
		return error_set(m->error, ERANGE, "%s%s", why.text, OVER_ONE_HINT);
	}
	if (r)
		return r;
	const struct property *previous = node_find_property(d->node, p->name);
	if (previous && el->is_camel_case)
		return resolve_second_value(&m->notes, d->decl, el, &d->properties[previous - d->node->properties], v);
	if (previous)
		return refuse_second_value(el, previous, m->error);
	d->properties[d->node->property_count++] = (struct property){p->name, el->line, v};
	return 0;
}

/* Returns whether another plug-in of the class has the parameter, by this name or converted from 0.6's camelCase. */
static bool belongs_to_other_plugin(const struct maker *m, enum plugin_class cls, const char *name)
{
	char snake[128] = "";
	if (strlen(name) < sizeof snake / 2)
		snake_case_from_camel(name, snake);
	for (const struct plugin_decl *other = m->decls; other->type; other++)
		if (other->cls == cls && (plugin_find_param(other, name) || plugin_find_param(other, snake)))
			return true;
	return false;
}

/* Returns whether an unknown name is taken for a parameter of some fork of Mitsuba, which is ignored, and not for a
 * mistake. It must not resemble a parameter that has an effect and, in 3.x, no other plug-in of the class may have it.
 * In files of 0.6 an object may have kept parameters of a type that it had before. The parameters of materials,
 * textures, media and filters show in the image; so in 3.x a name counts as a mistake there not only if it may be
 * misspelt, but whenever it may mean one of the table (refuse_guess_parameter), and if the object comes from a glTF
 * file or stands in for another plug-in. */
static bool is_foreign_parameter(const struct maker *m, const struct draft *d, const struct xml_element *el,
				 const char *name)
{
	enum plugin_class cls = d->node->cls;
	bool has_no_visible_params =
		cls == PLUGIN_SENSOR || cls == PLUGIN_FILM || cls == PLUGIN_SHAPE || cls == PLUGIN_EMITTER;
	/* In Mitsuba 3 a shape may hold textures of any name, which others read as its attributes. */
	bool may_be_attribute =
		cls == PLUGIN_SHAPE && (strcmp(el->name, "texture") == 0 || strcmp(el->name, "ref") == 0);
	if (!value_is_element(el->name) && !(may_be_attribute && !el->is_camel_case))
		return false;
	if (!el->is_camel_case && !has_no_visible_params && (gltf_is_file_name(el->file) || d->is_stand_in))
		return false;
	struct spelling s = {.wanted_name = name};
	plugin_offer_params(d->decl, &s);
	const struct param *meant = s.best_match ? plugin_find_param(d->decl, s.best_match)
				    : has_no_visible_params || el->is_camel_case
					    ? NULL
					    : refuse_guess_parameter(d->decl, name);
	if (!meant)
		return el->is_camel_case || !belongs_to_other_plugin(m, cls, name);
	return meant->status == PARAM_IGNORED;
}

/* Everything but a few parameters of an integrator or a sampler is ignored. A name that resembles one of these may be a
 * misspelling of it, which is noted. */
static int note_similar_name(const struct maker *m, const struct draft *d, const struct xml_element *owner,
			     const struct xml_element *el, const char *name)
{
	struct spelling s = {.wanted_name = name};
	char hint[128], text[192];
	plugin_offer_params(d->decl, &s);
	if (!s.best_match)
		return 0;
	snprintf(text, sizeof text, "is not known and is ignored%s", spelling_hint(&s, hint, sizeof hint));
	return note_parameter(&m->notes, owner, el, element_written_name(el, name), text);
}

/* Looks up a name in the table. *p is its parameter, or NULL if nothing more is to be done: it was ignored, or is an
 * error. */
static int look_up_param(struct maker *m, const struct draft *d, const struct xml_element *owner,
			 const struct xml_element *el, const char *name, const struct param **p)
{
	const char *new_name = el->is_camel_case ? plugin_current_param_name(d->decl, name) : name;
	const struct param *found =
		plugin_find_param(d->decl, d->is_stand_in ? lenient_param_name(d->decl->type, new_name) : new_name);
	const char *written = element_written_name(el, name);
	int r = 0;
	*p = NULL;
	if (d->decl->status == PARAM_IGNORED) {
		*p = found && found->status == PARAM_UNDERSTOOD ? found : NULL;
		return *p || !value_is_element(el->name) ? 0 : note_similar_name(m, d, owner, el, name);
	}
	if (!found && m->is_lenient && (found = lenient_old_param(d->decl, d->is_stand_in, el, name)))
		r = note_old_name(&m->notes, owner, el, found->name);
	/* In 0.6 every BSDF has this parameter; those whose reflectances can add up to more than 1 have it in their
	 * tables. */
	if (!found && el->is_camel_case && d->node->cls == PLUGIN_BSDF &&
	    strcmp(name, "ensure_energy_conservation") == 0)
		return note_no_effect(&m->notes, owner, el, written);
	if (!found && is_foreign_parameter(m, d, el, name))
		return note_parameter(&m->notes, owner, el, written, "is not known and is ignored");
	if (found && d->is_stand_in && lenient_is_redundant_param(d->decl->type, found->name, owner))
		return note_parameter(&m->notes, owner, el, written,
				      "is left out, because the index of refraction says the same (lenient)");
	if ((!found || found->status == PARAM_REFUSED) && m->is_lenient)
		return note_left_out(&m->notes, el, xml_attribute_value(owner, "type"), written, "the parameter");
	if (!found || found->status == PARAM_REFUSED)
		return refuse_property(d->decl, d->node->type, el, name, found, m->error);
	if (found->status == PARAM_IGNORED)
		return note_no_effect(&m->notes, owner, el, written);
	if ((found->types & VALUE_DIALECT_3_ONLY) && !m->tree->is_dialect_3)
		return note_parameter(&m->notes, owner, el, written,
				      "is not a parameter of Mitsuba 0.6 and is ignored, as there");
	if (found->status == PARAM_DIFFERS)
		return note_difference(&m->notes, owner, el, written);
	*p = found;
	return r;
}

/* Replaces a value that Mitsuba, or a lenient reader, reads as another one. A value above 1 is not replaced in a
 * stand-in: the replaced plug-in may have the parameter in other units, so that the caller leaves the value out. */
static int adjust_value(struct maker *m, const struct draft *d, const struct xml_element *owner,
			const struct xml_element *el, const struct param *p, struct value *v)
{
	enum plugin_class cls = d->node->cls;
	int r = el->is_camel_case ? old_values_adapt(&m->notes, owner, el, p, cls, m->arena, v) : 0;
	if (!r && (p->types & VALUE_CLAMPED))
		return clip_value(&m->notes, owner, el, p, v);
	return !r && m->is_lenient && !d->is_stand_in ? limit_value_to_one(&m->notes, owner, el, cls, p, m->arena, v)
						      : r;
}

static int read_property(struct maker *m, struct draft *d, const struct xml_element *owner,
			 const struct xml_element *el)
{
	const char *written = xml_attribute_value(el, "name");
	const struct animation *animation = NULL;
	if (!written)
		return element_refuse_missing_attribute(el, "name", m->error);
	bool is_unset = element_is_unset(el);
	if (is_unset && (strchr(written, '$') || strcmp(el->name, "animation") == 0))
		return REPORT_ALREADY_REPORTED;
	if (strcmp(el->name, "animation") == 0) {
		const struct xml_element *outer = el;
		int r = animation_read(&el, m->arena, &animation, m->error);
		if (r)
			return transform_report(outer, r, &m->report, m->error);
		written = strcmp(written, "animation") == 0 ? "to_world" : written;
	}
	const char *name = property_name(m, el, written);
	if (!name)
		return maker_out_of_memory(m);
	const struct param *p;
	int r = look_up_param(m, d, owner, el, name, &p);
	if (r || !p || is_unset)
		return r || !p ? r : REPORT_ALREADY_REPORTED;
	struct value v;
	r = value_read(el, m->asset_source, m->arena, &v, m->error);
	if (!r)
		r = adjust_value(m, d, owner, el, p, &v);
	if (!r && v.type == VALUE_TRANSFORM)
		v.animation = animation;
	if (!r)
		r = add_property(m, d, el, p, v);
	bool is_untranslatable = d->is_stand_in && (r == -EINVAL || r == -ERANGE);
	if (is_untranslatable || (r == -EINVAL && m->is_lenient && p->choices))
		return note_left_out(&m->notes, el, written, xml_attribute_value(el, "value"), "the value");
	if (r)
		return transform_report(el, r, &m->report, m->error);
	if (!r && v.type == VALUE_STRING && strcmp(p->name, "filename") == 0)
		r = *v.as.string ? maker_add_asset(m, v.as.string, owner)
				 : xml_error(el, m->error, EINVAL, "an empty file name");
	mat4 inverse;
	bool is_flat = !r && v.type == VALUE_TRANSFORM && d->node->cls == PLUGIN_SHAPE &&
		       !mat4_invert(v.as.transform, &inverse);
	d->is_flat |= is_flat;
	if (is_flat && !m->is_lenient)
		r = xml_error(owner, m->error, EINVAL,
			      "%s flattens the shape (it has no inverse): line %d; --lenient leaves it out", written,
			      el->line);
	const char *file = v.type == VALUE_SPECTRUM ? xml_attribute_value(el, "filename") : NULL;
	return r || !file ? r : maker_add_asset(m, file, el);
}

/* Adds a child of its class; target: the element that the child was made from. */
static int add_child(struct maker *m, struct draft *d, const struct xml_element *owner, const struct xml_element *el,
		     const struct xml_element *target, const struct scene_node *child)
{
	enum plugin_class cls;
	plugin_class_find(target->name, &cls);
	const char *written = xml_attribute_value(el, "name");
	bool allows_many = d->node->cls == cls && (cls == PLUGIN_BSDF || cls == PLUGIN_SHAPE || cls == PLUGIN_SENSOR ||
						   cls == PLUGIN_INTEGRATOR || cls == PLUGIN_PHASE);
	bool is_second = !allows_many && node_child(d->node, cls, 0);
	if (is_second && d->is_stand_in)
		return note_left_out(&m->notes, el, d->node->type, written ? written : target->name,
				     "a second object,");
	if (is_second)
		return xml_error(el, m->error, EINVAL, "a second %s in <%s type=\"%.64s\">, which may have one",
				 plugin_class_name(cls), owner->name, d->node->type);
	d->children[d->node->child_count++] = child;
	d->node->emits_light |= child->emits_light;
	return 0;
}

/* Mitsuba 3 ignores the media of a shape that are not parameters. */
static bool is_unused_medium(const struct maker *m, const struct draft *d, enum plugin_class cls)
{
	return cls == PLUGIN_MEDIUM && d->node->cls == PLUGIN_SHAPE && m->tree->is_dialect_3;
}

/* Reads an object nested in another or referred to there: a parameter if the table has its name, or else a child. */
static int read_object(struct maker *m, struct draft *d, const struct xml_element *owner, const struct xml_element *el,
		       struct xml_element *target)
{
	enum plugin_class cls;
	bool is_class = plugin_class_find(target->name, &cls);
	assert(is_class);
	if (cls == PLUGIN_MEDIUM && d->node->cls == PLUGIN_EMITTER) /* the world finds the medium it is in */
		return 0;
	const char *written = xml_attribute_value(el, "name");
	const struct param *p = NULL;
	bool is_nested = d->decl->nested_classes >> cls & 1;
	if (written) {
		const char *name = property_name(m, el, written);
		if (!name)
			return maker_out_of_memory(m);
		const struct param *found = plugin_find_param(d->decl, name);
		if (!found && is_unused_medium(m, d, cls) && d->decl->status != PARAM_IGNORED)
			return note_unused_medium(&m->notes, el);
		if (found || !is_nested) {
			int r = look_up_param(m, d, owner, el, name, &p);
			if (r || !p)
				return r;
			is_nested = false;
		}
	}
	if (!p && !is_nested) {
		if (d->decl->status == PARAM_IGNORED)
			return 0;
		if (is_unused_medium(m, d, cls))
			return note_unused_medium(&m->notes, el);
		if (m->is_lenient)
			return note_left_out(&m->notes, el, plugin_class_name(cls), d->node->type, "its use in");
		return xml_error(el, m->error, EINVAL, "a %s%s has no place in <%s type=\"%.64s\">",
				 plugin_class_name(cls), written ? "" : " without a name", owner->name, d->node->type);
	}
	enum plugin_class colour_class = p && (p->types & VALUE_IS_VOLUME) ? PLUGIN_VOLUME : PLUGIN_TEXTURE;
	if (p && (p->types & VALUE_COLOR) && (p->types & VALUE_NODE) && cls != colour_class)
		return xml_error(el, m->error, EINVAL, "`%s` may be a %s, but not a %s",
				 element_written_name(el, p->name), plugin_class_name(colour_class),
				 plugin_class_name(cls));
	if (p && m->is_lenient && !(p->types & VALUE_NODE))
		return note_left_out(&m->notes, el, xml_attribute_value(owner, "type"),
				     element_written_name(el, p->name), "an object for the parameter");
	const struct scene_node *child;
	int r = maker_make_node(m, target, &child);
	bool is_shared = d->node->cls == PLUGIN_SHAPE && cls == PLUGIN_BSDF;
	if (!r && is_shared)
		r = nesting_add_to_scene(&m->object_count, target, m->error);
	if (!r)
		r = nesting_add(&d->nesting, d->node->cls, el, target, is_shared, m->error);
	if (r)
		return r == -E2BIG && m->is_resumed ? REPORT_ALREADY_REPORTED : r;
	if (p && (r = limit_texture_to_one(&m->notes, d->node->cls, p, m->is_lenient, m->arena, target, &child)))
		return r;
	if (p)
		return add_property(m, d, el, p, (struct value){.type = VALUE_NODE, .as.node = child});
	return add_child(m, d, owner, el, target, child);
}

int maker_reject_element(struct maker *m, const struct xml_element *el)
{
	return m->is_lenient ? note_left_out(&m->notes, el, el->name, "", "the element") : refuse_element(el, m->error);
}

static int read_content(struct maker *m, struct draft *d, const struct xml_element *owner, struct xml_element *el)
{
	enum plugin_class cls;
	if (el->is_ignored)
		return note_ignored_element(&m->notes, el);
	if (value_is_element(el->name))
		return read_property(m, d, owner, el);
	if (plugin_class_find(el->name, &cls))
		return read_object(m, d, owner, el, el);
	if (strcmp(el->name, "default") == 0)
		return 0;
	if (strcmp(el->name, "include") == 0 && el->is_unset)
		return REPORT_ALREADY_REPORTED;
	if (strcmp(el->name, "ref") != 0)
		return d->decl->status == PARAM_IGNORED ? 0 : maker_reject_element(m, el);
	if (d->decl->status == PARAM_IGNORED && !d->decl->nested_classes)
		return 0;
	struct xml_element *target;
	int r = element_check_contents(el, "id|name", false, m->error);
	if (!r)
		r = id_table_resolve(&m->ids, el, &target, m->error);
	if (!r && id_table_is_never_node(target)) /* has been reported where it stands */
		return REPORT_ALREADY_REPORTED;
	return r ? r : read_object(m, d, owner, el, target);
}

/* Refuses the motion of an object that cannot move; a lenient reader keeps the first transform instead. */
static int refuse_motion(struct maker *m, struct draft *d, const struct xml_element *el)
{
	for (uint32_t i = 0; i < d->node->property_count; i++) {
		struct value *v = &d->properties[i].value;
		const struct param *p = v->animation ? plugin_find_param(d->decl, d->properties[i].name) : NULL;
		const char *subject =
			p && (p->types & VALUE_ANIMATION) ? animation_unsupported_kind(d->node, el) : "this plug-in";
		if (!v->animation || !subject)
			continue;
		v->animation = NULL;
		return m->is_lenient ? note_left_out(&m->notes, el, d->node->type, "motion", "all but the start of the")
				     : xml_error(el, m->error, ENOTSUP,
						 "motion of %s is not supported (line %d); --lenient keeps the first "
						 "transform",
						 subject, d->properties[i].line);
	}
	return 0;
}

/* Returns whether the object may be refused merely because this element in it is missing or wrong. A shape, other
 * than an instance, is judged without its material and other objects. */
static bool decides_soundness(const struct scene_node *n, const struct xml_element *c)
{
	return n->cls != PLUGIN_SHAPE || strcmp(n->type, "instance") == 0 || value_is_element(c->name);
}

/* Returns whether the node holds a flawed one, as a shape with a flawed texture does: then it is flawed itself. */
static bool contains_flawed(const struct scene_node *n)
{
	bool considers_children = n->cls != PLUGIN_SHAPE || strcmp(n->type, "instance") == 0;
	for (uint32_t i = 0; i < n->property_count; i++)
		if (n->properties[i].value.type == VALUE_NODE && n->properties[i].value.as.node->is_flawed)
			return true;
	for (uint32_t i = 0; i < n->child_count && considers_children; i++)
		if (n->children[i]->is_flawed)
			return true;
	return false;
}

/* Marks the node as flawed and adds it to the scene's list of these. */
static int mark_flawed(struct maker *m, struct scene_node *n)
{
	uint32_t count = m->flawed_count;
	n->is_flawed = true;
	if ((count & (count - 1)) == 0) { /* 0 or a power of two: the list is full */
		const struct scene_node **grown = arena_alloc(m->arena, count ? 2 * (size_t)count : 1, sizeof *grown);
		if (!grown)
			return maker_out_of_memory(m);
		if (count)
			memcpy(grown, m->flawed, count * sizeof *grown);
		m->flawed = grown;
	}
	m->flawed[m->flawed_count++] = n;
	return 0;
}

static int fill_node(struct maker *m, struct draft *d, struct xml_element *el)
{
	size_t n = 0;
	for (const struct xml_element *c = el->first_child; c; c = c->next_sibling)
		n++;
	d->properties = arena_alloc(m->arena, n, sizeof *d->properties);
	d->children = arena_alloc(m->arena, n, sizeof *d->children);
	if (!d->properties || !d->children)
		return maker_out_of_memory(m);
	d->node->properties = d->properties;
	d->node->children = d->children;
	for (struct xml_element *c = el->first_child; c; c = c->next_sibling) {
		uint32_t problems_before = m->report.problem_count;
		int r = read_content(m, d, el, c);
		d->lacks_content |= r == REPORT_ALREADY_REPORTED;
		d->may_be_flawed |= (r || m->report.problem_count > problems_before) && decides_soundness(d->node, c);
		r = report_problem(&m->report, r, m->error);
		if (r)
			return r;
	}
	return 0;
}

/* Makes the node of `inner`, which stands in for el. */
static int make_stand_in(struct maker *m, struct xml_element *el, struct xml_element *inner,
			 const struct scene_node **out)
{
	el->is_in_progress = true;
	m->depth++;
	int r = maker_make_node(m, inner, out);
	m->depth--;
	el->is_in_progress = false;
	el->nesting = inner->nesting;
	return r;
}

/* Checks that the value of a parameter is well formed, in an object of unknown type. */
static int check_unknown_value(struct maker *m, const struct xml_element *el)
{
	const struct animation *animation;
	const struct xml_element *outer = el;
	struct value unused;
	if (element_is_unset(el))
		return REPORT_ALREADY_REPORTED;
	int r = strcmp(el->name, "animation") == 0 ? animation_read(&el, m->arena, &animation, m->error)
						   : value_read(el, m->asset_source, m->arena, &unused, m->error);
	return transform_report(outer, r, &m->report, m->error);
}

/* Reports the problems inside an object of unknown type: in its objects, such as the film of a sensor, in the names of
 * its elements, and in how its values are written. Which parameters it may have is not known, nor whether it may have
 * the elements of Mitsuba's that are not supported. */
static int check_contents(struct maker *m, struct xml_element *el)
{
	int r = 0;
	m->depth++;
	for (struct xml_element *c = el->first_child; c && !r; c = c->next_sibling) {
		enum plugin_class cls;
		const struct scene_node *unused;
		struct xml_element *target;
		bool is_unsupported = strcmp(c->name, "field") == 0 || strcmp(c->name, "subsurface") == 0;
		if (c->is_ignored || is_unsupported || strcmp(c->name, "default") == 0)
			continue;
		if (plugin_class_find(c->name, &cls))
			r = maker_make_node(m, c, &unused);
		else if (strcmp(c->name, "ref") == 0)
			r = id_table_resolve(&m->ids, c, &target, m->error);
		else if (value_is_element(c->name))
			r = check_unknown_value(m, c);
		else if (strcmp(c->name, "include") != 0 || !c->is_unset)
			r = maker_reject_element(m, c);
		r = report_problem(&m->report, r, m->error);
	}
	m->depth--;
	return r ? r : REPORT_ALREADY_REPORTED;
}

/* Reports the problems inside an object of unknown type as if it were of the nearest type, and makes no node. */
static int check_contents_as(struct maker *m, struct xml_element *el, const struct plugin_decl *decl)
{
	struct scene_node node = {
		.cls = decl->cls, .type = decl->type, .file = el->file, .line = el->line, .decl = decl};
	struct draft d = {.node = &node, .decl = decl, .nesting = {.height = 1, .object_count = 1}};
	el->is_in_progress = true;
	m->depth++;
	int r = fill_node(m, &d, el);
	m->depth--;
	el->is_in_progress = false;
	return r ? r : REPORT_ALREADY_REPORTED;
}

/* Reports that an object is refused, and the problems inside it. */
static int report_refused(struct maker *m, struct xml_element *el, enum plugin_class cls, const char *type, int code)
{
	if (code >= 0 || (code = report_problem(&m->report, code, m->error)))
		return code;
	const struct plugin_decl *meant = refuse_guess_type(m->decls, el, cls, type);
	return meant ? check_contents_as(m, el, meant) : check_contents(m, el);
}

/* Fills in d's node from el's contents, and records whether it may be flawed. */
static int fill_draft(struct maker *m, struct draft *d, struct xml_element *el)
{
	el->is_in_progress = true;
	m->depth++;
	int r = fill_node(m, d, el);
	if (!r)
		r = report_problem(&m->report, refuse_motion(m, d, el), m->error);
	if (!r && (d->may_be_flawed || contains_flawed(d->node)))
		r = mark_flawed(m, d->node);
	m->depth--;
	el->is_in_progress = false;
	el->nesting = d->nesting;
	return r;
}

/* Adds the remarks on a complete node and makes a lenient reader's replacements, which may change *out. */
static int finish_node(struct maker *m, const struct draft *d, struct xml_element *el, const struct scene_node **out)
{
	if (d->is_flat && m->is_lenient) {
		if (m->flat_shape_count++ == 0)
			m->first_flat_shape = el;
		return REPORT_ALREADY_REPORTED;
	}
	int r = note_object_differences(d->node, &m->report, m->error);
	if (!r && m->is_lenient && (r = substitute_medium(&m->notes, el, d->lacks_content, d->node)))
		return r;
	if (!r && m->is_lenient && !m->tree->is_dialect_3 && (r = substitute_volume(&m->notes, el, d->node)))
		return r;
	if (!r && m->is_lenient &&
	    (r = substitute_cover(&m->notes, el, d->lacks_content, out)) == REPORT_ALREADY_REPORTED)
		return r;
	el->node = *out;
	return r;
}

/* Refuses an element that refers to itself, was refused before, or lies too deep. */
static int check_can_make(struct maker *m, struct xml_element *el)
{
	if (el->is_in_progress)
		return xml_error(el, m->error, ELOOP, "refers to itself");
	if (el->is_rejected)
		return REPORT_ALREADY_REPORTED;
	if (m->depth == 0)
		m->is_resumed = el->is_too_deep;
	if (m->depth >= XML_DEPTH_MAX) {
		bool is_reported = el->is_too_deep || m->is_resumed;
		el->is_too_deep = true;
		return is_reported ? REPORT_ALREADY_REPORTED
				   : xml_error(el, m->error, ELOOP, "objects refer to each other more than %d deep",
					       XML_DEPTH_MAX);
	}
	return 0;
}

/* An object with errors inside still becomes a node, so that all errors are found. An element that cannot become a
 * node, for example because its type is unknown, is reported once. */
int maker_make_node(struct maker *m, struct xml_element *el, const struct scene_node **out)
{
	if (el->node) {
		*out = el->node;
		return 0;
	}
	int r = check_can_make(m, el);
	if (r)
		return r;
	el->is_rejected = true; /* reset on success */
	enum plugin_class cls;
	plugin_class_find(el->name, &cls);
	bool is_included = el->parent && strcmp(el->parent->name, "include") == 0;
	r = element_check_contents(el, is_included || m->tree->is_dialect_3 ? "type|id|name|version" : "type|id|name",
				   true, m->error);
	if (r)
		return r;
	const char *type = xml_attribute_value(el, "type");
	if (!type)
		return element_refuse_missing_attribute(el, "type", m->error);
	if (el->is_unset && strchr(type, '$'))
		return REPORT_ALREADY_REPORTED;
	const struct plugin_decl *decl = plugin_find(m->decls, cls, type);
	bool is_stand_in = !decl;
	struct xml_element *inner = NULL;
	if (!decl && !m->is_lenient)
		return report_refused(m, el, cls, type, refuse_type(m->decls, el, cls, type, m->error));
	if (!decl && (r = substitute_plugin(&m->notes, m->decls, &m->ids, el, cls, &type, &decl, &inner)))
		return report_refused(m, el, cls, type, r);
	if (inner) {
		r = make_stand_in(m, el, inner, out);
		el->node = r ? NULL : *out;
		return r;
	}
	if (strcasecmp(type, decl->type) == 0)
		type = decl->type;
	if (decl->status == PARAM_IGNORED && (r = note_ignored_plugin(&m->notes, el, decl)))
		return r;
	const struct plugin_decl *named_decl = decl;
	if (m->is_lenient && (r = substitute_missing_file(&m->notes, m->asset_source, m->decls, el, &type, &decl)))
		return r;
	struct draft d = {.node = arena_alloc(m->arena, 1, sizeof *d.node),
			  .decl = decl,
			  .is_stand_in = is_stand_in || decl != named_decl,
			  .nesting = {.height = 1, .object_count = 1}};
	if (!d.node)
		return maker_out_of_memory(m);
	*d.node = (struct scene_node){.cls = cls,
				      .type = type,
				      .id = xml_attribute_value(el, "id"),
				      .file = el->file,
				      .line = el->line,
				      .decl = decl,
				      .emits_light = cls == PLUGIN_EMITTER};
	r = fill_draft(m, &d, el);
	*out = d.node;
	if (!r)
		return finish_node(m, &d, el, out);
	el->node = *out;
	return r;
}
