/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/ctl/job_verbs.h"

#include "common/base/output.h"

#include <stdio.h>

int main(int argc, char **argv)
{
	struct job_options o;
	struct client *cl;
	struct error e;
	output_check_at_exit();
	job_options_parse(&o, argc, argv);
	int rc = client_open(&cl, o.coordinator, o.tls, o.insecure, "hslt-job", &e);
	if (!rc) {
		client_print_notes(cl, "hslt-job");
		rc = job_verb(cl, &o, &e);
		client_close(cl);
	}
	if (rc)
		fprintf(stderr, "hslt-job: %s\n", e.text);
	return rc ? client_exit_code(rc) : 0;
}
