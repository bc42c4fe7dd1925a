/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/substitute.h"

#include "worker/render/asset/asset_name.h"
#include "worker/render/plugin/plugin.h"
#include "worker/render/scene/refuse.h"

#include <string.h>

int substitute_plugin(const struct notes *t, const struct plugin_decl *decls, struct id_table *ids,
		      const struct xml_element *el, enum plugin_class cls, const char **type,
		      const struct plugin_decl **decl, struct xml_element **inner)
{
	const char *stand_in;
	enum lenient_action action = lenient_element_action(el, cls, *type, &stand_in);
	if (action == LENIENT_REFUSE)
		return refuse_type(decls, el, cls, *type, t->error);
	*inner = action == LENIENT_INNER ? lenient_find_inner(ids, el, cls) : NULL;
	if (action == LENIENT_INNER && !*inner && !stand_in)
		action = LENIENT_LEAVE_OUT;
	int r = action == LENIENT_LEAVE_OUT
			? note_left_out(t, el, *type, "", "the plug-in")
			: note_add(t, el, *type, "",
				   "%s:%d: <%.64s type=\"%.64s\"> is not supported; %s%s stands in for it (lenient)",
				   el->file, el->line, el->name, *type,
				   !*inner		? "the plug-in "
				   : cls == PLUGIN_BSDF ? "the BSDF inside"
							: "the texture inside",
				   *inner ? "" : stand_in);
	if (r || action == LENIENT_LEAVE_OUT)
		return r ? r : REPORT_ALREADY_REPORTED;
	if (*inner)
		return 0;
	*type = stand_in;
	*decl = plugin_find(decls, cls, stand_in);
	return *decl ? 0 : refuse_type(decls, el, cls, *type, t->error);
}

int substitute_missing_file(const struct notes *t, const struct asset_source *assets, const struct plugin_decl *decls,
			    const struct xml_element *el, const char **type, const struct plugin_decl **decl)
{
	const char *file = lenient_missing_file(assets, el), *stand_in = NULL;
	if (!file)
		return 0;
	if ((*decl)->cls == PLUGIN_BSDF)
		lenient_plugin_action(PLUGIN_BSDF, *type, &stand_in);
	char shown[257];
	int r = note_add(t, el, *type, file,
			 "%s:%d: <%.64s type=\"%.64s\">: %s is not among the scene's files; %s%s%s (lenient)", el->file,
			 el->line, el->name, *type, asset_name_display(file, shown, sizeof shown),
			 stand_in ? "a standard " : "left out", stand_in ? stand_in : "",
			 stand_in ? " stands in for it" : "");
	if (r || !stand_in)
		return r ? r : REPORT_ALREADY_REPORTED;
	*type = stand_in;
	*decl = plugin_find(decls, PLUGIN_BSDF, stand_in);
	return 0;
}

int substitute_cover(const struct notes *t, const struct xml_element *el, bool lacks_content,
		     const struct scene_node **node)
{
	const char *type = (*node)->type;
	bool lacks_texture = lacks_content && lenient_needs_texture(type);
	const struct scene_node *inner =
		lacks_texture ? node_child(*node, PLUGIN_BSDF, 0) : lenient_transmissive_inner(*node);
	if (!inner)
		return lacks_texture ? REPORT_ALREADY_REPORTED : 0;
	*node = inner;
	return note_add(t, el, type, inner->type,
			"%s:%d: <bsdf type=\"%.64s\"> %s%s%s; the BSDF inside stands in for it (lenient)", el->file,
			el->line, type, lacks_texture ? "has no texture left" : "over \"",
			lacks_texture ? "" : inner->type,
			lacks_texture ? "" : "\", which lets light through, is not supported");
}

int substitute_medium(const struct notes *t, const struct xml_element *el, bool lacks_content,
		      const struct scene_node *node)
{
	if (node->cls != PLUGIN_MEDIUM || !lacks_content)
		return 0;
	int r = note_add(t, el, node->type, "",
			 "%s:%d: <medium type=\"%.64s\"> is left out, because a part of it is missing (lenient)",
			 el->file, el->line, node->type);
	return r ? r : REPORT_ALREADY_REPORTED;
}

int substitute_volume(const struct notes *t, const struct xml_element *el, const struct scene_node *node)
{
	if (node->cls != PLUGIN_VOLUME || strcmp(node->type, "constvolume") != 0 || node_find_property(node, "value"))
		return 0;
	int r = note_add(t, el, node->type, "", "%s:%d: <volume type=\"%.64s\"> has no `value`: left out (lenient)",
			 el->file, el->line, node->type);
	return r ? r : REPORT_ALREADY_REPORTED;
}
