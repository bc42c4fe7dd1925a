/* SPDX-License-Identifier: Apache-2.0 */
/* Which format of pictures a file's name promises. Pure; any thread. */
#ifndef COMMON_BASE_PICTURE_NAME_H
#define COMMON_BASE_PICTURE_NAME_H

/* ".exr", ".png" and so on, in small letters; NULL: the name promises none. */
const char *picture_name_format(const char *name);

#endif
