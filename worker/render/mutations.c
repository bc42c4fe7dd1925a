/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/mutations.h"

#include "worker/render/mutation/mixture.h"

const char *render_mutation_at(size_t index, const char **summary)
{
	for (size_t i = 0; i <= index; i++)
		if (!mutation_registry[i])
			return NULL;
	*summary = mutation_registry[index]->summary;
	return mutation_registry[index]->name;
}

int render_canonical_mutations(const char *text, const struct render_summary *summary,
			       char canonical[PLAN_MUTATIONS_MAX], struct error *e)
{
	struct mixture m;
	if (text && *text) {
		int rc = mixture_parse(text, &m, e);
		if (rc)
			return rc;
	} else {
		mixture_init_default(summary, &m);
	}
	mixture_print(&m, canonical);
	return 0;
}
