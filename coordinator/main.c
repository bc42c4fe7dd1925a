/* SPDX-License-Identifier: Apache-2.0 */
/*
 * hslt-coordinator: parses its options, then runs the server until a signal stops it.
 *
 * Exit codes: 0 after SIGTERM or SIGINT, 2 for invalid options and settings, 1 for anything else; the reason goes to
 * stderr.
 */
#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/program.h"
#include "common/base/version.h"
#include "coordinator/server/server.h"
#include "coordinator/server/server_options.h"

#include <stdio.h>
#include <unistd.h>

int main(int argc, char **argv)
{
	struct server_config c;
	struct error e;
	mem_retain_freed(128 << 20);
	server_config_init(&c);
	program_parse_options(&server_program, argc, argv, &c);
	log_event(LOG_START, "program=hslt-coordinator version=%s", HSLT_VERSION);
	if (geteuid() == 0)
		log_event(
			LOG_ROOT,
			"text=\"running as root, which a coordinator does not need: it reads data from the network\"");
	int rc = server_run(&c, &e);
	if (rc)
		fprintf(stderr, "hslt-coordinator: %s\n", e.text);
	return rc == 0 ? 0 : rc == -EPERM || rc == -EINVAL ? 2 : 1;
}
