/* SPDX-License-Identifier: Apache-2.0 */
/* The project's version, as --version prints it. */
#ifndef COMMON_BASE_VERSION_H
#define COMMON_BASE_VERSION_H

#define HSLT_VERSION "0.2.0-dev"

#endif
