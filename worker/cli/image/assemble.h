/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Assembles crops of one render, each an image with its place in the film, into one image. Their groups and chains are
 * independent, so the errors of pixels remain valid, and relMSE is the mean over pixels. One thread; holds the whole
 * film and one crop.
 */
#ifndef WORKER_CLI_IMAGE_ASSEMBLE_H
#define WORKER_CLI_IMAGE_ASSEMBLE_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>

/* bytes: the EXR file of the rectangle covered by the crops, mem_alloc'd. disagree: the chains of some crop
 * disagree. -EINVAL: they overlap, leave out pixels, or are not of one render (film, layers, version, scene,
 * integrator, depths, --set, --effects). */
int assemble(const char *const *paths, size_t count, unsigned char **bytes, size_t *size, bool *disagree,
	     struct error *e);

#endif
