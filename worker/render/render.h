/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The renderer: a library without network code. This is its public header; it declares no functions itself. The daemon
 * and the command line also include, by name, headers that only some of them need: accuracy_settings.h,
 * choose_integrator.h, fingerprint.h, count_rays.h, unseen_light.h, and from asset/ and scene/ those for opening files
 * and listing supported features. A world is immutable and shared by all threads; a lease is run by one thread.
 */
#ifndef WORKER_RENDER_RENDER_H
#define WORKER_RENDER_RENDER_H

#include "worker/render/integrator_lookup.h"
#include "worker/render/lease.h"
#include "worker/render/brightness_map.h"
#include "worker/render/mutations.h"
#include "worker/render/plugins.h"
#include "worker/render/world/build.h"
#include "worker/render/world/camera_text.h"
#include "worker/render/world/effects_text.h"
#include "worker/render/world/summary.h"

/* Placeholder for the integrator that worker/render/choose_integrator.h selects for the scene before the plan is made.
 */
#define RENDER_INTEGRATOR_DEFAULT "auto"
#define RENDER_INTEGRATOR_CHAINS "hslt"

#endif
