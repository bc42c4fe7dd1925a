/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Crops of one render, each an image of its own with its place in the film, into one image. Their groups and chains are
 * independent, so that errors of pixels stay what they were and relMSE is the mean over pixels. One thread; holds the
 * whole film and one crop.
 */
#ifndef WORKER_CLI_IMAGE_ASSEMBLE_H
#define WORKER_CLI_IMAGE_ASSEMBLE_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>

/* bytes: the EXR file of the rectangle that the crops cover, mem_alloc'd. disagree: chains of some crop do. -EINVAL:
 * they overlap, leave pixels out, or are not of one render (film, layers, version, scene, integrator, depths, --set,
 * --effects). */
int assemble(const char *const *paths, size_t count, unsigned char **bytes, size_t *size, bool *disagree,
	     struct error *e);

#endif
