/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/path/integrator.h"

#include <string.h>

#define INTEGRATOR(name) extern const struct integrator integrator_##name;
#include "worker/render/path/integrator_list.h"
#undef INTEGRATOR

const struct integrator *const integrator_registry[] = {
#define INTEGRATOR(name) &integrator_##name,
#include "worker/render/path/integrator_list.h"
#undef INTEGRATOR
	NULL,
};

const struct integrator *integrator_find(const char *name)
{
	for (size_t i = 0; integrator_registry[i]; i++)
		if (strcmp(integrator_registry[i]->properties.name, name) == 0)
			return integrator_registry[i];
	return NULL;
}
