/* SPDX-License-Identifier: Apache-2.0 */
/* The longest paths that are simulated, in edges, whatever a scene asks for. */
#ifndef WORKER_RENDER_SCENE_DEPTH_H
#define WORKER_RENDER_SCENE_DEPTH_H

enum { SCENE_MAX_DEPTH = 128 };

#endif
