/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The renderer: a library without network. This is its one public header for the daemon and the command line.
 * A world is immutable and shared by all threads; a lease is run by one thread.
 */
#ifndef WORKER_RENDER_RENDER_H
#define WORKER_RENDER_RENDER_H

#include "common/film/batch.h"
#include "worker/scene/settings.h"

#include <stdatomic.h>

struct world;

/* All plug-in declarations, for scene_read. */
const struct plugin_decl *render_plugins(void);

/* One effect, on or off, and why: "dispersion", false, "no dielectric has an index that varies with wavelength". */
struct effect_line {
	const char *name;
	bool on;
	bool forced;	  /* the user wants it other than the scene calls for */
	bool other_scene; /* forced off: the image is another one */
	char why[160];
	const char *saves; /* what leaving it out saves */
};
enum { RENDER_EFFECTS_MAX = 24 };

struct render_integrator {
	const char *name, *summary;
	enum plan_kind kind;
	uint32_t max_depth; /* edges its state holds */
	bool has_mutations; /* its chains draw proposals from a mixture of strategies */
};
/* NULL when there is none of that name; index from 0, NULL at the end. */
const struct render_integrator *render_integrator_find(const char *name);
const struct render_integrator *render_integrator_at(size_t index);
/* Not one of them: that which the scene calls for, found by worker/render/choose.h before the plan is made. */
#define RENDER_INTEGRATOR_DEFAULT "auto"
#define RENDER_INTEGRATOR_CHAINS "hslt"

/* Of the libraries that decide bits, for the numeric fingerprint: "embree 3.13.5 avx2". */
const char *render_numeric_version(void);

/* What hslt-submit and hslt-render let the user override; all zero: as the scene says. The texts are those of a plan.
 */
struct render_options {
	uint32_t width, height;
	char accuracy[PLAN_ACCURACY_MAX], effects[PLAN_EFFECTS_MAX];
	uint32_t max_depth;
};

/* Shapes of which surfaces coincide, a sentence each with the names of two. */
enum { RENDER_COINCIDENT_MAX = 8 };
struct render_coincident {
	char text[RENDER_COINCIDENT_MAX][400];
	size_t count, total; /* sentences; of how many */
	bool incomplete;     /* there are more than were looked for */
};

struct render_summary {
	struct scene_settings settings; /* with the overrides of the options */
	uint32_t useful_depth;		/* edges of the longest path that can carry light, at most what was asked for */
	struct effect_line lines[RENDER_EFFECTS_MAX];
	size_t line_count;
	uint64_t shapes, triangles;
	double brightest; /* see world_brightest */
	struct render_coincident coincident;
	char scales[256]; /* a shape that is too small beside another, by name; "": none is */
	char flat[256];	  /* how many triangles without an area were left out; "": none */
};

/* Reads every mesh, texture and material and says what the scene calls for; all but Embree's own building. What passes
 * here is a scene that workers can render. */
int render_check(const struct scene *s, const struct asset_source *assets, const struct render_options *o,
		 struct render_summary *out, struct error *e);

/* Reads a scene by the tables of all plug-ins: scene_read, or scene_read_lenient where the options have RENDER_LENIENT.
 */
int render_scene_read(struct scene *s, const struct asset_source *assets, const char *name,
		      const struct scene_define *defines, size_t define_count, const struct render_options *o,
		      struct error *e);
#define RENDER_LENIENT "lenient=yes"

/* The strategies that there are: a name and what it moves; NULL at the end. */
const char *render_mutation_at(size_t index, const char **summary);

/* The mixture of strategies of an integrator that has_mutations, in the spelling that a plan holds:
 * "independent=0.1,hslt=0.9". text: NAME or NAME=WEIGHT with commas between; NULL or "": what suits the scene. A
 * canonical text comes back as it is. -EINVAL with a sentence. */
int render_mutations(const char *text, const struct render_summary *summary, char canonical[PLAN_MUTATIONS_MAX],
		     struct error *e);

/* The overrides of effects, in the spelling that a plan holds: "all", "-dispersion,+aperture". -EINVAL with a sentence:
 * no such effect, or it cannot be forced. */
int render_effects(const char *text, char canonical[PLAN_EFFECTS_MAX], struct error *e);
/* "the image is of another scene: without dispersion" where an effect that the scene calls for was switched off; else
 * "". */
void render_effects_note(const struct render_summary *scene, char *text, size_t size);

/* The i-th of the sentences about the scene as a whole: the note on effects, scales, surfaces that coincide;
 * false: there are no more. */
bool render_scene_note(const struct render_summary *scene, size_t i, char *text, size_t size);

/* false also where there is no effect of that name. */
bool render_effect_on(const struct render_summary *scene, const char *name);

/* Builds Embree's scene, and ticks meanwhile (common/base/liveness.h). The scene description may be freed afterwards.
 */
int world_new(struct world **w, const struct scene *s, const struct asset_source *assets,
	      const struct render_options *o, struct error *e);
void world_free(struct world *w);
/* Other settings (render_options.settings) for a world that is there, while no lease runs in it: whether those that
 * differ can do without building again, and then they are set. *fits false: a new world is needed, this one is as it
 * was. */
int world_set_accuracy(struct world *w, const char *accuracy, bool *fits, struct error *e);
void world_summary(const struct world *w, struct render_summary *out);
/* X+Y+Z of the brightest emitter, for canvas_grid_exponent when the bootstrap is black. */
double world_brightest(const struct world *w);
size_t world_embree_bytes(const struct world *w);

/* Seeds of a lease at epoch 0 (bootstrap indices, one a chain) or the states after the epoch before; seeds in their
 * place where these are lost: the chains begin anew. */
struct lease_input {
	uint32_t chain_count;
	const uint64_t *seeds;		  /* NULL where there are states */
	const struct chain_state *states; /* NULL at epoch 0 */
};

enum lease_end { LEASE_DONE, LEASE_STOPPED };

/* Runs one lease and fills the batch (batch_fini frees it). `stop` may become true at any time: the lease is given up.
 * -ENOMEM, -EILSEQ (states that cannot be gone on from), -EINVAL (plan and world do not fit), -EDOM (an invalid
 * floating-point operation; the sentence says where). Ticks (common/base/liveness.h) at least every 256 samples or
 * mutations. */
int render_lease(const struct world *w, const struct plan *p, const struct lease_key *k, const struct lease_input *in,
		 const atomic_bool *stop, enum lease_end *end, struct batch *out, struct error *e);

#endif
