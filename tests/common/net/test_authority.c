/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Power is lost before each call of hslt-ca that changes the disk, and a different part of what was not flushed is lost
 * each time: what a command reported as done is there afterwards (a certificate with its key and its record, a
 * revocation in every list), and an interrupted command can be repeated.
 */
#include "common/base/mem.h"
#include "common/net/authority.h"
#include "tests/support/faulty_disk.h"
#include "tests/support/failing_list.h"
#include "tests/support/temporary_folder.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

enum { CALLS_MAX = 1000, SEEDS = 16 };

/* The commands, in order. */
enum step { INIT, ISSUE_FARM, ISSUE_NODE, RENEW_NODE, REVOKE_NODE, STEP_COUNT };

static struct shared {
	_Atomic uint64_t counts[FAULTY_DISK_COUNTS];
	_Atomic int done_count; /* commands that have ended without an error */
} * shared;

static int run_step(const char *ca, enum step s, struct error *e)
{
	unsigned count;
	switch (s) {
	case INIT:
		return authority_create(ca, "test", 100, e);
	case ISSUE_FARM:
		return authority_issue(ca, "farm", TLS_COORDINATOR, 50, false, e);
	case ISSUE_NODE:
		return authority_issue(ca, "node", TLS_WORKER, 50, false, e);
	case RENEW_NODE:
		return authority_issue(ca, "node", TLS_WORKER, 60, true, e);
	default:
		return authority_revoke(ca, "node", &count, e);
	}
}

/* Returns the exit code of a process whose disk loses power at that call. */
static int run_until_power_loss(const char *ca, const char *root, const char *after, uint64_t lose_at, uint64_t seed)
{
	int status;
	*shared = (struct shared){.done_count = 0};
	pid_t pid = fork();
	if (pid == 0) {
		struct faulty_disk_options d = {.root = root,
						.remains = after,
						.seed = seed,
						.power_loss_at = lose_at,
						.counts = shared->counts};
		struct error e;
		faulty_disk_begin(&d);
		for (int s = 0; s < STEP_COUNT; s++, shared->done_count++)
			if (run_step(ca, (enum step)s, &e))
				_exit(1);
		_exit(0);
	}
	assert_true(waitpid(pid, &status, 0) == pid && WIFEXITED(status));
	return WEXITSTATUS(status);
}

static void expect_opens(const char *ca, const char *name)
{
	char path[200];
	struct tls *t;
	struct error e;
	snprintf(path, sizeof path, "%s/%s", ca, name);
	if (tls_open(&t, path, &e))
		fail_msg("%s", e.text);
	tls_close(t);
}

static void assert_same_file(const char *ca, const char *one, const char *other)
{
	char command[600];
	snprintf(command, sizeof command, "cmp -s '%s/%s' '%s/%s'", ca, one, ca, other);
	assert_int_equal(system(command), 0);
}

/* Returns the number of certificates of that name; *revoked: how many of them are revoked. */
static size_t count_certificates(const char *ca, const char *name, size_t *revoked)
{
	struct authority_entry *list;
	struct error e;
	size_t n, found = 0;
	*revoked = 0;
	if (authority_list(ca, &list, &n, &e))
		fail_msg("%s", e.text);
	for (size_t i = 0; i < n; i++)
		if (strcmp(list[i].subject.name, name) == 0) {
			found++;
			*revoked += list[i].is_revoked;
		}
	mem_free(list);
	return found;
}

static void check_reported_changes(const char *ca, int done)
{
	size_t revoked;
	if (done > INIT)
		count_certificates(ca, "nobody", &revoked);
	if (done > ISSUE_FARM)
		expect_opens(ca, "farm");
	if (done > ISSUE_NODE) { /* also during a renewal */
		assert_true(count_certificates(ca, "node", &revoked) >= 1);
		expect_opens(ca, "node");
	}
	if (done > RENEW_NODE)
		assert_int_equal(count_certificates(ca, "node", &revoked), 2);
	if (done > REVOKE_NODE) {
		assert_true(count_certificates(ca, "node", &revoked) == 2 && revoked == 2);
		assert_same_file(ca, "crl.pem", "farm/crl.pem");
	}
}

static void finish_commands(const char *ca, int done)
{
	struct error e;
	size_t revoked;
	for (int s = done; s < STEP_COUNT; s++) {
		int rc = run_step(ca, (enum step)s, &e);
		/* The command was interrupted when all of its changes were on the disk. */
		if (rc && !(s == done && rc == -EEXIST && s < RENEW_NODE))
			fail_msg("command %d: %s", s, e.text);
	}
	expect_opens(ca, "farm");
	expect_opens(ca, "node");
	size_t count = count_certificates(ca, "node", &revoked);
	assert_true(count >= 2 && count == revoked);
	assert_same_file(ca, "crl.pem", "farm/crl.pem");
}

static void power_loss_undoes_nothing_that_was_reported(void **state)
{
	(void)state;
	char root[100], after[100], ca[120], ca_after[120], command[400];
	int code;
	uint64_t lost = 0, renewed = 0; /* the last call while the certificate is renewed */
	snprintf(root, sizeof root, "%s/disk", temporary_folder);
	snprintf(after, sizeof after, "%s/after", temporary_folder);
	snprintf(ca, sizeof ca, "%s/ca", root);
	snprintf(ca_after, sizeof ca_after, "%s/ca", after);
	snprintf(command, sizeof command, "rm -rf '%s' '%s' && mkdir '%s'", root, after, root);
	for (uint64_t call = 1;; call++) {
		assert_int_equal(system(command), 0);
		code = run_until_power_loss(ca, root, after, call, call);
		if (code == 0) /* the commands ended before power was lost */
			break;
		assert_int_equal(code, FAULTY_DISK_EXIT_CODE);
		assert_true(call < CALLS_MAX);
		lost += shared->counts[3];
		renewed = shared->done_count == RENEW_NODE ? call : renewed;
		check_reported_changes(ca_after, shared->done_count);
		finish_commands(ca_after, shared->done_count);
	}
	assert_true(lost > 0);
	for (uint64_t seed = 0; seed < SEEDS; seed++) { /* either of the last two renames may be lost */
		assert_int_equal(system(command), 0);
		assert_int_equal(run_until_power_loss(ca, root, after, renewed, CALLS_MAX + seed),
				 FAULTY_DISK_EXIT_CODE);
		expect_opens(ca_after, "node");
	}
}

static bool renames_fail; /* renames that put a certificate in place fail */
static int fail_certificate_rename(const char *from, const char *to)
{
	const char *end = strstr(to, "/cert.pem");
	return renames_fail && end && !end[9] ? (errno = EIO, -1) : disk_system.rename(from, to);
}

/* The key was replaced and the certificate could not be: the old certificate is still used, listed and revoked. */
static void failed_renewal_keeps_the_old_certificate(void **state)
{
	(void)state;
	char ca[120];
	struct error e;
	size_t revoked;
	struct disk failing = disk_system;
	snprintf(ca, sizeof ca, "%s/failing", temporary_folder);
	failing.rename = fail_certificate_rename;
	for (int s = INIT; s < RENEW_NODE; s++)
		assert_int_equal(run_step(ca, (enum step)s, &e), 0);
	disk_set_calls(&failing);
	renames_fail = true;
	assert_int_equal(run_step(ca, RENEW_NODE, &e), -EIO);
	disk_set_calls(NULL);
	expect_opens(ca, "node");
	assert_int_equal(count_certificates(ca, "node", &revoked), 2);
	finish_commands(ca, RENEW_NODE);
}

/* An empty record does not hide the others: they are listed and revoked, and the damaged one is named. */
static void damaged_record_does_not_hide_the_others(void **state)
{
	(void)state;
	char ca[120], path[160], copy[160];
	struct error e;
	struct authority_entry *list;
	size_t n, before, after;
	unsigned count;
	snprintf(ca, sizeof ca, "%s/damaged", temporary_folder);
	for (int s = INIT; s < RENEW_NODE; s++)
		assert_int_equal(run_step(ca, (enum step)s, &e), 0);
	assert_int_equal(authority_list(ca, &list, &before, &e), 0);
	mem_free(list);
	snprintf(path, sizeof path, "%s/issued/0.pem", ca);
	FILE *f = fopen(path, "w");
	assert_non_null(f);
	fclose(f);
	assert_int_equal(authority_list(ca, &list, &after, &e), -EBADMSG);
	assert_non_null(strstr(e.text, "/issued/0.pem: "));
	assert_int_equal(after, before);
	mem_free(list);
	assert_int_equal(authority_revoke(ca, "nobody", &count, &e), -ENOENT);
	assert_int_equal(count, 0);
	assert_non_null(strstr(e.text, "/issued/0.pem: "));
	assert_int_equal(authority_revoke(ca, "node", &count, &e), -EBADMSG);
	assert_int_equal(count, 1);
	assert_non_null(strstr(e.text, "if that was a certificate of node, it is not revoked"));
	snprintf(copy, sizeof copy, "%s/away", ca);
	assert_int_equal(rename(path, copy), 0);
	assert_int_equal(count_certificates(ca, "node", &n), 1);
	assert_int_equal(n, 1);
	assert_same_file(ca, "crl.pem", "farm/crl.pem");
}

/* Certificates that could not be listed are neither revoked nor shown, and that is reported. */
static void failed_listing_of_records_is_reported(void **state)
{
	(void)state;
	char ca[120];
	struct error e;
	struct authority_entry *list;
	size_t n;
	unsigned count;
	snprintf(ca, sizeof ca, "%s/unlisted", temporary_folder);
	for (int s = INIT; s < RENEW_NODE; s++)
		assert_int_equal(run_step(ca, (enum step)s, &e), 0);
	failing_list_begin("/issued", 0, EIO);
	int revoked = authority_revoke(ca, "node", &count, &e);
	assert_int_equal(count, 0);
	assert_non_null(strstr(e.text, "/issued: "));
	int shown = authority_list(ca, &list, &n, &e);
	failing_list_end();
	assert_int_equal(revoked, -EIO);
	assert_int_equal(shown, -EIO);
	assert_int_equal(authority_revoke(ca, "node", &count, &e), 0);
	assert_int_equal(count, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(failed_renewal_keeps_the_old_certificate),
		cmocka_unit_test(damaged_record_does_not_hide_the_others),
		cmocka_unit_test(power_loss_undoes_nothing_that_was_reported),
		cmocka_unit_test(failed_listing_of_records_is_reported),
	};
	shared = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (shared == MAP_FAILED)
		return 1;
	return cmocka_run_group_tests(tests, temporary_folder_set_up, temporary_folder_tear_down);
}
