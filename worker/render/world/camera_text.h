/* SPDX-License-Identifier: Apache-2.0 */
/* Writes the camera of a scene as text. Pure; any thread. */
#ifndef WORKER_RENDER_WORLD_CAMERA_TEXT_H
#define WORKER_RENDER_WORLD_CAMERA_TEXT_H

#include "worker/render/world/summary.h"

void render_camera_text(const struct render_summary *scene, char *text, size_t size);

#endif
