/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/mem.h"
#include "common/base/program.h"
#include "common/base/progress.h"
#include "common/net/authority.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct arguments {
	const char *ca, *verb, *name_or_serial, *authority_name;
	double seconds; /* validity in s; 0: not given */
	bool renew;
};

static const struct option_row option_rows[] = {
	{"ca", 0, "DIR", "The authority's folder, if not ~/.hslt-ca", OPTION_TEXT(struct arguments, ca),
	 .environment = "HSLT_CA"},
	{"days", 0, "N", "How long the certificate is valid (825; the authority: 3650), or a time such as 36h",
	 OPTION_TIME(struct arguments, seconds, 0, 36500, 86400), .excludes_min = true},
	{"renew", 0, NULL, "Replace an existing certificate and key of the same name and role",
	 OPTION_FLAG(struct arguments, renew)},
	{"name", 0, "NAME", "init: the authority's name", OPTION_TEXT(struct arguments, authority_name),
	 .default_value = "hslt-farm"},
	{0},
};

static const char *verb_at(size_t i)
{
	static const char *const verbs[] = {"init",	"coordinator", "worker", "client",
					    "operator", "revoke",      "list",	 NULL};
	return verbs[i];
}

static int parse_word(void *target, size_t index, char *word, struct error *e)
{
	struct arguments *a = target;
	if (index > 1)
		return error_set(e, EINVAL, "unexpected argument '%s'", word);
	*(index == 0 ? &a->verb : &a->name_or_serial) = word;
	return 0;
}

static int check_arguments(void *target, struct error *e)
{
	const struct arguments *a = target;
	bool takes_no_name = strcmp(a->verb, "init") == 0 || strcmp(a->verb, "list") == 0;
	if (takes_no_name && a->name_or_serial)
		return error_set(e, EINVAL, "%s takes no name", a->verb);
	if (!takes_no_name && !a->name_or_serial)
		return error_set(e, EINVAL, "%s needs a name", a->verb);
	/* Certificates count whole seconds. */
	if (a->seconds > 0 && a->seconds < 1)
		return error_set(e, EINVAL, "--days: %g s is less than a second: it would have expired when it is made",
				 a->seconds);
	if (!tls_name_is_valid(a->authority_name))
		return error_set(e, EINVAL, "--name takes up to %d letters, digits and ._@-", TLS_NAME_MAX);
	return 0;
}

static const struct program program = {
	.name = "hslt-ca",
	.synopsis = "init|coordinator|worker|client|operator|revoke|list [NAME]",
	.summary = "A farm's own certificate authority: certificates for coordinators, workers, clients and operators.",
	.examples =
		"hslt-ca init                      the authority, and DIR/coordinator for hslt-coordinator --tls\n"
		"hslt-ca worker node1              DIR/node1, for hslt-worker --tls\n"
		"hslt-ca client ann                DIR/ann, for hslt-submit and hslt-job --tls\n"
		"hslt-ca operator root             a client who sees and cancels everybody's jobs\n"
		"hslt-ca coordinator spare         one more coordinator\n"
		"hslt-ca worker node1 --renew      a new certificate and key in place of the old\n"
		"hslt-ca revoke node1              by name or serial number; then copy crl.pem to every coordinator\n"
		"hslt-ca list",
	.details =
		"DIR is --ca, $HSLT_CA or ~/.hslt-ca. DIR/ca.key signs everything: keep it away from the farm. A "
		"machine needs only its own folder (copy it with its file modes). Running programs notice new files by themselves.",
	.exit_codes = "0 done, 1 failed, 2 usage",
	.options = {(const struct option_group[]){{NULL, option_rows}, {0}}, check_arguments},
	.verbs = verb_at,
	.parse_word = parse_word,
};

static const double authority_days = 3650, certificate_days = 825;

static double validity_days(const struct arguments *a, double default_days)
{
	return a->seconds > 0 ? a->seconds / 86400 : default_days;
}

/* "30m" may mean months. */
static void warn_short_validity(const struct arguments *a)
{
	char text[32];
	if (!(a->seconds > 0 && a->seconds < 86400))
		return;
	progress_format_duration(a->seconds, text, sizeof text);
	fprintf(stderr, "hslt-ca: note: it is valid for %s only\n", text);
}

static int issue_certificate(const struct arguments *a, enum tls_role role, const char *name, struct error *e)
{
	int rc = authority_issue(a->ca, name, role, validity_days(a, certificate_days), a->renew, e);
	if (!rc) {
		printf("%s/%s\n", a->ca, name);
		warn_short_validity(a);
	}
	return rc;
}

static int init_authority(const struct arguments *a, struct error *e)
{
	struct arguments issue_arguments = *a;
	int rc = authority_create(a->ca, a->authority_name, validity_days(a, authority_days), e);
	if (!rc)
		warn_short_validity(a);
	issue_arguments.seconds = 0;
	return rc ? rc : issue_certificate(&issue_arguments, TLS_COORDINATOR, "coordinator", e);
}

static int revoke_certificates(const struct arguments *a, struct error *e)
{
	unsigned count = 0;
	int rc = authority_revoke(a->ca, a->name_or_serial, &count, e);
	if (count)
		printf("revoked %u; ", count);
	else if (!rc)
		printf("'%s' was revoked before; ", a->name_or_serial);
	if (!rc || count)
		printf("%s/crl.pem must reach every coordinator\n", a->ca);
	return rc;
}

static int list_certificates(const struct arguments *a, struct error *e)
{
	struct authority_entry *entries;
	size_t count;
	time_t now = time(NULL);
	int rc = authority_list(a->ca, &entries, &count, e);
	if (count)
		printf("%-24s %-12s %-8s %-20s %s\n", "NAME", "ROLE", "STATE", "UNTIL", "SERIAL");
	for (size_t i = 0; i < count; i++) {
		const struct authority_entry *x = &entries[i];
		char until[32];
		struct tm tm;
		strftime(until, sizeof until, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&x->valid_until, &tm));
		printf("%-24s %-12s %-8s %-20s %s\n", x->subject.name, tls_role_name(x->subject.role),
		       x->is_revoked	      ? "revoked"
		       : x->valid_until < now ? "expired"
					      : "valid",
		       until, x->subject.serial);
	}
	mem_free(entries);
	return rc;
}

static int run_command(const struct arguments *a, struct error *e)
{
	if (strcmp(a->verb, "init") == 0)
		return init_authority(a, e);
	if (strcmp(a->verb, "list") == 0)
		return list_certificates(a, e);
	if (strcmp(a->verb, "revoke") == 0)
		return revoke_certificates(a, e);
	for (int r = TLS_COORDINATOR; r < TLS_ROLES; r++)
		if (strcmp(a->verb, tls_role_name((enum tls_role)r)) == 0)
			return issue_certificate(a, (enum tls_role)r, a->name_or_serial, e);
	return -EINVAL;
}

int main(int argc, char **argv)
{
	struct arguments a = {0};
	struct error e = {""};
	char home[4000];
	program_parse_options(&program, argc, argv, &a);
	if (!a.ca || !*a.ca) {
		const char *home_folder = getenv("HOME");
		if (!home_folder || !*home_folder) {
			fprintf(stderr,
				"hslt-ca: there is no $HOME for the authority: --ca DIR (or $HSLT_CA) is needed\n");
			return 2;
		}
		snprintf(home, sizeof home, "%s/.hslt-ca", home_folder);
		a.ca = home;
	}
	int rc = run_command(&a, &e);
	if (rc)
		fprintf(stderr, "hslt-ca: %s\n", e.text);
	return rc == 0 ? 0 : rc == -EINVAL ? 2 : 1;
}
