/* SPDX-License-Identifier: Apache-2.0 */
/* hslt-coordinator's options, which fill in a struct server_config. */
#ifndef COORDINATOR_SERVER_SERVER_OPTIONS_H
#define COORDINATOR_SERVER_SERVER_OPTIONS_H

#include "common/base/option.h"
#include "coordinator/live_job/config.h"

extern const struct program server_program;

/* Sets all options to their defaults, and the fields that have no option. */
void server_config_init(struct server_config *c);

#endif
