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
	const char *other;
	enum lenient_way way = lenient_element(el, cls, *type, &other);
	if (way == LENIENT_REFUSE)
		return refuse_type(decls, el, cls, *type, t->error);
	*inner = way == LENIENT_INNER ? lenient_inner(ids, el, cls) : NULL;
	if (way == LENIENT_INNER && !*inner && !other)
		way = LENIENT_LEAVE_OUT;
	int r = way == LENIENT_LEAVE_OUT
			? leave_out(t, el, *type, "", "the plug-in")
			: note(t, el, *type, "",
			       "%s:%d: <%.64s type=\"%.64s\"> is not supported; %s%s stands in for it (lenient)",
			       el->file, el->line, el->name, *type,
			       !*inner		    ? "the plug-in "
			       : cls == PLUGIN_BSDF ? "the BSDF inside"
						    : "the texture inside",
			       *inner ? "" : other);
	if (r || way == LENIENT_LEAVE_OUT)
		return r ? r : REPORT_TOLD;
	if (*inner)
		return 0;
	*type = other;
	*decl = plugin_find(decls, cls, other);
	return *decl ? 0 : refuse_type(decls, el, cls, *type, t->error);
}

int substitute_lost(const struct notes *t, const struct asset_source *assets, const struct plugin_decl *decls,
		    const struct xml_element *el, const char **type, const struct plugin_decl **decl)
{
	const char *file = lenient_missing(assets, el), *other = NULL;
	if (!file)
		return 0;
	if ((*decl)->cls == PLUGIN_BSDF)
		lenient_plugin(PLUGIN_BSDF, *type, &other);
	char shown[257];
	int r = note(t, el, *type, file,
		     "%s:%d: <%.64s type=\"%.64s\">: %s is not among the scene's files; %s%s%s (lenient)", el->file,
		     el->line, el->name, *type, asset_name_shown(file, shown, sizeof shown),
		     other ? "a standard " : "left out", other ? other : "", other ? " stands in for it" : "");
	if (r || !other)
		return r ? r : REPORT_TOLD;
	*type = other;
	*decl = plugin_find(decls, PLUGIN_BSDF, other);
	return 0;
}

int substitute_cover(const struct notes *t, const struct xml_element *el, bool lacks, const struct scene_node **node)
{
	const char *type = (*node)->type;
	bool bare = lacks && lenient_needs_texture(type);
	const struct scene_node *inner = bare ? node_child(*node, PLUGIN_BSDF, 0) : lenient_uncovered(*node);
	if (!inner)
		return bare ? REPORT_TOLD : 0;
	*node = inner;
	return note(t, el, type, inner->type,
		    "%s:%d: <bsdf type=\"%.64s\"> %s%s%s; the BSDF inside stands in for it (lenient)", el->file,
		    el->line, type, bare ? "has no texture left" : "over \"", bare ? "" : inner->type,
		    bare ? "" : "\", which lets light through, is not supported");
}

int substitute_medium(const struct notes *t, const struct xml_element *el, bool lacks, const struct scene_node *node)
{
	if (node->cls != PLUGIN_MEDIUM || !lacks)
		return 0;
	int r = note(t, el, node->type, "",
		     "%s:%d: <medium type=\"%.64s\"> is left out, because a part of it is missing (lenient)", el->file,
		     el->line, node->type);
	return r ? r : REPORT_TOLD;
}

int substitute_volume(const struct notes *t, const struct xml_element *el, const struct scene_node *node)
{
	if (node->cls != PLUGIN_VOLUME || strcmp(node->type, "constvolume") != 0 || node_find(node, "value"))
		return 0;
	int r = note(t, el, node->type, "", "%s:%d: <volume type=\"%.64s\"> has no `value`: left out (lenient)",
		     el->file, el->line, node->type);
	return r ? r : REPORT_TOLD;
}
