/* The choice of the integrator (worker/render/choose.h) where it is left to the scene. */
#ifndef WORKER_CLI_CHOICE_H
#define WORKER_CLI_CHOICE_H

#include "worker/cli/options.h"

/* a: complete but for what is chosen. text: what was chosen; empty: nothing was to be chosen, and no world was built for it. */
int choice_make(struct render_arguments *a, const char *folder, const char *name, char *text, size_t size, struct error *e);
/* The same in a world that is there. */
int choice_in_world(const struct world *w, struct render_arguments *a, char *text, size_t size, struct error *e);

#endif
