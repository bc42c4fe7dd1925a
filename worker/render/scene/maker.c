/* SPDX-License-Identifier: Apache-2.0 */
/*
 * maker_node finds the plug-in of an object by its type, makes the node, and has fill_node read its contents:
 * read_property reads parameters, and read_object reads nested or referenced objects, for which it calls maker_node in
 * turn. An element is made into a node once; later references share the node.
 *
 * Failures: a problem is reported and reading goes on. With `lenient`, what is not supported is left out or replaced,
 * with a note. Circular references are an error, and the depth and number of objects are limited (nesting.h).
 */
#include "worker/render/scene/maker.h"

#include "worker/render/scene/animation.h"
#include "worker/render/gltf/gltf.h"
#include "worker/render/scene/lenient.h"
#include "worker/render/scene/nesting.h"
#include "worker/render/scene/old_values.h"
#include "worker/render/scene/over_one.h"
#include "worker/render/scene/param_check.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/scene/refuse.h"
#include "worker/render/scene/remarks.h"
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
	bool stands_in; /* replaces a plug-in that is not supported */
	bool lacks;	/* something inside it is missing: left out, or already reported as a problem */
	bool unsure;	/* something that decides whether the object itself is sound is missing or wrong */
	bool flat;	/* its transform has no inverse */
	struct property *properties;
	const struct scene_node **children;
	struct xml_nesting nesting;
};

int maker_out_of_memory(struct maker *m)
{
	return error_set(m->error, ENOMEM, "out of memory, or the scene files take more than %d MB of it",
			 XML_MEMORY_MAX >> 20);
}

int maker_add_asset(struct maker *m, const char *name, const struct xml_element *by)
{
	return asset_list_add(&m->assets, name, by, m->arena) ? maker_out_of_memory(m) : 0;
}

static const char *property_name(struct maker *m, const struct xml_element *el, const char *name)
{
	if (!el->snake)
		return name;
	char *snake = arena_alloc(m->arena, 2 * strlen(name) + 1, 1);
	if (snake)
		snake_case(name, snake);
	return snake;
}

static int add_property(struct maker *m, struct draft *d, const struct xml_element *el, const struct param *p,
			struct value v)
{
	int r = param_check(el, p, &v, m->error);
	if (r == -ERANGE && over_one(d->node->cls, p, &v)) {
		const struct error why = *m->error;
		return error_set(m->error, ERANGE, "%s%s", why.text, OVER_ONE_HINT);
	}
	if (r)
		return r;
	const struct property *before = node_find(d->node, p->name);
	if (before && el->snake)
		return given_again(&m->notes, d->decl, el, &d->properties[before - d->node->properties], v);
	if (before)
		return given_twice(el, before, m->error);
	d->properties[d->node->property_count++] = (struct property){p->name, el->line, v};
	return 0;
}

/* Returns whether another plug-in of the class has the parameter, by this name or converted from 0.6's camelCase. */
static bool is_of_another(const struct maker *m, enum plugin_class cls, const char *name)
{
	char snake[128] = "";
	if (strlen(name) < sizeof snake / 2)
		snake_case(name, snake);
	for (const struct plugin_decl *other = m->decls; other->type; other++)
		if (other->cls == cls && (plugin_param(other, name) || plugin_param(other, snake)))
			return true;
	return false;
}

/* Returns whether an unknown name is taken for a parameter of some fork of Mitsuba, which is ignored, and not for a
 * mistake. It must not resemble a parameter that has an effect and, in 3.x, no other plug-in of the class may have it.
 * In files of 0.6 an object may have kept parameters of a type that it had before. The parameters of materials,
 * textures, media and filters show in the image; so in 3.x a name counts as a mistake there not only if it may be
 * misspelt, but whenever it may mean one of the table (meant_parameter), and if the object comes from a glTF file or
 * stands in for another plug-in. */
static bool is_foreign_parameter(const struct maker *m, const struct draft *d, const struct xml_element *el,
				 const char *name)
{
	enum plugin_class cls = d->node->cls;
	bool hidden = cls == PLUGIN_SENSOR || cls == PLUGIN_FILM || cls == PLUGIN_SHAPE || cls == PLUGIN_EMITTER;
	/* In Mitsuba 3 a shape may hold textures of any name, which others read as its attributes. */
	bool attribute = cls == PLUGIN_SHAPE && (strcmp(el->name, "texture") == 0 || strcmp(el->name, "ref") == 0);
	if (!value_is_element(el->name) && !(attribute && !el->snake))
		return false;
	if (!el->snake && !hidden && (gltf_is(el->file) || d->stands_in))
		return false;
	struct spelling s = {.wanted = name};
	plugin_offer_params(d->decl, &s);
	const struct param *meant = s.best		  ? plugin_param(d->decl, s.best)
				    : hidden || el->snake ? NULL
							  : meant_parameter(d->decl, name);
	if (!meant)
		return el->snake || !is_of_another(m, cls, name);
	return meant->status == PARAM_IGNORED;
}

/* Everything but a few parameters of an integrator or a sampler is ignored. A name that resembles one of these may be a
 * misspelling of it, which is noted. */
static int note_resembling(const struct maker *m, const struct draft *d, const struct xml_element *owner,
			   const struct xml_element *el, const char *name)
{
	struct spelling s = {.wanted = name};
	char hint[128], text[192];
	plugin_offer_params(d->decl, &s);
	if (!s.best)
		return 0;
	snprintf(text, sizeof text, "is not known and is ignored%s", spelling_hint(&s, hint, sizeof hint));
	return note_parameter(&m->notes, owner, el, element_spelling(el, name), text);
}

/* Looks up a name in the table. *p is its parameter, or NULL if nothing more is to be done: it was ignored, or is an
 * error. */
static int look_up(struct maker *m, const struct draft *d, const struct xml_element *owner,
		   const struct xml_element *el, const char *name, const struct param **p)
{
	const char *here = el->snake ? plugin_new_name(d->decl, name) : name;
	const struct param *found = plugin_param(d->decl, d->stands_in ? lenient_param(d->decl->type, here) : here);
	const char *written = element_spelling(el, name);
	int r = 0;
	*p = NULL;
	if (d->decl->status == PARAM_IGNORED) {
		*p = found && found->status == PARAM_UNDERSTOOD ? found : NULL;
		return *p || !value_is_element(el->name) ? 0 : note_resembling(m, d, owner, el, name);
	}
	if (!found && m->lenient && !el->snake && (found = lenient_old_param(d->decl, d->stands_in, el, name)))
		r = note_old_name(&m->notes, owner, el, found->name);
	/* In 0.6 every BSDF has this parameter; those whose reflectances can add up to more than 1 have it in their
	 * tables. */
	if (!found && el->snake && d->node->cls == PLUGIN_BSDF && strcmp(name, "ensure_energy_conservation") == 0)
		return note_no_effect(&m->notes, owner, el, written);
	if (!found && is_foreign_parameter(m, d, el, name))
		return note_parameter(&m->notes, owner, el, written, "is not known and is ignored");
	if (found && d->stands_in && lenient_says_again(d->decl->type, found->name, owner))
		return note_parameter(&m->notes, owner, el, written,
				      "is left out, because the index of refraction says the same (lenient)");
	if ((!found || found->status == PARAM_REFUSED) && m->lenient)
		return leave_out(&m->notes, el, xml_attribute(owner, "type"), written, "the parameter");
	if (!found || found->status == PARAM_REFUSED)
		return refuse_property(d->decl, d->node->type, el, name, found, m->error);
	if (found->status == PARAM_IGNORED)
		return note_no_effect(&m->notes, owner, el, written);
	if ((found->types & VALUE_OF_3) && !m->tree->dialect_3)
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
	int r = el->snake ? old_value(&m->notes, owner, el, p, cls, m->arena, v) : 0;
	if (!r && (p->types & VALUE_CLIPPED))
		return clip_value(&m->notes, owner, el, p, v);
	return !r && m->lenient && !d->stands_in ? over_one_value(&m->notes, owner, el, cls, p, m->arena, v) : r;
}

static int read_property(struct maker *m, struct draft *d, const struct xml_element *owner,
			 const struct xml_element *el)
{
	const char *written = xml_attribute(el, "name");
	const struct animation *animation = NULL;
	if (!written)
		return element_needs(el, "name", m->error);
	bool unset = element_is_unset(el);
	if (unset && (strchr(written, '$') || strcmp(el->name, "animation") == 0))
		return REPORT_TOLD;
	if (strcmp(el->name, "animation") == 0) {
		const struct xml_element *whole = el;
		int r = animation_read(&el, m->arena, &animation, m->error);
		if (r)
			return transform_report(whole, r, &m->report, m->error);
		written = strcmp(written, "animation") == 0 ? "to_world" : written;
	}
	const char *name = property_name(m, el, written);
	if (!name)
		return maker_out_of_memory(m);
	const struct param *p;
	int r = look_up(m, d, owner, el, name, &p);
	if (r || !p || unset)
		return r || !p ? r : REPORT_TOLD;
	struct value v;
	r = value_read(el, m->assets_from, m->arena, &v, m->error);
	if (!r)
		r = adjust_value(m, d, owner, el, p, &v);
	if (!r && v.type == VALUE_TRANSFORM)
		v.animation = animation;
	if (!r)
		r = add_property(m, d, el, p, v);
	bool strange = d->stands_in && (r == -EINVAL || r == -ERANGE);
	if (strange || (r == -EINVAL && m->lenient && p->choices))
		return leave_out(&m->notes, el, written, xml_attribute(el, "value"), "the value");
	if (r)
		return transform_report(el, r, &m->report, m->error);
	if (!r && v.type == VALUE_STRING && strcmp(p->name, "filename") == 0)
		r = *v.as.string ? maker_add_asset(m, v.as.string, owner)
				 : xml_error(el, m->error, EINVAL, "an empty file name");
	mat4 inverse;
	bool flat = !r && v.type == VALUE_TRANSFORM && d->node->cls == PLUGIN_SHAPE &&
		    !mat4_invert(v.as.transform, &inverse);
	d->flat |= flat;
	if (flat && !m->lenient)
		r = xml_error(owner, m->error, EINVAL,
			      "%s flattens the shape (it has no inverse): line %d; --lenient leaves it out", written,
			      el->line);
	const char *file = v.type == VALUE_SPECTRUM ? xml_attribute(el, "filename") : NULL;
	return r || !file ? r : maker_add_asset(m, file, el);
}

/* Adds a child of its class; target: the element that the child was made from. */
static int add_child(struct maker *m, struct draft *d, const struct xml_element *owner, const struct xml_element *el,
		     const struct xml_element *target, const struct scene_node *child)
{
	enum plugin_class cls;
	plugin_class_find(target->name, &cls);
	const char *written = xml_attribute(el, "name");
	bool many = d->node->cls == cls && (cls == PLUGIN_BSDF || cls == PLUGIN_SHAPE || cls == PLUGIN_SENSOR ||
					    cls == PLUGIN_INTEGRATOR || cls == PLUGIN_PHASE);
	bool second = !many && node_child(d->node, cls, 0);
	if (second && d->stands_in)
		return leave_out(&m->notes, el, d->node->type, written ? written : target->name, "a second object,");
	if (second)
		return xml_error(el, m->error, EINVAL, "a second %s in <%s type=\"%.64s\">, which may have one",
				 plugin_class_name(cls), owner->name, d->node->type);
	d->children[d->node->child_count++] = child;
	d->node->shines |= child->shines;
	return 0;
}

/* Reads an object that is nested in another or referred to there: as a parameter if the table has its name,
 * otherwise as a child of its class. */
static int read_object(struct maker *m, struct draft *d, const struct xml_element *owner, const struct xml_element *el,
		       struct xml_element *target)
{
	enum plugin_class cls;
	bool is_class = plugin_class_find(target->name, &cls);
	assert(is_class);
	if (cls == PLUGIN_MEDIUM && d->node->cls == PLUGIN_EMITTER) /* the world finds the medium it is in */
		return 0;
	const char *written = xml_attribute(el, "name");
	const struct param *p = NULL;
	bool nested = d->decl->nested_classes >> cls & 1;
	if (written) {
		const char *name = property_name(m, el, written);
		if (!name)
			return maker_out_of_memory(m);
		const struct param *found = plugin_param(d->decl, name);
		if (found || !nested) {
			int r = look_up(m, d, owner, el, name, &p);
			if (r || !p)
				return r;
			nested = false;
		}
	}
	if (!p && !nested) {
		if (d->decl->status == PARAM_IGNORED)
			return 0;
		if (m->lenient)
			return leave_out(&m->notes, el, plugin_class_name(cls), d->node->type, "its use in");
		return xml_error(el, m->error, EINVAL, "a %s%s has no place in <%s type=\"%.64s\">",
				 plugin_class_name(cls), written ? "" : " without a name", owner->name, d->node->type);
	}
	enum plugin_class colours = p && (p->types & VALUE_IN_SPACE) ? PLUGIN_VOLUME : PLUGIN_TEXTURE;
	if (p && (p->types & VALUE_COLOR) && (p->types & VALUE_NODE) && cls != colours)
		return xml_error(el, m->error, EINVAL, "`%s` may be a %s, but not a %s", element_spelling(el, p->name),
				 plugin_class_name(colours), plugin_class_name(cls));
	if (p && m->lenient && !(p->types & VALUE_NODE))
		return leave_out(&m->notes, el, xml_attribute(owner, "type"), element_spelling(el, p->name),
				 "an object for the parameter");
	const struct scene_node *child;
	int r = maker_node(m, target, &child);
	bool once = d->node->cls == PLUGIN_SHAPE && cls == PLUGIN_BSDF;
	if (!r && once)
		r = nesting_count(&m->objects, target, m->error);
	if (!r)
		r = nesting_take(&d->nesting, d->node->cls, el, target, once, m->error);
	if (r)
		return r == -E2BIG && m->resumed ? REPORT_TOLD : r;
	if (p && (r = over_one_texture(&m->notes, d->node->cls, p, m->lenient, m->arena, target, &child)))
		return r;
	if (p)
		return add_property(m, d, el, p, (struct value){.type = VALUE_NODE, .as.node = child});
	return add_child(m, d, owner, el, target, child);
}

int maker_foreign(struct maker *m, const struct xml_element *el)
{
	return m->lenient ? leave_out(&m->notes, el, el->name, "", "the element") : refuse_element(el, m->error);
}

static int read_content(struct maker *m, struct draft *d, const struct xml_element *owner, struct xml_element *el)
{
	enum plugin_class cls;
	if (el->ignored)
		return note_foreign(&m->notes, el);
	if (value_is_element(el->name))
		return read_property(m, d, owner, el);
	if (plugin_class_find(el->name, &cls))
		return read_object(m, d, owner, el, el);
	if (strcmp(el->name, "default") == 0)
		return 0;
	if (strcmp(el->name, "include") == 0 && el->unset)
		return REPORT_TOLD;
	if (strcmp(el->name, "ref") != 0)
		return d->decl->status == PARAM_IGNORED ? 0 : maker_foreign(m, el);
	if (d->decl->status == PARAM_IGNORED && !d->decl->nested_classes)
		return 0;
	struct xml_element *target;
	int r = element_check(el, "id|name", false, m->error);
	if (!r)
		r = id_table_find(&m->ids, el, &target, m->error);
	if (!r && id_table_is_absent(target)) /* has been reported where it stands */
		return REPORT_TOLD;
	return r ? r : read_object(m, d, owner, el, target);
}

/* Refuses the motion of an object that cannot move; a lenient reader keeps the first transform instead. */
static int hold_still(struct maker *m, struct draft *d, const struct xml_element *el)
{
	for (uint32_t i = 0; i < d->node->property_count; i++) {
		struct value *v = &d->properties[i].value;
		const struct param *p = v->animation ? plugin_param(d->decl, d->properties[i].name) : NULL;
		const char *what = p && (p->types & VALUE_MOTION) ? animation_refused(d->node, el) : "this plug-in";
		if (!v->animation || !what)
			continue;
		v->animation = NULL;
		return m->lenient ? leave_out(&m->notes, el, d->node->type, "motion", "all but the start of the")
				  : xml_error(el, m->error, ENOTSUP,
					      "motion of %s is not supported (line %d); --lenient keeps the first "
					      "transform",
					      what, d->properties[i].line);
	}
	return 0;
}

/* Returns whether the object may be refused merely because this element in it is missing or wrong. A shape, other
 * than an instance, is judged without its material and other objects. */
static bool decides(const struct scene_node *n, const struct xml_element *c)
{
	return n->cls != PLUGIN_SHAPE || strcmp(n->type, "instance") == 0 || value_is_element(c->name);
}

/* Returns whether the node holds a flawed one, as a shape with a flawed texture does: then it is flawed itself. */
static bool holds_flawed(const struct scene_node *n)
{
	bool with_children = n->cls != PLUGIN_SHAPE || strcmp(n->type, "instance") == 0;
	for (uint32_t i = 0; i < n->property_count; i++)
		if (n->properties[i].value.type == VALUE_NODE && n->properties[i].value.as.node->flawed)
			return true;
	for (uint32_t i = 0; i < n->child_count && with_children; i++)
		if (n->children[i]->flawed)
			return true;
	return false;
}

/* Marks the node as flawed and adds it to the scene's list of these. */
static int note_flaw(struct maker *m, struct scene_node *n)
{
	uint32_t count = m->flawed_count;
	n->flawed = true;
	if ((count & (count - 1)) == 0) { /* 0 or a power of two: the list is full */
		const struct scene_node **more = arena_alloc(m->arena, count ? 2 * (size_t)count : 1, sizeof *more);
		if (!more)
			return maker_out_of_memory(m);
		if (count)
			memcpy(more, m->flawed, count * sizeof *more);
		m->flawed = more;
	}
	m->flawed[m->flawed_count++] = n;
	return 0;
}

static int fill_node(struct maker *m, struct draft *d, struct xml_element *el)
{
	size_t n = 0;
	for (const struct xml_element *c = el->first; c; c = c->next)
		n++;
	d->properties = arena_alloc(m->arena, n, sizeof *d->properties);
	d->children = arena_alloc(m->arena, n, sizeof *d->children);
	if (!d->properties || !d->children)
		return maker_out_of_memory(m);
	d->node->properties = d->properties;
	d->node->children = d->children;
	for (struct xml_element *c = el->first; c; c = c->next) {
		uint32_t before = m->report.problem_count;
		int r = read_content(m, d, el, c);
		d->lacks |= r == REPORT_TOLD;
		d->unsure |= (r || m->report.problem_count > before) && decides(d->node, c);
		r = report_problem(&m->report, r, m->error);
		if (r)
			return r;
	}
	return 0;
}

/* Makes the node of `inner`, which stands in for el. */
static int make_inner(struct maker *m, struct xml_element *el, struct xml_element *inner, const struct scene_node **out)
{
	el->busy = true;
	m->depth++;
	int r = maker_node(m, inner, out);
	m->depth--;
	el->busy = false;
	el->nesting = inner->nesting;
	return r;
}

/* Checks that the value of a parameter is well formed, in an object of unknown type. */
static int read_unknown(struct maker *m, const struct xml_element *el)
{
	const struct animation *moves;
	const struct xml_element *whole = el;
	struct value unused;
	if (element_is_unset(el))
		return REPORT_TOLD;
	int r = strcmp(el->name, "animation") == 0 ? animation_read(&el, m->arena, &moves, m->error)
						   : value_read(el, m->assets_from, m->arena, &unused, m->error);
	return transform_report(whole, r, &m->report, m->error);
}

/* Reports the problems inside an object of unknown type: in its objects, such as the film of a sensor, in the names of
 * its elements, and in how its values are written. Which parameters it may have is not known, nor whether it may have
 * the elements of Mitsuba's that are not supported. */
static int read_inside(struct maker *m, struct xml_element *el)
{
	int r = 0;
	m->depth++;
	for (struct xml_element *c = el->first; c && !r; c = c->next) {
		enum plugin_class cls;
		const struct scene_node *unused;
		struct xml_element *target;
		bool not_ours = strcmp(c->name, "field") == 0 || strcmp(c->name, "subsurface") == 0;
		if (c->ignored || not_ours || strcmp(c->name, "default") == 0)
			continue;
		if (plugin_class_find(c->name, &cls))
			r = maker_node(m, c, &unused);
		else if (strcmp(c->name, "ref") == 0)
			r = id_table_find(&m->ids, c, &target, m->error);
		else if (value_is_element(c->name))
			r = read_unknown(m, c);
		else if (strcmp(c->name, "include") != 0 || !c->unset)
			r = maker_foreign(m, c);
		r = report_problem(&m->report, r, m->error);
	}
	m->depth--;
	return r ? r : REPORT_TOLD;
}

/* Reports the problems inside an object of unknown type as if it were of the nearest type, and makes no node. */
static int read_as(struct maker *m, struct xml_element *el, const struct plugin_decl *decl)
{
	struct scene_node node = {
		.cls = decl->cls, .type = decl->type, .file = el->file, .line = el->line, .decl = decl};
	struct draft d = {.node = &node, .decl = decl, .nesting = {.height = 1, .objects = 1}};
	el->busy = true;
	m->depth++;
	int r = fill_node(m, &d, el);
	m->depth--;
	el->busy = false;
	return r ? r : REPORT_TOLD;
}

/* Reports that an object is refused, and the problems inside it. */
static int report_refused(struct maker *m, struct xml_element *el, enum plugin_class cls, const char *type, int refused)
{
	if (refused >= 0 || (refused = report_problem(&m->report, refused, m->error)))
		return refused;
	const struct plugin_decl *meant = meant_type(m->decls, el, cls, type);
	return meant ? read_as(m, el, meant) : read_inside(m, el);
}

/* Fills in d's node from el's contents, and records whether it may be flawed. */
static int fill_draft(struct maker *m, struct draft *d, struct xml_element *el)
{
	el->busy = true;
	m->depth++;
	int r = fill_node(m, d, el);
	if (!r)
		r = report_problem(&m->report, hold_still(m, d, el), m->error);
	if (!r && (d->unsure || holds_flawed(d->node)))
		r = note_flaw(m, d->node);
	m->depth--;
	el->busy = false;
	el->nesting = d->nesting;
	return r;
}

/* Adds the remarks on a complete node and makes a lenient reader's replacements, which may change *out. */
static int finish_node(struct maker *m, const struct draft *d, struct xml_element *el, const struct scene_node **out)
{
	if (d->flat && m->lenient) {
		if (m->flat_shapes++ == 0)
			m->first_flat = el;
		return REPORT_TOLD;
	}
	int r = remarks_on_object(d->node, &m->report, m->error);
	if (!r && m->lenient && (r = substitute_medium(&m->notes, el, d->lacks, d->node)))
		return r;
	if (!r && m->lenient && !m->tree->dialect_3 && (r = substitute_volume(&m->notes, el, d->node)))
		return r;
	if (!r && m->lenient && (r = substitute_cover(&m->notes, el, d->lacks, out)) == REPORT_TOLD)
		return r;
	el->node = *out;
	return r;
}

/* Refuses an element that refers to itself, was refused before, or lies too deep. */
static int check_place(struct maker *m, struct xml_element *el)
{
	if (el->busy)
		return xml_error(el, m->error, ELOOP, "refers to itself");
	if (el->told)
		return REPORT_TOLD;
	if (m->depth == 0)
		m->resumed = el->deep;
	if (m->depth >= XML_DEPTH_MAX) {
		bool said = el->deep || m->resumed;
		el->deep = true;
		return said ? REPORT_TOLD
			    : xml_error(el, m->error, ELOOP, "objects refer to each other more than %d deep",
					XML_DEPTH_MAX);
	}
	return 0;
}

/* An object with errors inside still becomes a node, so that all errors are found. An element that cannot become a
 * node, for example because its type is unknown, is reported once. */
int maker_node(struct maker *m, struct xml_element *el, const struct scene_node **out)
{
	if (el->node) {
		*out = el->node;
		return 0;
	}
	int r = check_place(m, el);
	if (r)
		return r;
	el->told = true; /* reset on success */
	enum plugin_class cls;
	plugin_class_find(el->name, &cls);
	bool file = el->parent && strcmp(el->parent->name, "include") == 0;
	r = element_check(el, file || m->tree->dialect_3 ? "type|id|name|version" : "type|id|name", true, m->error);
	if (r)
		return r;
	const char *type = xml_attribute(el, "type");
	if (!type)
		return element_needs(el, "type", m->error);
	if (el->unset && strchr(type, '$'))
		return REPORT_TOLD;
	const struct plugin_decl *decl = plugin_find(m->decls, cls, type);
	bool stands_in = !decl;
	struct xml_element *inner = NULL;
	if (!decl && !m->lenient)
		return report_refused(m, el, cls, type, refuse_type(m->decls, el, cls, type, m->error));
	if (!decl && (r = substitute_plugin(&m->notes, m->decls, &m->ids, el, cls, &type, &decl, &inner)))
		return report_refused(m, el, cls, type, r);
	if (inner) {
		r = make_inner(m, el, inner, out);
		el->node = r ? NULL : *out;
		return r;
	}
	if (strcasecmp(type, decl->type) == 0)
		type = decl->type;
	if (decl->status == PARAM_IGNORED && (r = note_ignored_plugin(&m->notes, el, decl)))
		return r;
	const struct plugin_decl *named = decl;
	if (m->lenient && (r = substitute_lost(&m->notes, m->assets_from, m->decls, el, &type, &decl)))
		return r;
	struct draft d = {.node = arena_alloc(m->arena, 1, sizeof *d.node),
			  .decl = decl,
			  .stands_in = stands_in || decl != named,
			  .nesting = {.height = 1, .objects = 1}};
	if (!d.node)
		return maker_out_of_memory(m);
	*d.node = (struct scene_node){.cls = cls,
				      .type = type,
				      .id = xml_attribute(el, "id"),
				      .file = el->file,
				      .line = el->line,
				      .decl = decl,
				      .shines = cls == PLUGIN_EMITTER};
	r = fill_draft(m, &d, el);
	*out = d.node;
	if (!r)
		return finish_node(m, &d, el, out);
	el->node = *out;
	return r;
}
