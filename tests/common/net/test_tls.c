/* SPDX-License-Identifier: Apache-2.0 */
/*
 * TLS handshakes in memory, with certificates of an authority that the test makes: which peers are accepted, which are
 * refused, and for what reason.
 */
#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/net/authority.h"
#include "common/net/conn.h"
#include "tests/support/tls_pair.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <errno.h>
#include <fcntl.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static time_t clock_lag; /* seconds by which the wall clock of this process (and of its OpenSSL) is slow */

time_t time(time_t *out)
{
	struct timespec now;
	clock_gettime(CLOCK_REALTIME, &now);
	if (out)
		*out = now.tv_sec - clock_lag;
	return now.tv_sec - clock_lag;
}

static void expect_accepted(const char *folder, const char *name, enum tls_role role)
{
	for (size_t piece = 1; piece < 100000; piece *= 317) {
		tls_pair_handshake(tls_pair_path(tls_pair_ours, folder), tls_pair_path(tls_pair_ours, "farm"), piece);
		if (tls_pair_listener.rc || tls_pair_caller.rc)
			fail_msg("%s: %s / %s", folder, tls_pair_caller.e.text, tls_pair_listener.e.text);
		assert_true(tls_link_is_open(tls_pair_caller.link) && tls_link_is_open(tls_pair_listener.link));
		assert_string_equal(tls_link_peer(tls_pair_listener.link)->name, name);
		assert_int_equal(tls_link_peer(tls_pair_listener.link)->role, role);
		assert_int_equal(tls_link_peer(tls_pair_caller.link)->role, TLS_COORDINATOR);
		assert_int_equal(tls_link_recheck(tls_pair_listener.link, &tls_pair_listener.e), 0);
		assert_int_equal(tls_link_recheck(tls_pair_caller.link, &tls_pair_caller.e), 0);
		tls_pair_close();
	}
}

static void certificates_of_the_farm_are_accepted(void **state)
{
	(void)state;
	expect_accepted("node", "node", TLS_WORKER);
	expect_accepted("ann", "ann", TLS_CLIENT);
	expect_accepted("root", "root", TLS_OPERATOR);
}

/* Both ends give up the handshake, and both report why. */
static void expect_failed_handshake(int rc, const char *caller_folder, const char *listener_folder,
				    const char *caller_says, const char *listener_says)
{
	tls_pair_handshake(caller_folder, listener_folder, 100000);
	assert_false(tls_link_is_open(tls_pair_listener.link));
	if (tls_pair_caller.rc != rc || !strstr(tls_pair_caller.e.text, caller_says))
		fail_msg("the caller says %d '%s', not '%s'", tls_pair_caller.rc, tls_pair_caller.e.text, caller_says);
	if (tls_pair_listener.rc != rc || !strstr(tls_pair_listener.e.text, listener_says))
		fail_msg("the listener says %d '%s', not '%s'", tls_pair_listener.rc, tls_pair_listener.e.text,
			 listener_says);
	tls_pair_close();
}

static void expect_refused(const char *caller_folder, const char *listener_folder, const char *caller_says,
			   const char *listener_says)
{
	expect_failed_handshake(-EACCES, caller_folder, listener_folder, caller_says, listener_says);
}

static void foreign_and_misused_certificates_are_refused(void **state)
{
	(void)state;
	expect_refused(tls_pair_path(tls_pair_theirs, "node"), tls_pair_path(tls_pair_ours, "farm"),
		       "certificate is not accepted", "does not accept this certificate");
	expect_refused(tls_pair_path(tls_pair_ours, "node"), tls_pair_path(tls_pair_theirs, "farm"),
		       "certificate is not accepted", "does not accept this certificate");
	/* A worker that poses as a coordinator to another worker: its certificate already has the wrong purpose. */
	expect_refused(tls_pair_path(tls_pair_ours, "node"), tls_pair_path(tls_pair_ours, "root"),
		       "certificate is not accepted", "does not accept this certificate");
	/* A coordinator never connects as a client. */
	expect_refused(tls_pair_path(tls_pair_ours, "farm"), tls_pair_path(tls_pair_ours, "farm"),
		       "does not accept this certificate", "certificate is not accepted");
}

/* Folders made by hand: a caller trusts this farm but shows a certificate of another one, or the other way round. */
static void copy_file(const char *source, const char *target)
{
	static char bytes[1 << 16];
	int in = open(source, O_RDONLY | O_CLOEXEC), out = open(target, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	ssize_t n = read(in, bytes, sizeof bytes);
	assert_true(n > 0 && write(out, bytes, (size_t)n) == n);
	close(in);
	close(out);
}

static void foreign_certificate_beside_our_authority_is_refused(void **state)
{
	(void)state;
	char mixed[128], path[600];
	snprintf(mixed, sizeof mixed, "%s/mixed", tls_pair_root);
	assert_int_equal(mkdir(mixed, 0700), 0);
	snprintf(path, sizeof path, "%s/ca.pem", mixed);
	copy_file(tls_pair_path(tls_pair_ours, "ca.pem"), path);
	snprintf(path, sizeof path, "%s/cert.pem", mixed);
	copy_file(tls_pair_path(tls_pair_theirs, "node/cert.pem"), path);
	snprintf(path, sizeof path, "%s/key.pem", mixed);
	copy_file(tls_pair_path(tls_pair_theirs, "node/key.pem"), path);
	expect_refused(mixed, tls_pair_path(tls_pair_ours, "farm"), "does not accept this certificate",
		       "certificate is not accepted");
	/* ... and a key that belongs to another certificate is detected when the folder is opened. */
	copy_file(tls_pair_path(tls_pair_ours, "node/key.pem"), path);
	struct tls *t;
	struct error e;
	assert_int_equal(tls_open(&t, mixed, &e), -EBADMSG);
	chmod(path, 0604);
	assert_int_equal(tls_open(&t, mixed, &e), -EPERM);
	assert_int_equal(tls_open(&t, tls_pair_path(tls_pair_root, "nowhere"), &e), -EPERM);
}

static void add_extension(X509 *cert, int nid, const char *value)
{
	X509_EXTENSION *x = X509V3_EXT_conf_nid(NULL, NULL, nid, value);
	assert_non_null(x);
	assert_int_equal(X509_add_ext(cert, x, -1), 1);
	X509_EXTENSION_free(x);
}

static FILE *open_file(const char *folder, const char *name, const char *mode)
{
	FILE *f = fopen(tls_pair_path(folder, name), mode);
	assert_non_null(f);
	return f;
}

/* Makes a certificate that hslt-ca would never make, though signed by our authority: valid for servers and clients,
 * with any names. */
static const char *forge_certificate(const char *name, const char *shown, const char *other_names)
{
	static char folder[256];
	snprintf(folder, sizeof folder, "%s/%s", tls_pair_root, name);
	assert_int_equal(mkdir(folder, 0700), 0);
	copy_file(tls_pair_path(tls_pair_ours, "ca.pem"), tls_pair_path(folder, "ca.pem"));
	FILE *f = open_file(tls_pair_ours, "ca.key", "r");
	EVP_PKEY *signer = PEM_read_PrivateKey(f, NULL, NULL, NULL), *key = EVP_EC_gen("P-256");
	fclose(f);
	f = open_file(tls_pair_ours, "ca.pem", "r");
	X509 *ca = PEM_read_X509(f, NULL, NULL, NULL), *cert = X509_new();
	fclose(f);
	assert_true(signer && key && ca && cert);
	X509_set_version(cert, 2);
	ASN1_INTEGER_set(X509_get_serialNumber(cert), 77);
	X509_set_issuer_name(cert, X509_get_subject_name(ca));
	X509_NAME_add_entry_by_txt(X509_get_subject_name(cert), "CN", MBSTRING_UTF8, (const unsigned char *)shown, -1,
				   -1, 0);
	X509_gmtime_adj(X509_getm_notBefore(cert), -60);
	X509_gmtime_adj(X509_getm_notAfter(cert), 3600);
	X509_set_pubkey(cert, key);
	add_extension(cert, NID_ext_key_usage, "serverAuth,clientAuth");
	if (other_names)
		add_extension(cert, NID_subject_alt_name, other_names);
	assert_true(X509_sign(cert, signer, EVP_sha256()) > 0);
	f = open_file(folder, "cert.pem", "w");
	PEM_write_X509(f, cert);
	fclose(f);
	f = open_file(folder, "key.pem", "w");
	PEM_write_PrivateKey(f, key, NULL, NULL, 0, NULL, NULL);
	fclose(f);
	chmod(tls_pair_path(folder, "key.pem"), 0600);
	X509_free(ca);
	X509_free(cert);
	EVP_PKEY_free(key);
	EVP_PKEY_free(signer);
	return folder;
}

/* A malicious caller: any certificate or none, any TLS version, and it accepts whichever server answers. */
static void expect_raw_caller(const char *folder, int version, const char *listener_says)
{
	SSL_CTX *context = SSL_CTX_new(TLS_client_method());
	SSL_CTX_set_max_proto_version(context, version);
	if (folder) {
		assert_int_equal(
			SSL_CTX_use_certificate_file(context, tls_pair_path(folder, "cert.pem"), SSL_FILETYPE_PEM), 1);
		assert_int_equal(
			SSL_CTX_use_PrivateKey_file(context, tls_pair_path(folder, "key.pem"), SSL_FILETYPE_PEM), 1);
	}
	SSL *ssl = SSL_new(context);
	BIO *in = BIO_new(BIO_s_mem()), *out = BIO_new(BIO_s_mem());
	BIO_set_mem_eof_return(in, -1);
	SSL_set_bio(ssl, in, out);
	SSL_set_connect_state(ssl);
	tls_pair_end_open(&tls_pair_listener, tls_pair_path(tls_pair_ours, "farm"), true);
	for (int turn = 0; turn < 6; turn++) {
		char *bytes;
		const unsigned char *answer;
		char word;
		SSL_read(ssl, &word, 1);
		long size = BIO_get_mem_data(out, &bytes);
		if (size > 0 && !tls_pair_listener.rc) {
			tls_pair_listener.rc =
				tls_link_receive(tls_pair_listener.link, bytes, (size_t)size, &tls_pair_listener.e);
			tls_pair_end_read(&tls_pair_listener);
		}
		(void)BIO_reset(out);
		size_t answer_size = tls_link_output(tls_pair_listener.link, &answer);
		BIO_write(in, answer, (int)answer_size);
		tls_link_clear_output(tls_pair_listener.link);
	}
	if (*listener_says) {
		assert_false(tls_link_is_open(tls_pair_listener.link));
		if (tls_pair_listener.rc >= 0 || !strstr(tls_pair_listener.e.text, listener_says))
			fail_msg("the listener says %d '%s', not '%s'", tls_pair_listener.rc, tls_pair_listener.e.text,
				 listener_says);
	} else {
		assert_true(tls_link_is_open(tls_pair_listener.link));
	}
	tls_pair_end_close(&tls_pair_listener);
	SSL_free(ssl);
	SSL_CTX_free(context);
}

static void certificates_need_one_role_and_a_name(void **state)
{
	(void)state;
	/* The caller of this test can succeed. */
	expect_raw_caller(tls_pair_path(tls_pair_ours, "node"), TLS1_3_VERSION, "");
	expect_raw_caller(NULL, TLS1_3_VERSION, "the peer has no certificate");
	expect_raw_caller(tls_pair_path(tls_pair_ours, "node"), TLS1_2_VERSION, "unsupported protocol");
	expect_raw_caller(forge_certificate("good", "good", "URI:hslt:role:client"), TLS1_3_VERSION, "");
	expect_raw_caller(forge_certificate("none", "none", NULL), TLS1_3_VERSION, "no role");
	expect_raw_caller(forge_certificate("two", "two", "URI:hslt:role:client,URI:hslt:role:worker"), TLS1_3_VERSION,
			  "no role");
	expect_raw_caller(forge_certificate("like", "like", "URI:hslt:role:workers"), TLS1_3_VERSION, "no role");
	expect_raw_caller(forge_certificate("part", "part", "URI:hslt:role:work"), TLS1_3_VERSION, "no role");
	expect_raw_caller(forge_certificate("dns", "dns", "DNS:hslt:role:worker"), TLS1_3_VERSION, "no role");
	expect_raw_caller(forge_certificate("name", "../name", "URI:hslt:role:client"), TLS1_3_VERSION, "no name");
	expect_raw_caller(forge_certificate("line", "a\nb", "URI:hslt:role:client"), TLS1_3_VERSION, "no name");
	/* A certificate whose purpose would do, but whose name is not the coordinator's, cannot be used to pose as one.
	 */
	/* Uses what tls_pair_path returns. */
	const char *farm = forge_certificate("false", "farm", "URI:hslt:role:worker");
	expect_refused(tls_pair_path(tls_pair_ours, "node"), farm, "certificate of a worker, not of a coordinator",
		       "does not accept this certificate");
}

static void expired_certificate_is_refused(void **state)
{
	(void)state;
	tls_pair_issue(tls_pair_ours, "brief", TLS_WORKER, 3.0 / 86400);
	tls_pair_handshake(tls_pair_path(tls_pair_ours, "brief"), tls_pair_path(tls_pair_ours, "farm"), 100000);
	while (!tls_link_is_open(tls_pair_listener.link)) { /* if the machine stood still meanwhile, once more */
		struct error e;
		if (tls_pair_listener.rc != -EKEYEXPIRED || !strstr(tls_pair_listener.e.text, "expired"))
			fail_msg("the listener says %d '%s'", tls_pair_listener.rc, tls_pair_listener.e.text);
		tls_pair_close();
		assert_int_equal(authority_issue(tls_pair_ours, "brief", TLS_WORKER, 3.0 / 86400, true, &e), 0);
		tls_pair_handshake(tls_pair_path(tls_pair_ours, "brief"), tls_pair_path(tls_pair_ours, "farm"), 100000);
	}
	int rc;
	while ((rc = tls_link_recheck(tls_pair_listener.link, &tls_pair_listener.e)) == 0)
		usleep(50000);
	assert_int_equal(rc, -EKEYEXPIRED);
	assert_non_null(strstr(tls_pair_listener.e.text, "expired"));
	tls_pair_close();
	expect_failed_handshake(-EKEYEXPIRED, tls_pair_path(tls_pair_ours, "brief"),
				tls_pair_path(tls_pair_ours, "farm"), "expired by the clock of its machine", "expired");
}

/* A clock that is years off: the error sentence tells which clock. */
static void a_wrong_clock_is_named(void **state)
{
	(void)state;
	static const time_t off[] = {(time_t)20 * 365 * 86400, -(time_t)20 * 365 * 86400};
	for (size_t i = 0; i < 2; i++) {
		char year[64];
		struct tm tm;
		clock_lag = off[i];
		time_t now = time(NULL);
		strftime(year, sizeof year, "by the clock of this machine, %Y-", gmtime_r(&now, &tm));
		tls_pair_handshake(tls_pair_path(tls_pair_ours, "node"), tls_pair_path(tls_pair_ours, "farm"), 100000);
		clock_lag = 0;
		assert_int_equal(tls_pair_caller.rc, -EKEYEXPIRED);
		assert_int_equal(tls_pair_listener.rc, -EKEYEXPIRED);
		assert_non_null(strstr(tls_pair_caller.e.text, year));
		assert_non_null(strstr(tls_pair_caller.e.text, i ? "expired" : "not yet valid"));
		tls_pair_close();
	}
}

/* hslt-ca was killed, or its disk was full, after it had written the authority's own list. */
static void interrupted_revocation_can_be_repeated(void **state)
{
	(void)state;
	unsigned count;
	struct error e;
	tls_pair_issue(tls_pair_ours, "half", TLS_WORKER, 5);
	copy_file(tls_pair_path(tls_pair_ours, "farm/crl.pem"), tls_pair_path(tls_pair_ours, "before.pem"));
	assert_int_equal(authority_revoke(tls_pair_ours, "half", &count, &e), 0);
	copy_file(tls_pair_path(tls_pair_ours, "before.pem"), tls_pair_path(tls_pair_ours, "farm/crl.pem"));
	expect_accepted("half", "half", TLS_WORKER);
	assert_int_equal(authority_revoke(tls_pair_ours, "half", &count, &e), 0);
	assert_int_equal(count, 0);
	expect_refused(tls_pair_path(tls_pair_ours, "half"), tls_pair_path(tls_pair_ours, "farm"), "revoked",
		       "revoked");
	assert_int_equal(authority_revoke(tls_pair_ours, "nobody", &count, &e), -ENOENT);
	assert_non_null(strstr(e.text, "no valid certificate"));
}

static unsigned remaining_writes;

static ssize_t write_until_full(int fd, const void *bytes, size_t size)
{
	if (remaining_writes) {
		remaining_writes--;
		return disk_system.write(fd, bytes, size);
	}
	errno = ENOSPC;
	return -1;
}

static size_t count_certificates(void)
{
	struct authority_entry *list;
	struct error e;
	size_t n = 0;
	assert_int_equal(authority_list(tls_pair_ours, &list, &n, &e), 0);
	mem_free(list);
	return n;
}

/* The disk may fill up at any write: a party that had a certificate still has one, a party that gets none may ask again
 * as before, and no certificate is listed that does not exist. */
static void a_full_disk_takes_no_certificate_away(void **state)
{
	(void)state;
	struct disk full = disk_system;
	struct error e;
	full.write = write_until_full;
	tls_pair_issue(tls_pair_ours, "steady", TLS_WORKER, 5);
	for (int renew = 1; renew >= 0; renew--) {
		unsigned room = 0;
		const char *name = renew ? "steady" : "late";
		const size_t before = count_certificates();
		for (int rc = -1; rc; room++) {
			remaining_writes = room;
			disk_set_calls(&full);
			rc = authority_issue(tls_pair_ours, name, TLS_WORKER, 5, renew, &e);
			disk_set_calls(NULL);
			assert_true(rc == 0 || rc == -ENOSPC);
			assert_int_equal(count_certificates(), before + (rc == 0));
			assert_int_equal(access(tls_pair_path(tls_pair_ours, "steady/cert.pem.next"), F_OK), -1);
			if (renew || !rc)
				expect_accepted(name, name, TLS_WORKER);
		}
		assert_int_equal(room, 6);
	}
	assert_int_equal(authority_issue(tls_pair_ours, "late", TLS_WORKER, 5, false, &e), -EEXIST);
	/* A folder that is not a certificate's is left alone. */
	assert_int_equal(mkdir(tls_pair_path(tls_pair_ours, "mine"), 0700), 0);
	copy_file(tls_pair_path(tls_pair_ours, "ca.pem"), tls_pair_path(tls_pair_ours, "mine/letter"));
	assert_int_equal(authority_issue(tls_pair_ours, "mine", TLS_WORKER, 5, false, &e), -EEXIST);
}

static unsigned remaining_renames;

static int rename_until_error(const char *from, const char *to)
{
	if (remaining_renames) {
		remaining_renames--;
		return disk_system.rename(from, to);
	}
	errno = EIO;
	return -1;
}

/* Whichever step fails: no key or certificate is left unrecorded, and the pair that is there can be used. Once the key
 * has been replaced it stays: the certificate then lies beside it. */
static void failed_renewal_leaves_nothing_unrecorded(void **state)
{
	(void)state;
	struct disk bad = disk_system;
	struct error e;
	bad.rename = rename_until_error;
	tls_pair_issue(tls_pair_ours, "tidy", TLS_WORKER, 5);
	size_t before = count_certificates();
	unsigned allowed = 0, half_count = 0;
	for (int rc = -1; rc; allowed++) {
		remaining_renames = allowed;
		disk_set_calls(&bad);
		rc = authority_issue(tls_pair_ours, "tidy", TLS_WORKER, 5, true, &e);
		disk_set_calls(NULL);
		assert_true(rc == 0 || rc == -EIO);
		bool is_half = access(tls_pair_path(tls_pair_ours, "tidy/cert.pem.next"), F_OK) == 0;
		half_count += is_half;
		before += is_half;
		assert_int_equal(count_certificates(), before + (rc == 0));
		assert_true(rc != 0 || !is_half);
		assert_int_equal(access(tls_pair_path(tls_pair_ours, "tidy/key.pem.next"), F_OK), -1);
		expect_accepted("tidy", "tidy", TLS_WORKER);
	}
	assert_int_equal(allowed, 8);
	assert_int_equal(half_count, 1);
	expect_accepted("tidy", "tidy", TLS_WORKER);
}

static void revoked_certificate_is_refused(void **state)
{
	(void)state;
	unsigned count;
	struct error e;
	tls_pair_issue(tls_pair_ours, "gone", TLS_WORKER, 5);
	assert_int_equal(tls_open(&tls_pair_listener.tls, tls_pair_path(tls_pair_ours, "farm"), &e), 0);
	tls_close(tls_pair_listener.tls);
	tls_pair_handshake(tls_pair_path(tls_pair_ours, "gone"), tls_pair_path(tls_pair_ours, "farm"), 100000);
	assert_true(tls_link_is_open(tls_pair_listener.link));
	assert_int_equal(tls_refresh(tls_pair_listener.tls, &e), 0);
	assert_int_equal(authority_revoke(tls_pair_ours, "gone", &count, &e), 0);
	assert_int_equal(count, 1);
	assert_int_equal(authority_revoke(tls_pair_ours, "gone", &count, &e), 0);
	assert_int_equal(count, 0);
	assert_int_equal(tls_link_recheck(tls_pair_listener.link, &e), 0); /* the new list has not been read yet */
	assert_int_equal(tls_refresh(tls_pair_listener.tls, &e), 1);
	assert_int_equal(tls_link_recheck(tls_pair_listener.link, &e), -EACCES);
	assert_non_null(strstr(e.text, "revoked"));
	/* A list stays in force after its file is removed. */
	assert_int_equal(unlink(tls_pair_path(tls_pair_ours, "farm/crl.pem")), 0);
	assert_int_equal(tls_refresh(tls_pair_listener.tls, &e), -ENOENT);
	assert_int_equal(tls_refresh(tls_pair_listener.tls, &e), 0); /* this is reported once */
	assert_int_equal(tls_link_recheck(tls_pair_listener.link, &e), -EACCES);
	time_t until = tls_own_certificate(tls_pair_listener.tls)->expiry_time;
	assert_int_equal(authority_issue(tls_pair_ours, "farm", TLS_COORDINATOR, 50, true, &e), 0);
	unlink(tls_pair_path(tls_pair_ours, "farm/crl.pem")); /* a renewal need not bring a list */
	assert_int_equal(tls_refresh(tls_pair_listener.tls, &e), 1);
	assert_true(tls_own_certificate(tls_pair_listener.tls)->expiry_time != until);
	assert_int_equal(tls_link_recheck(tls_pair_listener.link, &e), -EACCES);
	assert_non_null(strstr(e.text, "revoked"));
	copy_file(tls_pair_path(tls_pair_ours, "crl.pem"), tls_pair_path(tls_pair_ours, "farm/crl.pem"));
	assert_int_equal(tls_refresh(tls_pair_listener.tls, &e), 1);
	tls_pair_close();
	expect_refused(tls_pair_path(tls_pair_ours, "gone"), tls_pair_path(tls_pair_ours, "farm"), "revoked",
		       "revoked");
	expect_accepted("node", "node", TLS_WORKER);
	/* Revocation is by serial number: a renewed certificate of the same name stays valid. */
	struct authority_entry *list;
	size_t n;
	tls_pair_issue(tls_pair_ours, "twice", TLS_WORKER, 5);
	assert_int_equal(authority_list(tls_pair_ours, &list, &n, &e), 0);
	char serial[48] = "";
	for (size_t i = 0; i < n; i++) {
		assert_int_equal(list[i].is_revoked, strcmp(list[i].subject.name, "gone") == 0);
		if (strcmp(list[i].subject.name, "twice") == 0)
			strcpy(serial, list[i].subject.serial);
	}
	mem_free(list);
	assert_int_equal(authority_issue(tls_pair_ours, "twice", TLS_WORKER, 5, false, &e), -EEXIST);
	assert_int_equal(authority_issue(tls_pair_ours, "twice", TLS_WORKER, 5, true, &e), 0);
	assert_int_equal(authority_revoke(tls_pair_ours, serial, &count, &e), 0);
	assert_int_equal(count, 1);
	expect_accepted("twice", "twice", TLS_WORKER);
}

/* Clocks may be a second behind that of the machine that made certificates and lists. */
static void slow_clocks_are_tolerated(void **state)
{
	(void)state;
	unsigned count;
	struct error e;
	tls_pair_issue(tls_pair_ours, "former", TLS_WORKER, 5);
	assert_int_equal(authority_revoke(tls_pair_ours, "former", &count, &e), 0);
	clock_lag = 2 * 3600;
	expect_accepted("node", "node", TLS_WORKER);
	expect_refused(tls_pair_path(tls_pair_ours, "former"), tls_pair_path(tls_pair_ours, "farm"), "revoked",
		       "revoked");
	clock_lag = 5 * 86400;
	expect_failed_handshake(-EKEYEXPIRED, tls_pair_path(tls_pair_ours, "node"),
				tls_pair_path(tls_pair_ours, "farm"), "not yet valid", "");
	clock_lag = 0;
}

static void append_file(const char *source, const char *target)
{
	static char bytes[1 << 16];
	int in = open(source, O_RDONLY | O_CLOEXEC), out = open(target, O_WRONLY | O_APPEND | O_CLOEXEC);
	ssize_t n = read(in, bytes, sizeof bytes);
	assert_true(n > 0 && write(out, bytes, (size_t)n) == n);
	close(in);
	close(out);
}

/* How a farm changes its authority without a day on which peers are refused: first both are trusted everywhere, then
 * new certificates are issued, then the old authority is removed. */
static void authority_can_be_replaced_without_refusals(void **state)
{
	(void)state;
	struct error e;
	unsigned count;
	char farm[256], node[256];
	tls_pair_issue(tls_pair_ours, "old-farm", TLS_COORDINATOR, 5);
	tls_pair_issue(tls_pair_ours, "old-node", TLS_WORKER, 5);
	tls_pair_issue(tls_pair_theirs, "lost", TLS_WORKER, 5);
	snprintf(farm, sizeof farm, "%s/old-farm", tls_pair_ours);
	snprintf(node, sizeof node, "%s/old-node", tls_pair_ours);
	static const char *const files[] = {"ca.pem", "crl.pem"};
	for (size_t i = 0; i < 2; i++) {
		append_file(tls_pair_path(tls_pair_theirs, files[i]), tls_pair_path(farm, files[i]));
		append_file(tls_pair_path(tls_pair_theirs, files[i]), tls_pair_path(node, files[i]));
	}
	char new_node[256], new_lost[256];
	snprintf(new_node, sizeof new_node, "%s/node", tls_pair_theirs);
	snprintf(new_lost, sizeof new_lost, "%s/lost", tls_pair_theirs);
	append_file(tls_pair_path(tls_pair_ours, "ca.pem"), tls_pair_path(new_node, "ca.pem"));
	append_file(tls_pair_path(tls_pair_ours, "crl.pem"), tls_pair_path(new_node, "crl.pem"));
	append_file(tls_pair_path(tls_pair_ours, "ca.pem"), tls_pair_path(new_lost, "ca.pem"));
	append_file(tls_pair_path(tls_pair_ours, "crl.pem"), tls_pair_path(new_lost, "crl.pem"));
	const char *const callers[] = {node, new_node, new_lost};
	for (size_t i = 0; i < 3; i++) {
		tls_pair_handshake(callers[i], farm, 100000);
		if (tls_pair_caller.rc || tls_pair_listener.rc)
			fail_msg("%s: %s / %s", callers[i], tls_pair_caller.e.text, tls_pair_listener.e.text);
		assert_true(tls_link_is_open(tls_pair_listener.link));
		tls_pair_close();
	}
	/* The lists of both authorities apply. */
	assert_int_equal(authority_revoke(tls_pair_theirs, "lost", &count, &e), 0);
	assert_int_equal(authority_revoke(tls_pair_ours, "old-node", &count, &e), 0);
	copy_file(tls_pair_path(tls_pair_ours, "crl.pem"), tls_pair_path(farm, "crl.pem"));
	append_file(tls_pair_path(tls_pair_theirs, "crl.pem"), tls_pair_path(farm, "crl.pem"));
	expect_refused(new_lost, farm, "revoked", "revoked");
	expect_refused(node, farm, "revoked", "revoked");
	tls_pair_handshake(new_node, farm, 100000);
	assert_true(tls_link_is_open(tls_pair_listener.link));
	tls_pair_close();
	/* The old authority is removed: its certificates are refused. */
	copy_file(tls_pair_path(tls_pair_theirs, "ca.pem"), tls_pair_path(farm, "ca.pem"));
	copy_file(tls_pair_path(tls_pair_theirs, "crl.pem"), tls_pair_path(farm, "crl.pem"));
	tls_pair_handshake(tls_pair_path(tls_pair_ours, "node"), farm, 100000);
	assert_false(tls_link_is_open(tls_pair_listener.link));
	tls_pair_close();
}

static void unsafe_certificate_names_are_refused(void **state)
{
	(void)state;
	struct error e;
	static const char *const bad[] = {"", ".", "..", "../up", "a/b", "-x", "a b", "a\nb", "issued", "\xc3\xa4"};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		assert_int_equal(authority_issue(tls_pair_ours, bad[i], TLS_CLIENT, 5, true, &e), -EINVAL);
	assert_int_equal(authority_create(tls_pair_ours, "again", 5, &e), -EEXIST);
	struct stat st;
	assert_int_equal(stat(tls_pair_path(tls_pair_ours, "ca.key"), &st), 0);
	assert_int_equal(st.st_mode & 0777, 0600);
	assert_int_equal(stat(tls_pair_path(tls_pair_ours, "node/key.pem"), &st), 0);
	assert_int_equal(st.st_mode & 0777, 0600);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(expired_certificate_is_refused),
		cmocka_unit_test(certificates_of_the_farm_are_accepted),
		cmocka_unit_test(foreign_and_misused_certificates_are_refused),
		cmocka_unit_test(foreign_certificate_beside_our_authority_is_refused),
		cmocka_unit_test(certificates_need_one_role_and_a_name),
		cmocka_unit_test(revoked_certificate_is_refused),
		cmocka_unit_test(a_wrong_clock_is_named),
		cmocka_unit_test(interrupted_revocation_can_be_repeated),
		cmocka_unit_test(a_full_disk_takes_no_certificate_away),
		cmocka_unit_test(failed_renewal_leaves_nothing_unrecorded),
		cmocka_unit_test(slow_clocks_are_tolerated),
		cmocka_unit_test(authority_can_be_replaced_without_refusals),
		cmocka_unit_test(unsafe_certificate_names_are_refused),
	};
	return cmocka_run_group_tests(tests, tls_pair_set_up, tls_pair_tear_down);
}
