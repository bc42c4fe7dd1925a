/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/scene/absorbing.h"

#include "worker/render/scene/number.h"
#include "worker/render/scene/plugin.h"
#include "worker/render/scene/refuse.h"
#include "worker/render/scene/report.h"

#include <string.h>
#include <strings.h>

enum { NUMBERS = 3 };

static bool is_zero(const char *text)
{
	double x[NUMBERS];
	int n = number_list(text, x, NUMBERS);
	for (int i = 0; i < n; i++)
		if (x[i] != 0)
			return false;
	return n > 0;
}

bool medium_only_absorbs(const struct xml_element *el)
{
	static const char *const names[] = {"sigma_s", "sigmaS", "albedo"};
	const char *type = xml_attribute(el, "type");
	bool says = false;
	if (!type || strcasecmp(type, "homogeneous") != 0)
		return false;
	for (const struct xml_element *c = el->first; c; c = c->next) {
		const char *name = xml_attribute(c, "name"), *value = xml_attribute(c, "value");
		for (size_t i = 0; name && value && i < sizeof names / sizeof *names; i++)
			if (strcmp(name, names[i]) == 0) {
				if (!is_zero(value))
					return false;
				says = true;
			}
	}
	return says;
}

int medium_refuse(const struct notes *k, bool lenient, const struct xml_element *el)
{
	const char *type = xml_attribute(el, "type");
	return lenient ? leave_out(k, el, type ? type : "", "", "the medium") : refuse_medium(el, k->error);
}

int medium_elsewhere(const struct notes *k, bool lenient, enum plugin_class owner, const struct xml_element *el,
		     const struct xml_element *target)
{
	if (!medium_only_absorbs(target))
		return el == target ? medium_refuse(k, lenient, el) : REPORT_TOLD;
	if (owner == PLUGIN_EMITTER)
		return 0;
	return lenient ? leave_out(k, el, "homogeneous", "", "the medium around it")
		       : xml_error(el, k->error, ENOTSUP, "a medium around a %s is not supported",
				   plugin_class_name(owner));
}
