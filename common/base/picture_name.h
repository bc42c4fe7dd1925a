/* SPDX-License-Identifier: Apache-2.0 */
/* The picture format that a file name's extension stands for. Pure; any thread. */
#ifndef COMMON_BASE_PICTURE_NAME_H
#define COMMON_BASE_PICTURE_NAME_H

/* Returns ".exr", ".png" or another known extension in lower case, whatever the case in `name`; NULL if the name has
 * none of them. */
const char *picture_name_format(const char *name);

#endif
