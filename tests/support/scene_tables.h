/* SPDX-License-Identifier: Apache-2.0 */
/* Small tables of plug-ins, sufficient for the public scenes: tests of the reader need no renderer. */
#ifndef TESTS_SUPPORT_SCENE_TABLES_H
#define TESTS_SUPPORT_SCENE_TABLES_H

#include "worker/render/shape/shape.h"
#include "worker/render/scene/settings.h"

/* Shapes and settings are the program's, materials, textures and emitters the test's. Ends with a NULL type. */
const struct plugin_decl *scene_tables(void);

#endif
