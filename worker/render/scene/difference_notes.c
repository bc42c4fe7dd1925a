/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Looks at each object, or at the scene as a whole, for things that are known to be rendered differently, and adds a
 * sentence about each to the report.
 *
 * The only failure is -ENOMEM.
 */
#include "worker/render/scene/difference_notes.h"

#include "worker/render/scene/depth.h"
#include "worker/render/scene/integrators.h"
#include "worker/render/plugin/plugin.h"

#include <stdio.h>
#include <string.h>

__attribute__((format(printf, 4, 5))) static int add_difference_note(struct report *r, const struct scene_node *n,
								     struct error *e, const char *format, ...)
{
	char text[REPORT_TEXT_MAX];
	va_list ap;
	int length = snprintf(text, sizeof text, "%s:%d: <%s type=\"%.64s\">: ", n->file, n->line,
			      plugin_class_name(n->cls), n->type);
	va_start(ap, format);
	vsnprintf(text + length, sizeof text - (size_t)length, format, ap);
	va_end(ap);
	return report_note_text(r, n->file, text, text, e);
}

/* Notes a max_depth above the limit. A scene without max_depth must expect some limit, which is not noted. */
static int remark_on_depth(struct report *r, const struct scene_node *n, struct error *e)
{
	int64_t depth = node_int(n, "max_depth", -1);
	if (depth <= SCENE_DEPTH_MAX)
		return 0;
	return add_difference_note(r, n, e, "max_depth %lld becomes %d: light of longer paths is missing",
				   (long long)depth, SCENE_DEPTH_MAX);
}

/* Notes that an integrator which shows a part of the light, or something other than light, gives another image here. */
static int remark_on_integrator(struct report *r, const struct scene_node *n, struct error *e)
{
	const struct scene_node *inner = integrator_inner(n);
	int rc = 0;
	while (inner && integrator_shows_other(inner))
		inner = integrator_inner(inner);
	const char *suffix = strcmp(n->type, "stokes") == 0 ? ", without its polarization" : "";
	char hint[128];
	struct spelling s = {.wanted_name = inner ? inner->type : n->type};
	integrator_offer_types(&s);
	spelling_hint(&s, hint, sizeof hint);
	if (inner && !integrator_is_known(inner))
		rc = add_difference_note(
			r, n, e,
			"the `%s` inside it is not known: the image shows all light, on surfaces and in media%s%s",
			inner->type, suffix, hint);
	else if (integrator_shows_other(n) && inner)
		rc = add_difference_note(r, n, e, "rendered as the `%s` inside it%s", inner->type, suffix);
	else if (integrator_shows_other(n))
		rc = add_difference_note(r, n, e, "the image shows all light, on surfaces and in media%s", suffix);
	else if (!integrator_is_known(n))
		rc = add_difference_note(r, n, e, "is not known: the image shows all light, on surfaces and in media%s",
					 hint);
	int64_t depth = node_int(n, "max_depth", SCENE_DIRECT_DEPTH);
	if (!rc && depth_is_direct(n->type) && (depth < 0 || depth >= SCENE_DIRECT_DEPTH))
		rc = add_difference_note(r, n, e,
					 "the image shows light that is scattered once%s; --max-depth shows more",
					 depth == SCENE_DIRECT_DEPTH ? "" : ", whatever max_depth says");
	if (!rc && depth_is_prb(n->type) && !node_find_property(n, "max_depth"))
		rc = add_difference_note(r, n, e, "max_depth is %d, its default in Mitsuba; --max-depth shows more",
					 SCENE_PRB_DEPTH);
	return rc ? rc : remark_on_depth(r, n, e);
}

/* Returns whether a path of one edge can hit the emitter: not if it is a point or shines in a single direction. */
static bool can_be_seen(const struct scene_node *n)
{
	static const char *const unseen[] = {"point", "spot", "projector", "directional"};
	for (size_t i = 0; i < sizeof unseen / sizeof *unseen; i++)
		if (n->cls == PLUGIN_EMITTER && strcmp(n->type, unseen[i]) == 0)
			return false;
	return n->emits_light;
}

static int remark_on_one_edge(struct report *r, const struct scene_node *integrator, struct error *e)
{
	if (!integrator || integrator_depth(integrator) != 1)
		return 0;
	return add_difference_note(
		r, integrator, e,
		"max_depth 1 shows emitters themselves, and the scene has none that can be seen: the image is "
		"black; --max-depth 2 shows surfaces that they light");
}

static int remark_on_hidden_emitter(struct report *r, const struct scene_node *integrator,
				    const struct scene_node *emitter, struct error *e)
{
	bool hides = false;
	for (const struct scene_node *n = integrator; n; n = integrator_inner(n))
		hides |= node_bool(n, "hide_emitters", false);
	if (!hides || !emitter)
		return 0;
	return add_difference_note(
		r, emitter, e,
		"hide_emitters hides its light from the camera but not the shape itself; newer versions of "
		"Mitsuba 3 show what is behind");
}

static bool has_medium(const struct scene_node *n)
{
	return n->cls == PLUGIN_SHAPE ? node_ref(n, "interior") || node_ref(n, "exterior")
				      : n->cls == PLUGIN_SENSOR && node_child(n, PLUGIN_MEDIUM, 0);
}

/* A BSDF is easily forgotten, and the medium is then never seen. In 0.6 light passes through such a shape. */
static int remark_on_boundary(struct report *r, const struct scene_node *n, bool dialect_3, struct error *e)
{
	if (!dialect_3 || !node_ref(n, "interior") || n->emits_light || node_child(n, PLUGIN_BSDF, 0))
		return 0;
	return add_difference_note(
		r, n, e,
		"without a BSDF it is grey and opaque, as in Mitsuba 3, and the medium inside is not seen; `null` "
		"lets light through");
}

/* Notes that Mitsuba's integrator shows no media. Whether the image has them depends on the setting `media`. */
static int remark_on_media(struct report *r, const struct scene_node *integrator, struct error *e)
{
	const struct scene_node *n = integrator_find_without_media(integrator);
	if (!n)
		return 0;
	return add_difference_note(
		r, n, e,
		"Mitsuba's `%s` leaves media out: the image has them only with --set media=shown, or "
		"with `volpath` in its place",
		n->type);
}

static int remark_on_emitter(struct report *r, const struct scene_node *n, bool dialect_3, struct error *e)
{
	mat4 to_world = node_transform(n, "to_world");
	if (strcmp(n->type, "envmap") == 0 && !mat4_is_conformal(&to_world))
		return add_difference_note(
			r, n, e,
			"its to_world stretches the image; Mitsuba distorts it differently, because it does not "
			"normalize the transformed directions");
	const struct property *texture = strcmp(n->type, "spot") == 0 ? node_find_property(n, "texture") : NULL;
	if (!dialect_3 && texture && texture->value.type != VALUE_NODE)
		return add_difference_note(r, n, e,
					   "`texture` has no effect unless it is a texture, as in Mitsuba 0.6");
	bool is_sun = strcmp(n->type, "sun") == 0;
	if (!dialect_3 && (is_sun || strcmp(n->type, "sky") == 0) &&
	    (node_find_property(n, "sun_scale") || node_find_property(n, "sky_scale")))
		return add_difference_note(
			r, n, e,
			"only `scale` counts here, as in Mitsuba 0.6: `sunScale` and `skyScale` belong to `sunsky`");
	bool is_sun_and_sky = strcmp(n->type, "sunsky") == 0 || strcmp(n->type, "timed_sunsky") == 0;
	if (!dialect_3 || (!is_sun && !is_sun_and_sky))
		return 0;
	return add_difference_note(
		r, n, e,
		"the sun is that of Mitsuba 0.6 (Preetham 1999), which haze dims more: about as bright as Mitsuba 3's "
		"in clear air, half as bright at a turbidity of 8 when it is low; `sun_scale` makes up for it");
}

/* Mitsuba has two tables for most metals; `doubled` lists those of which only the first is here. Of Na, Ni and V
 * Mitsuba has only one table, under the second name. */
static int remark_on_metal(struct report *r, const struct scene_node *n, struct error *e)
{
	static const char *const doubled[] = {"Be", "Cu", "Cu2O", "CuO",  "Hg", "HgTe", "Ir",  "K",   "Li", "Mo",
					      "Nb", "Rh", "SiC",  "SnTe", "Ta", "Te",	"TiC", "TiN", "VC", "VN"};
	const char *name = node_string(n, "material", ""), *end = strstr(name, "_palik");
	for (size_t i = 0; i < sizeof doubled / sizeof *doubled && end; i++)
		if (strlen(doubled[i]) == (size_t)(end - name) && strncmp(doubled[i], name, (size_t)(end - name)) == 0)
			return add_difference_note(r, n, e, "the refractive indices of %s are used for %.32s",
						   doubled[i], name);
	return 0;
}

static bool is_relief(const struct scene_node *n)
{
	return strcmp(n->type, "bumpmap") == 0 || strcmp(n->type, "normalmap") == 0;
}

/* n: a bump or normal map. Notes that it has another inside, if one of them asks for normals to be flipped. What lies
 * between them may be `twosided` or a mask. */
static int remark_on_relief(struct report *r, const struct scene_node *n, struct error *e)
{
	bool flips = false;
	uint32_t count = 0;
	for (const struct scene_node *inner = n; inner; inner = node_child(inner, PLUGIN_BSDF, 0))
		if (is_relief(inner)) {
			count++;
			flips |= node_bool(inner, "flip_invalid_normals", false);
		}
	if (count < 2 || !flips)
		return 0;
	return add_difference_note(r, n, e, "flip_invalid_normals has no effect on maps inside others and around them");
}

/* Notes how a rolling shutter is understood, if the shutter is open for some time. */
static int remark_on_sensor(struct report *r, const struct scene_node *n, struct error *e)
{
	if (strcmp(node_string(n, "rolling_shutter_type", "none"), "none") == 0 ||
	    !(node_float(n, "shutter_open", 0) < node_float(n, "shutter_close", 0)))
		return 0;
	return add_difference_note(
		r, n, e,
		"lines of the film are exposed one after the other, each for rolling_shutter_duration, as Blender "
		"does by these names; it was not compared with Mitsuba");
}

/* Notes filters that depend on how much of the texture a pixel covers: once for all textures. `ewa` is not noted,
 * because it is Mitsuba 0.6's default. */
static int remark_on_filter(struct report *r, const struct scene_node *n, struct error *e)
{
	static const char *const area_filters[] = {"trilinear", "anisotropic"};
	const char *filter = node_string(n, "filter_type", "");
	char text[REPORT_TEXT_MAX];
	if (!text_is_among(filter, area_filters, sizeof area_filters / sizeof *area_filters))
		return 0;
	snprintf(text, sizeof text,
		 "%s:%d: <texture type=\"bitmap\">: filter_type `%s` is read as `bilinear`: the samples of a pixel are "
		 "averaged instead, which blurs less",
		 n->file, n->line, filter);
	return report_note_text(r, n->file, filter, text, e);
}

/* Notes a `scale` with both a value and a texture. Mitsuba 0.6 scales whichever it reads last, which is the texture
 * inside. */
static int remark_on_texture(struct report *r, const struct scene_node *n, struct error *e)
{
	if (strcmp(n->type, "bitmap") == 0)
		return remark_on_filter(r, n, e);
	if (strcmp(n->type, "scale") != 0 || !node_find_property(n, "value") || !node_child(n, PLUGIN_TEXTURE, 0))
		return 0;
	return add_difference_note(r, n, e, "`value` has no effect: the texture inside is scaled, as in Mitsuba 0.6");
}

/* Notes groups without shapes: once for all of a type. Where something was refused it may be what they lack. */
static int remark_on_shape(struct report *r, const struct scene_node *n, struct error *e)
{
	char text[REPORT_TEXT_MAX];
	bool is_group = strcmp(n->type, "merge") == 0 || strcmp(n->type, "shapegroup") == 0;
	if (!is_group || n->child_count > 0 || r->problem_count > 0)
		return 0;
	snprintf(text, sizeof text, "%s:%d: <shape type=\"%s\"> holds no shape: nothing of it is seen", n->file,
		 n->line, n->type);
	return report_note_text(r, n->file, n->type, text, e);
}

int note_object_differences(const struct scene_node *n, struct report *r, struct error *e)
{
	switch (n->cls) {
	case PLUGIN_BSDF:
		return is_relief(n) ? remark_on_relief(r, n, e) : remark_on_metal(r, n, e);
	case PLUGIN_SENSOR:
		return remark_on_sensor(r, n, e);
	case PLUGIN_SHAPE:
		return remark_on_shape(r, n, e);
	case PLUGIN_TEXTURE:
		return remark_on_texture(r, n, e);
	default:
		return 0;
	}
}

/* Notes that a scene with a camera has no emitter: not of a line, since there is none to point at. */
static int remark_on_darkness(struct report *r, const struct scene_node *camera, struct error *e)
{
	char text[REPORT_TEXT_MAX];
	snprintf(text, sizeof text, "%s: the scene has no emitter: the image is black", camera->file);
	return report_note_text(r, camera->file, text, text, e);
}

int note_scene_differences(const struct scene_node *const *objects, uint32_t count, bool dialect_3, struct report *r,
			   struct error *e)
{
	const struct scene_node *camera = NULL, *integrator = NULL, *emitter = NULL;
	bool has_light = false, has_visible_emitter = false, has_media = false;
	uint32_t sensor_count = 0;
	int rc = 0;
	for (uint32_t i = 0; i < count && !rc; i++) {
		const struct scene_node *n = objects[i];
		char place[NODE_PLACE_MAX];
		has_light |= n->emits_light;
		has_visible_emitter |= can_be_seen(n);
		has_media |= has_medium(n);
		emitter = !emitter && n->cls == PLUGIN_SHAPE && n->emits_light ? n : emitter;
		integrator = n->cls == PLUGIN_INTEGRATOR ? n : integrator;
		if (n->cls == PLUGIN_INTEGRATOR)
			rc = remark_on_integrator(r, n, e);
		else if (n->cls == PLUGIN_SHAPE)
			rc = remark_on_boundary(r, n, dialect_3, e);
		else if (n->cls == PLUGIN_EMITTER)
			rc = remark_on_emitter(r, n, dialect_3, e);
		else if (n->cls == PLUGIN_SENSOR && camera)
			rc = add_difference_note(r, n, e,
						 "sensor %u%s%.64s%s; without --sensor the first, in %s, is rendered",
						 ++sensor_count, n->id ? " (\"" : "", n->id ? n->id : "",
						 n->id ? "\")" : "", node_place(camera, place));
		else if (n->cls == PLUGIN_SENSOR) {
			camera = n;
			sensor_count = 1;
		}
	}
	if (!rc && has_media)
		rc = remark_on_media(r, integrator, e);
	if (!rc && dialect_3)
		rc = remark_on_hidden_emitter(r, integrator, emitter, e);
	if (!rc && has_light && !has_visible_emitter)
		rc = remark_on_one_edge(r, integrator, e);
	if (!rc && !has_light && camera && r->problem_count == 0)
		rc = remark_on_darkness(r, camera, e);
	return rc;
}
