/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The renderer: a library without network code. This is its only public header for the daemon and the command line. A
 * world is immutable and shared by all threads; a lease is run by one thread.
 */
#ifndef WORKER_RENDER_RENDER_H
#define WORKER_RENDER_RENDER_H

#include "common/film/batch.h"
#include "worker/render/path/integrator_face.h"
#include "worker/render/world/build.h"
#include "worker/render/world/camera_text.h"
#include "worker/render/world/effects_text.h"
#include "worker/render/world/summary.h"

#include <stdatomic.h>

/* All plug-in declarations, for scene_read. */
const struct plugin_decl *render_plugins(void);

/* Stands for the integrator that worker/render/choose.h selects for the scene, before the plan is made. */
#define RENDER_INTEGRATOR_DEFAULT "auto"
#define RENDER_INTEGRATOR_CHAINS "hslt"

/* Versions of libraries that affect bits, for the numeric fingerprint: "embree 3.13.5 avx2". */
const char *render_numeric_version(void);

/* Reads a scene with all plug-ins: scene_read, or scene_read_lenient if the options have RENDER_LENIENT. */
int render_scene_read(struct scene *s, const struct asset_source *assets, const char *name,
		      const struct scene_define *defines, size_t define_count, const struct render_options *o,
		      struct error *e);
#define RENDER_LENIENT "lenient=yes"

/* All strategies: a name and what it moves; ends with NULL. */
const char *render_mutation_at(size_t index, const char **summary);

/* The mixture of strategies of an integrator that has_mutations, as stored in a plan: "independent=0.1,hslt=0.9".
 * text: NAME or NAME=WEIGHT, separated by commas; NULL or "": the default for the scene. A canonical text does not
 * change. -EINVAL with a sentence. */
int render_mutations(const char *text, const struct render_summary *summary, char canonical[PLAN_MUTATIONS_MAX],
		     struct error *e);

/* What all leases of a plan share besides the world: the map of brightness if the integrator redistributes, else NULL.
 * It follows from the plan's seed, film and depths, so every machine makes the same. render_map_free takes NULL. Ticks.
 * -ENOMEM, -EINVAL, -EDOM */
struct brightness;
int render_map_new(const struct world *w, const struct plan *p, struct brightness **out, struct error *e);
void render_map_free(struct brightness *map);

/* Seeds of a lease at epoch 0 (bootstrap indices, one per chain), or the states after the previous epoch; seeds in
 * their place if the states are lost, and the chains start again. */
struct lease_input {
	uint32_t chain_count;
	const uint64_t *seeds;		  /* NULL if there are states */
	const struct chain_state *states; /* NULL at epoch 0 */
	const struct brightness *map;	  /* NULL: a lease that needs one makes its own, the same */
};

enum lease_end { LEASE_DONE, LEASE_STOPPED };

/* Runs one lease and fills the batch (batch_fini frees it). `stop` may become true at any time: the lease is given up.
 * -ENOMEM, -EILSEQ (states that cannot be gone on from), -EINVAL (plan and world do not fit), -EDOM (an invalid
 * floating-point operation; the sentence says where). Ticks (common/base/liveness.h) at least every 16 samples or
 * mutations. */
int render_lease(const struct world *w, const struct plan *p, const struct lease_key *k, const struct lease_input *in,
		 const atomic_bool *stop, enum lease_end *end, struct batch *out, struct error *e);

#endif
