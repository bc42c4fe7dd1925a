/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Assembles crops of one render, each an image with its place in the film, into one image. The groups and chains of
 * different crops are independent, so the errors of pixels remain valid, and relMSE is the mean over pixels. One
 * thread; holds the whole film and one crop in memory.
 */
#ifndef WORKER_CLI_IMAGE_ASSEMBLE_H
#define WORKER_CLI_IMAGE_ASSEMBLE_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>

/* Reads the crops and returns the EXR file of the rectangle that they cover; *bytes is freed with mem_free. *disagree:
 * the chains of some crop disagree. Returns -EINVAL if crops overlap, leave out pixels, or are not of the same render
 * (film, layers, version, scene, integrator, depths, --set, --effects). */
int assemble_crops(const char *const *paths, size_t count, unsigned char **bytes, size_t *size, bool *disagree,
		   struct error *e);

#endif
