/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/mem.h"
#include "common/base/output.h"
#include "common/base/version.h"
#include "common/net/authority.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *argp_program_version = "hslt-ca " HSLT_VERSION;

static const char doc[] =
	"A farm's own certificate authority: who may be coordinator, worker, client, operator."
	"\v"
	"Examples:\n"
	"  hslt-ca init                      the authority, and DIR/coordinator for hslt-coordinator --tls\n"
	"  hslt-ca worker node1              DIR/node1, for hslt-worker --tls\n"
	"  hslt-ca client ann                DIR/ann, for hslt-submit and hslt-job --tls\n"
	"  hslt-ca operator root             a client who sees and cancels everybody's jobs\n"
	"  hslt-ca coordinator spare         one more coordinator\n"
	"  hslt-ca worker node1 --renew      a new certificate and key in place of the old\n"
	"  hslt-ca revoke node1              by name or serial number; crl.pem to where coordinators read it\n"
	"  hslt-ca list\n"
	"\n"
	"DIR is --ca, $HSLT_CA or ~/.hslt-ca. DIR/ca.key signs everything: keep it away from the farm. What belongs to a "
	"machine is its own folder alone (copy it with its modes). Running programs notice new files by themselves.\n"
	"Exit codes: 0 done, 1 failed, 2 usage.";

enum { OPTION_CA = 256, OPTION_DAYS, OPTION_RENEW, OPTION_NAME };

static const struct argp_option options[] = {
	{"ca", OPTION_CA, "DIR", 0, "The authority's folder (or $HSLT_CA; ~/.hslt-ca)", 0},
	{"days", OPTION_DAYS, "N", 0, "How long the certificate is valid (825; the authority: 3650)", 0},
	{"renew", OPTION_RENEW, NULL, 0, "Replace a certificate and key that are there, of the same name and role", 0},
	{"name", OPTION_NAME, "NAME", 0, "init: the authority's name (hslt-farm)", 0},
	{0},
};

struct arguments {
	const char *ca, *verb, *what, *name;
	double days; /* 0: not given */
	bool renew;
};

static const char *const verbs[] = {"init", "list", "revoke", "coordinator", "worker", "client", "operator"};
enum { VERBS = sizeof verbs / sizeof *verbs };

static void take_word(struct arguments *a, const char *arg, struct argp_state *state)
{
	if (state->arg_num == 0) {
		for (size_t i = 0; i < VERBS; i++)
			if (strcmp(arg, verbs[i]) == 0)
				a->verb = verbs[i];
		if (!a->verb)
			argp_error(state,
				   "'%s': the verbs are init, coordinator, worker, client, operator, revoke, list",
				   arg);
	} else if (state->arg_num == 1) {
		a->what = arg;
	} else {
		argp_error(state, "'%s' is one word too many", arg);
	}
}

static void check(const struct arguments *a, struct argp_state *state)
{
	if (!a->verb)
		argp_error(state, "what is to be done? init, coordinator, worker, client, operator, revoke or list");
	bool bare = a->verb && (strcmp(a->verb, "init") == 0 || strcmp(a->verb, "list") == 0);
	if (bare && a->what)
		argp_error(state, "%s takes no name", a->verb);
	if (!bare && !a->what)
		argp_error(state, "%s needs a name", a->verb);
	if (a->name && !tls_name_ok(a->name))
		argp_error(state, "--name takes up to %d letters, digits and ._@-", TLS_NAME_MAX);
}

static error_t parse(int key, char *arg, struct argp_state *state)
{
	struct arguments *a = state->input;
	char *end;
	switch (key) {
	case OPTION_CA:
		a->ca = arg;
		return 0;
	case OPTION_DAYS:
		a->days = strtod(arg, &end);
		if (*end || end == arg || !(a->days > 0 && a->days <= 36500))
			argp_error(state, "--days takes a number above 0 and up to 36500, not '%s'", arg);
		return 0;
	case OPTION_RENEW:
		a->renew = true;
		return 0;
	case OPTION_NAME:
		a->name = arg;
		return 0;
	case ARGP_KEY_ARG:
		take_word(a, arg, state);
		return 0;
	case ARGP_KEY_END:
		check(a, state);
		return 0;
	default:
		return ARGP_ERR_UNKNOWN;
	}
}

static const double own_days = 3650, other_days = 825;

static int issue(const struct arguments *a, enum tls_role role, const char *name, struct error *e)
{
	int rc = authority_issue(a->ca, name, role, a->days > 0 ? a->days : other_days, a->renew, e);
	if (!rc)
		printf("%s/%s\n", a->ca, name);
	return rc;
}

static int init(const struct arguments *a, struct error *e)
{
	struct arguments rest = *a;
	int rc = authority_init(a->ca, a->name ? a->name : "hslt-farm", a->days > 0 ? a->days : own_days, e);
	rest.days = 0;
	return rc ? rc : issue(&rest, TLS_COORDINATOR, "coordinator", e);
}

static int revoke(const struct arguments *a, struct error *e)
{
	unsigned count = 0;
	int rc = authority_revoke(a->ca, a->what, &count, e);
	if (!rc)
		printf("revoked %u; %s/crl.pem must reach every coordinator\n", count, a->ca);
	return rc;
}

static int list(const struct arguments *a, struct error *e)
{
	struct authority_entry *entries;
	size_t count;
	time_t now = time(NULL);
	int rc = authority_list(a->ca, &entries, &count, e);
	if (rc)
		return rc;
	if (count)
		printf("%-24s %-12s %-8s %-20s %s\n", "NAME", "ROLE", "STATE", "UNTIL", "SERIAL");
	for (size_t i = 0; i < count; i++) {
		const struct authority_entry *x = &entries[i];
		char until[32];
		struct tm tm;
		strftime(until, sizeof until, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&x->until, &tm));
		printf("%-24s %-12s %-8s %-20s %s\n", x->who.name, tls_role_name(x->who.role),
		       x->revoked	? "revoked"
		       : x->until < now ? "expired"
					: "valid",
		       until, x->who.serial);
	}
	mem_free(entries);
	return 0;
}

static int run(const struct arguments *a, struct error *e)
{
	if (strcmp(a->verb, "init") == 0)
		return init(a, e);
	if (strcmp(a->verb, "list") == 0)
		return list(a, e);
	if (strcmp(a->verb, "revoke") == 0)
		return revoke(a, e);
	for (int r = TLS_COORDINATOR; r < TLS_ROLES; r++)
		if (strcmp(a->verb, tls_role_name((enum tls_role)r)) == 0)
			return issue(a, (enum tls_role)r, a->what, e);
	return -EINVAL;
}

int main(int argc, char **argv)
{
	struct arguments a = {.ca = getenv("HSLT_CA")};
	struct error e = {""};
	char home[4000];
	output_check_at_exit();
	argp_err_exit_status = 2;
	argp_parse(&(struct argp){options, parse, "init|coordinator|worker|client|operator|revoke|list [NAME]", doc,
				  NULL, NULL, NULL},
		   argc, argv, 0, NULL, &a);
	if (!a.ca || !*a.ca) {
		const char *where = getenv("HOME");
		snprintf(home, sizeof home, "%s/.hslt-ca", where ? where : ".");
		a.ca = home;
	}
	int rc = run(&a, &e);
	if (rc)
		fprintf(stderr, "hslt-ca: %s\n", e.text);
	return rc == 0 ? 0 : rc == -EINVAL ? 2 : 1;
}
