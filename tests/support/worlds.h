/* SPDX-License-Identifier: Apache-2.0 */
/* Worlds from XML in a string, for tests. */
#ifndef TESTS_SUPPORT_WORLDS_H
#define TESTS_SUPPORT_WORLDS_H

#include "worker/render/render.h"
#include "worker/render/world/world.h"

/* Builds the world of a scene: `format` is the text between <scene> and </scene>, in the dialect of Mitsuba 3; width
 * x height override the film's. Fails the test with the reader's error if the scene does not build. */
__attribute__((format(printf, 3, 4))) struct world *world_from_text(uint32_t width, uint32_t height, const char *format,
								    ...);

/* Fails the test unless a scene of Mitsuba 3 with a camera and `body` is refused, when it is read or built, with an
 * error that contains `sentence`. */
void world_check_refused(const char *body, const char *sentence);

/* A sensor that looks from o to t, with a box filter and a film of 32 x 32: a fragment for the text above. */
/* clang-format off */
#define SENSOR(o, t)                                                                                                            \
	"<sensor type='perspective'><float name='fov' value='40'/><transform name='to_world'><lookat origin='" o               \
	"' target='" t "' up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' value='32'/>"                      \
	"<integer name='height' value='32'/><rfilter type='box'/></film></sensor>"
/* clang-format on */

/* Accuracy settings of the worlds built from now on; NULL: the defaults, except that opaque backs scatter light in
 * files of 3.x, too, unless `backs` is named. */
extern const char *worlds_accuracy;
/* Effects that the worlds built from now on force, in a plan's spelling; NULL: none. */
extern const char *worlds_effects;

/* Builds a world from files in memory (tests/support/memory_assets.h); the first is the scene. */
struct memory_file;
struct world *world_from_files(uint32_t width, uint32_t height, const struct memory_file *files);
void world_check_files_refused(const struct memory_file *files, const char *sentence); /* like world_check_refused() */

/* Builds a world from the folder that HSLT_SCENES names; NULL if the variable is not set. */
struct world *world_from_public_scene(const char *folder, const char *file, uint32_t width, uint32_t height);

/* Builds a world from tests/scenes; the working directory must be the tree's root. */
struct world *world_from_own_scene(const char *folder, const char *file, uint32_t width, uint32_t height);

#endif
