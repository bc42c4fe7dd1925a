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
#include "tests/support/folder.h"

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

enum { CALLS_MOST = 1000, SEEDS = 16 };

/* The commands, in order. */
enum step { INIT, FARM, NODE, RENEWED, REVOKED, STEPS };

static struct shared {
	_Atomic uint64_t counts[FAULTY_DISK_COUNTS];
	_Atomic int done; /* commands that have ended without an error */
} * shared;

static int run_step(const char *ca, enum step s, struct error *e)
{
	unsigned count;
	switch (s) {
	case INIT:
		return authority_init(ca, "test", 100, e);
	case FARM:
		return authority_issue(ca, "farm", TLS_COORDINATOR, 50, false, e);
	case NODE:
		return authority_issue(ca, "node", TLS_WORKER, 50, false, e);
	case RENEWED:
		return authority_issue(ca, "node", TLS_WORKER, 60, true, e);
	default:
		return authority_revoke(ca, "node", &count, e);
	}
}

/* Returns the exit code of a process whose disk loses power at that call. */
static int run_until(const char *ca, const char *root, const char *after, uint64_t lose_at, uint64_t seed)
{
	int status;
	*shared = (struct shared){.done = 0};
	pid_t pid = fork();
	if (pid == 0) {
		struct faulty_disk d = {
			.root = root, .after = after, .seed = seed, .lose_at = lose_at, .counts = shared->counts};
		struct error e;
		faulty_disk_begin(&d);
		for (int s = 0; s < STEPS; s++, shared->done++)
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

static void same_file(const char *ca, const char *one, const char *other)
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
		if (strcmp(list[i].who.name, name) == 0) {
			found++;
			*revoked += list[i].revoked;
		}
	mem_free(list);
	return found;
}

static void what_was_reported_is_there(const char *ca, int done)
{
	size_t revoked;
	if (done > INIT)
		count_certificates(ca, "nobody", &revoked);
	if (done > FARM)
		expect_opens(ca, "farm");
	if (done > NODE) { /* also during a renewal */
		assert_true(count_certificates(ca, "node", &revoked) >= 1);
		expect_opens(ca, "node");
	}
	if (done > RENEWED)
		assert_int_equal(count_certificates(ca, "node", &revoked), 2);
	if (done > REVOKED) {
		assert_true(count_certificates(ca, "node", &revoked) == 2 && revoked == 2);
		same_file(ca, "crl.pem", "farm/crl.pem");
	}
}

static void the_rest_can_be_done(const char *ca, int done)
{
	struct error e;
	size_t revoked;
	for (int s = done; s < STEPS; s++) {
		int rc = run_step(ca, (enum step)s, &e);
		/* The command was interrupted when all of its changes were on the disk. */
		if (rc && !(s == done && rc == -EEXIST && s < RENEWED))
			fail_msg("command %d: %s", s, e.text);
	}
	expect_opens(ca, "farm");
	expect_opens(ca, "node");
	size_t all = count_certificates(ca, "node", &revoked);
	assert_true(all >= 2 && all == revoked);
	same_file(ca, "crl.pem", "farm/crl.pem");
}

static void a_loss_of_power_undoes_nothing_that_was_reported(void **state)
{
	(void)state;
	char root[100], after[100], ca[120], ca_after[120], command[400];
	int code;
	uint64_t lost = 0, renewed = 0; /* the last call while the certificate is renewed */
	snprintf(root, sizeof root, "%s/disk", folder);
	snprintf(after, sizeof after, "%s/after", folder);
	snprintf(ca, sizeof ca, "%s/ca", root);
	snprintf(ca_after, sizeof ca_after, "%s/ca", after);
	snprintf(command, sizeof command, "rm -rf '%s' '%s' && mkdir '%s'", root, after, root);
	for (uint64_t at = 1;; at++) {
		assert_int_equal(system(command), 0);
		code = run_until(ca, root, after, at, at);
		if (code == 0) /* the commands ended before power was lost */
			break;
		assert_int_equal(code, FAULTY_DISK_EXIT);
		assert_true(at < CALLS_MOST);
		lost += shared->counts[3];
		renewed = shared->done == RENEWED ? at : renewed;
		what_was_reported_is_there(ca_after, shared->done);
		the_rest_can_be_done(ca_after, shared->done);
	}
	assert_true(lost > 0);
	for (uint64_t seed = 0; seed < SEEDS; seed++) { /* either of the last two renames may be lost */
		assert_int_equal(system(command), 0);
		assert_int_equal(run_until(ca, root, after, renewed, CALLS_MOST + seed), FAULTY_DISK_EXIT);
		expect_opens(ca_after, "node");
	}
}

static bool fails; /* renames that put a certificate in place fail */
static int failing_rename(const char *from, const char *to)
{
	const char *end = strstr(to, "/cert.pem");
	return fails && end && !end[9] ? (errno = EIO, -1) : disk_system.rename(from, to);
}

/* The key was replaced and the certificate could not be: the old certificate is still used, listed and revoked. */
static void a_failure_between_key_and_certificate(void **state)
{
	(void)state;
	char ca[120];
	struct error e;
	size_t revoked;
	struct disk failing = disk_system;
	snprintf(ca, sizeof ca, "%s/failing", folder);
	failing.rename = failing_rename;
	for (int s = INIT; s < RENEWED; s++)
		assert_int_equal(run_step(ca, (enum step)s, &e), 0);
	disk_use(&failing);
	fails = true;
	assert_int_equal(run_step(ca, RENEWED, &e), -EIO);
	disk_use(NULL);
	expect_opens(ca, "node");
	assert_int_equal(count_certificates(ca, "node", &revoked), 2);
	the_rest_can_be_done(ca, RENEWED);
}

/* An empty record does not hide the others: they are listed and revoked, and the damaged one is named. */
static void a_damaged_record(void **state)
{
	(void)state;
	char ca[120], path[160], copy[160];
	struct error e;
	struct authority_entry *list;
	size_t n, before, after;
	unsigned count;
	snprintf(ca, sizeof ca, "%s/damaged", folder);
	for (int s = INIT; s < RENEWED; s++)
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
	same_file(ca, "crl.pem", "farm/crl.pem");
}

/* Certificates that could not be listed are neither revoked nor shown, and that is reported. */
static void a_record_that_cannot_be_listed(void **state)
{
	(void)state;
	char ca[120];
	struct error e;
	struct authority_entry *list;
	size_t n;
	unsigned count;
	snprintf(ca, sizeof ca, "%s/unlisted", folder);
	for (int s = INIT; s < RENEWED; s++)
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
		cmocka_unit_test(a_failure_between_key_and_certificate),
		cmocka_unit_test(a_damaged_record),
		cmocka_unit_test(a_loss_of_power_undoes_nothing_that_was_reported),
		cmocka_unit_test(a_record_that_cannot_be_listed),
	};
	shared = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (shared == MAP_FAILED)
		return 1;
	return cmocka_run_group_tests(tests, folder_set_up, folder_tear_down);
}
