/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/integrator_lookup.h"

#include "worker/render/path/integrator.h"

const struct integrator_properties *render_integrator_find(const char *name)
{
	const struct integrator *i = integrator_find(name);
	return i ? &i->properties : NULL;
}

const struct integrator_properties *render_integrator_at(size_t index)
{
	for (size_t i = 0; i <= index; i++)
		if (!integrator_registry[i])
			return NULL;
	return &integrator_registry[index]->properties;
}
