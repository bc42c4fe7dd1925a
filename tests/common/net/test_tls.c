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

static time_t behind; /* seconds by which the wall clock of this process (and of its OpenSSL) is slow */

time_t time(time_t *out)
{
	struct timespec now;
	clock_gettime(CLOCK_REALTIME, &now);
	if (out)
		*out = now.tv_sec - behind;
	return now.tv_sec - behind;
}

static void accepts(const char *folder, const char *name, enum tls_role role)
{
	for (size_t piece = 1; piece < 100000; piece *= 317) {
		pair_shake(pair_at(pair_ours, folder), pair_at(pair_ours, "farm"), piece);
		if (pair_listener.rc || pair_caller.rc)
			fail_msg("%s: %s / %s", folder, pair_caller.e.text, pair_listener.e.text);
		assert_true(tls_link_is_open(pair_caller.link) && tls_link_is_open(pair_listener.link));
		assert_string_equal(tls_link_peer(pair_listener.link)->name, name);
		assert_int_equal(tls_link_peer(pair_listener.link)->role, role);
		assert_int_equal(tls_link_peer(pair_caller.link)->role, TLS_COORDINATOR);
		assert_int_equal(tls_link_recheck(pair_listener.link, &pair_listener.e), 0);
		assert_int_equal(tls_link_recheck(pair_caller.link, &pair_caller.e), 0);
		pair_hang_up();
	}
}

static void those_of_the_farm_are_let_in(void **state)
{
	(void)state;
	accepts("node", "node", TLS_WORKER);
	accepts("ann", "ann", TLS_CLIENT);
	accepts("root", "root", TLS_OPERATOR);
}

/* Both ends give up the handshake, and both report why. */
static void gives_up(int rc, const char *from, const char *to, const char *caller_says, const char *listener_says)
{
	pair_shake(from, to, 100000);
	assert_false(tls_link_is_open(pair_listener.link));
	if (pair_caller.rc != rc || !strstr(pair_caller.e.text, caller_says))
		fail_msg("the caller says %d '%s', not '%s'", pair_caller.rc, pair_caller.e.text, caller_says);
	if (pair_listener.rc != rc || !strstr(pair_listener.e.text, listener_says))
		fail_msg("the listener says %d '%s', not '%s'", pair_listener.rc, pair_listener.e.text, listener_says);
	pair_hang_up();
}

static void refuses(const char *from, const char *to, const char *caller_says, const char *listener_says)
{
	gives_up(-EACCES, from, to, caller_says, listener_says);
}

static void others_are_not(void **state)
{
	(void)state;
	refuses(pair_at(pair_theirs, "node"), pair_at(pair_ours, "farm"), "certificate is not accepted",
		"does not accept this certificate");
	refuses(pair_at(pair_ours, "node"), pair_at(pair_theirs, "farm"), "certificate is not accepted",
		"does not accept this certificate");
	/* A worker that poses as a coordinator to another worker: its certificate already has the wrong purpose. */
	refuses(pair_at(pair_ours, "node"), pair_at(pair_ours, "root"), "certificate is not accepted",
		"does not accept this certificate");
	/* A coordinator never connects as a client. */
	refuses(pair_at(pair_ours, "farm"), pair_at(pair_ours, "farm"), "does not accept this certificate",
		"certificate is not accepted");
}

/* Folders made by hand: a caller trusts this farm but shows a certificate of another one, or the other way round. */
static void copy(const char *from, const char *to)
{
	static char bytes[1 << 16];
	int in = open(from, O_RDONLY | O_CLOEXEC), out = open(to, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
	ssize_t n = read(in, bytes, sizeof bytes);
	assert_true(n > 0 && write(out, bytes, (size_t)n) == n);
	close(in);
	close(out);
}

static void a_foreign_certificate_with_our_authority_beside_it(void **state)
{
	(void)state;
	char mixed[128], path[600];
	snprintf(mixed, sizeof mixed, "%s/mixed", pair_root);
	assert_int_equal(mkdir(mixed, 0700), 0);
	snprintf(path, sizeof path, "%s/ca.pem", mixed);
	copy(pair_at(pair_ours, "ca.pem"), path);
	snprintf(path, sizeof path, "%s/cert.pem", mixed);
	copy(pair_at(pair_theirs, "node/cert.pem"), path);
	snprintf(path, sizeof path, "%s/key.pem", mixed);
	copy(pair_at(pair_theirs, "node/key.pem"), path);
	refuses(mixed, pair_at(pair_ours, "farm"), "does not accept this certificate", "certificate is not accepted");
	/* ... and a key that belongs to another certificate is detected when the folder is opened. */
	copy(pair_at(pair_ours, "node/key.pem"), path);
	struct tls *t;
	struct error e;
	assert_int_equal(tls_open(&t, mixed, &e), -EBADMSG);
	chmod(path, 0604);
	assert_int_equal(tls_open(&t, mixed, &e), -EPERM);
	assert_int_equal(tls_open(&t, pair_at(pair_root, "nowhere"), &e), -EPERM);
}

static void add(X509 *cert, int nid, const char *value)
{
	X509_EXTENSION *x = X509V3_EXT_conf_nid(NULL, NULL, nid, value);
	assert_non_null(x);
	assert_int_equal(X509_add_ext(cert, x, -1), 1);
	X509_EXTENSION_free(x);
}

static FILE *file(const char *folder, const char *name, const char *mode)
{
	FILE *f = fopen(pair_at(folder, name), mode);
	assert_non_null(f);
	return f;
}

/* Makes a certificate that hslt-ca would never make, though signed by our authority: valid for servers and clients,
 * with any names. */
static const char *forge_certificate(const char *name, const char *shown, const char *other_names)
{
	static char folder[256];
	snprintf(folder, sizeof folder, "%s/%s", pair_root, name);
	assert_int_equal(mkdir(folder, 0700), 0);
	copy(pair_at(pair_ours, "ca.pem"), pair_at(folder, "ca.pem"));
	FILE *f = file(pair_ours, "ca.key", "r");
	EVP_PKEY *signer = PEM_read_PrivateKey(f, NULL, NULL, NULL), *key = EVP_EC_gen("P-256");
	fclose(f);
	f = file(pair_ours, "ca.pem", "r");
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
	add(cert, NID_ext_key_usage, "serverAuth,clientAuth");
	if (other_names)
		add(cert, NID_subject_alt_name, other_names);
	assert_true(X509_sign(cert, signer, EVP_sha256()) > 0);
	f = file(folder, "cert.pem", "w");
	PEM_write_X509(f, cert);
	fclose(f);
	f = file(folder, "key.pem", "w");
	PEM_write_PrivateKey(f, key, NULL, NULL, 0, NULL, NULL);
	fclose(f);
	chmod(pair_at(folder, "key.pem"), 0600);
	X509_free(ca);
	X509_free(cert);
	EVP_PKEY_free(key);
	EVP_PKEY_free(signer);
	return folder;
}

/* A malicious caller: any certificate or none, any TLS version, and it accepts whichever server answers. */
static void raw_caller(const char *folder, int version, const char *listener_says)
{
	SSL_CTX *context = SSL_CTX_new(TLS_client_method());
	SSL_CTX_set_max_proto_version(context, version);
	if (folder) {
		assert_int_equal(SSL_CTX_use_certificate_file(context, pair_at(folder, "cert.pem"), SSL_FILETYPE_PEM),
				 1);
		assert_int_equal(SSL_CTX_use_PrivateKey_file(context, pair_at(folder, "key.pem"), SSL_FILETYPE_PEM), 1);
	}
	SSL *ssl = SSL_new(context);
	BIO *in = BIO_new(BIO_s_mem()), *out = BIO_new(BIO_s_mem());
	BIO_set_mem_eof_return(in, -1);
	SSL_set_bio(ssl, in, out);
	SSL_set_connect_state(ssl);
	pair_open(&pair_listener, pair_at(pair_ours, "farm"), true);
	for (int turn = 0; turn < 6; turn++) {
		char *bytes;
		const unsigned char *answer;
		char word;
		SSL_read(ssl, &word, 1);
		long size = BIO_get_mem_data(out, &bytes);
		if (size > 0 && !pair_listener.rc) {
			pair_listener.rc = tls_link_take(pair_listener.link, bytes, (size_t)size, &pair_listener.e);
			pair_read(&pair_listener);
		}
		(void)BIO_reset(out);
		size_t said = tls_link_output(pair_listener.link, &answer);
		BIO_write(in, answer, (int)said);
		tls_link_output_taken(pair_listener.link);
	}
	if (*listener_says) {
		assert_false(tls_link_is_open(pair_listener.link));
		if (pair_listener.rc >= 0 || !strstr(pair_listener.e.text, listener_says))
			fail_msg("the listener says %d '%s', not '%s'", pair_listener.rc, pair_listener.e.text,
				 listener_says);
	} else {
		assert_true(tls_link_is_open(pair_listener.link));
	}
	pair_close(&pair_listener);
	SSL_free(ssl);
	SSL_CTX_free(context);
}

static void certificates_need_one_role_and_a_name(void **state)
{
	(void)state;
	raw_caller(pair_at(pair_ours, "node"), TLS1_3_VERSION, ""); /* the caller of this test can succeed */
	raw_caller(NULL, TLS1_3_VERSION, "the peer has no certificate");
	raw_caller(pair_at(pair_ours, "node"), TLS1_2_VERSION, "unsupported protocol");
	raw_caller(forge_certificate("good", "good", "URI:hslt:role:client"), TLS1_3_VERSION, "");
	raw_caller(forge_certificate("none", "none", NULL), TLS1_3_VERSION, "no role");
	raw_caller(forge_certificate("two", "two", "URI:hslt:role:client,URI:hslt:role:worker"), TLS1_3_VERSION,
		   "no role");
	raw_caller(forge_certificate("like", "like", "URI:hslt:role:workers"), TLS1_3_VERSION, "no role");
	raw_caller(forge_certificate("part", "part", "URI:hslt:role:work"), TLS1_3_VERSION, "no role");
	raw_caller(forge_certificate("dns", "dns", "DNS:hslt:role:worker"), TLS1_3_VERSION, "no role");
	raw_caller(forge_certificate("name", "../name", "URI:hslt:role:client"), TLS1_3_VERSION, "no name");
	raw_caller(forge_certificate("line", "a\nb", "URI:hslt:role:client"), TLS1_3_VERSION, "no name");
	/* A certificate whose purpose would do, but whose name is not the coordinator's, cannot be used to pose as one.
	 */
	const char *farm = forge_certificate("false", "farm", "URI:hslt:role:worker"); /* uses what pair_at returns */
	refuses(pair_at(pair_ours, "node"), farm, "certificate of a worker, not of a coordinator",
		"does not accept this certificate");
}

static void who_has_expired_is_not(void **state)
{
	(void)state;
	pair_issue(pair_ours, "brief", TLS_WORKER, 3.0 / 86400);
	pair_shake(pair_at(pair_ours, "brief"), pair_at(pair_ours, "farm"), 100000);
	while (!tls_link_is_open(pair_listener.link)) { /* if the machine stood still meanwhile, once more */
		struct error e;
		if (pair_listener.rc != -EKEYEXPIRED || !strstr(pair_listener.e.text, "expired"))
			fail_msg("the listener says %d '%s'", pair_listener.rc, pair_listener.e.text);
		pair_hang_up();
		assert_int_equal(authority_issue(pair_ours, "brief", TLS_WORKER, 3.0 / 86400, true, &e), 0);
		pair_shake(pair_at(pair_ours, "brief"), pair_at(pair_ours, "farm"), 100000);
	}
	int rc;
	while ((rc = tls_link_recheck(pair_listener.link, &pair_listener.e)) == 0)
		usleep(50000);
	assert_int_equal(rc, -EKEYEXPIRED);
	assert_non_null(strstr(pair_listener.e.text, "expired"));
	pair_hang_up();
	gives_up(-EKEYEXPIRED, pair_at(pair_ours, "brief"), pair_at(pair_ours, "farm"),
		 "expired by the clock of its machine", "expired");
}

/* A clock that is years off: the error sentence tells which clock. */
static void a_wrong_clock_is_named(void **state)
{
	(void)state;
	static const time_t off[] = {(time_t)20 * 365 * 86400, -(time_t)20 * 365 * 86400};
	for (size_t i = 0; i < 2; i++) {
		char year[64];
		struct tm tm;
		behind = off[i];
		time_t now = time(NULL);
		strftime(year, sizeof year, "by the clock of this machine, %Y-", gmtime_r(&now, &tm));
		pair_shake(pair_at(pair_ours, "node"), pair_at(pair_ours, "farm"), 100000);
		behind = 0;
		assert_int_equal(pair_caller.rc, -EKEYEXPIRED);
		assert_int_equal(pair_listener.rc, -EKEYEXPIRED);
		assert_non_null(strstr(pair_caller.e.text, year));
		assert_non_null(strstr(pair_caller.e.text, i ? "expired" : "not yet valid"));
		pair_hang_up();
	}
}

/* hslt-ca was killed, or its disk was full, after it had written the authority's own list. */
static void an_interrupted_revocation_is_repeated(void **state)
{
	(void)state;
	unsigned count;
	struct error e;
	pair_issue(pair_ours, "half", TLS_WORKER, 5);
	copy(pair_at(pair_ours, "farm/crl.pem"), pair_at(pair_ours, "before.pem"));
	assert_int_equal(authority_revoke(pair_ours, "half", &count, &e), 0);
	copy(pair_at(pair_ours, "before.pem"), pair_at(pair_ours, "farm/crl.pem"));
	accepts("half", "half", TLS_WORKER);
	assert_int_equal(authority_revoke(pair_ours, "half", &count, &e), 0);
	assert_int_equal(count, 0);
	refuses(pair_at(pair_ours, "half"), pair_at(pair_ours, "farm"), "revoked", "revoked");
	assert_int_equal(authority_revoke(pair_ours, "nobody", &count, &e), -ENOENT);
	assert_non_null(strstr(e.text, "no valid certificate"));
}

static unsigned writes_left;

static ssize_t write_until_full(int fd, const void *bytes, size_t size)
{
	if (writes_left) {
		writes_left--;
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
	assert_int_equal(authority_list(pair_ours, &list, &n, &e), 0);
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
	pair_issue(pair_ours, "steady", TLS_WORKER, 5);
	for (int renew = 1; renew >= 0; renew--) {
		unsigned room = 0;
		const char *name = renew ? "steady" : "late";
		const size_t before = count_certificates();
		for (int rc = -1; rc; room++) {
			writes_left = room;
			disk_use(&full);
			rc = authority_issue(pair_ours, name, TLS_WORKER, 5, renew, &e);
			disk_use(NULL);
			assert_true(rc == 0 || rc == -ENOSPC);
			assert_int_equal(count_certificates(), before + (rc == 0));
			assert_int_equal(access(pair_at(pair_ours, "steady/cert.pem.next"), F_OK), -1);
			if (renew || !rc)
				accepts(name, name, TLS_WORKER);
		}
		assert_int_equal(room, 6);
	}
	assert_int_equal(authority_issue(pair_ours, "late", TLS_WORKER, 5, false, &e), -EEXIST);
	/* A folder that is not a certificate's is left alone. */
	assert_int_equal(mkdir(pair_at(pair_ours, "mine"), 0700), 0);
	copy(pair_at(pair_ours, "ca.pem"), pair_at(pair_ours, "mine/letter"));
	assert_int_equal(authority_issue(pair_ours, "mine", TLS_WORKER, 5, false, &e), -EEXIST);
}

static unsigned renames_left;

static int rename_until(const char *from, const char *to)
{
	if (renames_left) {
		renames_left--;
		return disk_system.rename(from, to);
	}
	errno = EIO;
	return -1;
}

/* Whichever step fails: no key or certificate is left unrecorded, and the pair that is there can be used. Once the key
 * has been replaced it stays: the certificate then lies beside it. */
static void an_error_leaves_nothing_behind(void **state)
{
	(void)state;
	struct disk bad = disk_system;
	struct error e;
	bad.rename = rename_until;
	pair_issue(pair_ours, "tidy", TLS_WORKER, 5);
	size_t before = count_certificates();
	unsigned most = 0, half = 0;
	for (int rc = -1; rc; most++) {
		renames_left = most;
		disk_use(&bad);
		rc = authority_issue(pair_ours, "tidy", TLS_WORKER, 5, true, &e);
		disk_use(NULL);
		assert_true(rc == 0 || rc == -EIO);
		bool is_half = access(pair_at(pair_ours, "tidy/cert.pem.next"), F_OK) == 0;
		half += is_half;
		before += is_half;
		assert_int_equal(count_certificates(), before + (rc == 0));
		assert_true(rc != 0 || !is_half);
		assert_int_equal(access(pair_at(pair_ours, "tidy/key.pem.next"), F_OK), -1);
		accepts("tidy", "tidy", TLS_WORKER);
	}
	assert_int_equal(most, 8);
	assert_int_equal(half, 1);
	accepts("tidy", "tidy", TLS_WORKER);
}

static void who_is_revoked_is_not(void **state)
{
	(void)state;
	unsigned count;
	struct error e;
	pair_issue(pair_ours, "gone", TLS_WORKER, 5);
	assert_int_equal(tls_open(&pair_listener.tls, pair_at(pair_ours, "farm"), &e), 0);
	tls_close(pair_listener.tls);
	pair_shake(pair_at(pair_ours, "gone"), pair_at(pair_ours, "farm"), 100000);
	assert_true(tls_link_is_open(pair_listener.link));
	assert_int_equal(tls_refresh(pair_listener.tls, &e), 0);
	assert_int_equal(authority_revoke(pair_ours, "gone", &count, &e), 0);
	assert_int_equal(count, 1);
	assert_int_equal(authority_revoke(pair_ours, "gone", &count, &e), 0);
	assert_int_equal(count, 0);
	assert_int_equal(tls_link_recheck(pair_listener.link, &e), 0); /* the new list has not been read yet */
	assert_int_equal(tls_refresh(pair_listener.tls, &e), 1);
	assert_int_equal(tls_link_recheck(pair_listener.link, &e), -EACCES);
	assert_non_null(strstr(e.text, "revoked"));
	/* A list stays in force after its file is removed. */
	assert_int_equal(unlink(pair_at(pair_ours, "farm/crl.pem")), 0);
	assert_int_equal(tls_refresh(pair_listener.tls, &e), -ENOENT);
	assert_int_equal(tls_refresh(pair_listener.tls, &e), 0); /* this is reported once */
	assert_int_equal(tls_link_recheck(pair_listener.link, &e), -EACCES);
	time_t until = tls_self(pair_listener.tls)->until;
	assert_int_equal(authority_issue(pair_ours, "farm", TLS_COORDINATOR, 50, true, &e), 0);
	unlink(pair_at(pair_ours, "farm/crl.pem")); /* a renewal need not bring a list */
	assert_int_equal(tls_refresh(pair_listener.tls, &e), 1);
	assert_true(tls_self(pair_listener.tls)->until != until);
	assert_int_equal(tls_link_recheck(pair_listener.link, &e), -EACCES);
	assert_non_null(strstr(e.text, "revoked"));
	copy(pair_at(pair_ours, "crl.pem"), pair_at(pair_ours, "farm/crl.pem"));
	assert_int_equal(tls_refresh(pair_listener.tls, &e), 1);
	pair_hang_up();
	refuses(pair_at(pair_ours, "gone"), pair_at(pair_ours, "farm"), "revoked", "revoked");
	accepts("node", "node", TLS_WORKER);
	/* Revocation is by serial number: a renewed certificate of the same name stays valid. */
	struct authority_entry *list;
	size_t n;
	pair_issue(pair_ours, "twice", TLS_WORKER, 5);
	assert_int_equal(authority_list(pair_ours, &list, &n, &e), 0);
	char serial[48] = "";
	for (size_t i = 0; i < n; i++) {
		assert_int_equal(list[i].revoked, strcmp(list[i].who.name, "gone") == 0);
		if (strcmp(list[i].who.name, "twice") == 0)
			strcpy(serial, list[i].who.serial);
	}
	mem_free(list);
	assert_int_equal(authority_issue(pair_ours, "twice", TLS_WORKER, 5, false, &e), -EEXIST);
	assert_int_equal(authority_issue(pair_ours, "twice", TLS_WORKER, 5, true, &e), 0);
	assert_int_equal(authority_revoke(pair_ours, serial, &count, &e), 0);
	assert_int_equal(count, 1);
	accepts("twice", "twice", TLS_WORKER);
}

/* Clocks may be a second behind that of the machine that made certificates and lists. */
static void clocks_may_be_behind(void **state)
{
	(void)state;
	unsigned count;
	struct error e;
	pair_issue(pair_ours, "former", TLS_WORKER, 5);
	assert_int_equal(authority_revoke(pair_ours, "former", &count, &e), 0);
	behind = 2 * 3600;
	accepts("node", "node", TLS_WORKER);
	refuses(pair_at(pair_ours, "former"), pair_at(pair_ours, "farm"), "revoked", "revoked");
	behind = 5 * 86400;
	gives_up(-EKEYEXPIRED, pair_at(pair_ours, "node"), pair_at(pair_ours, "farm"), "not yet valid", "");
	behind = 0;
}

static void append(const char *from, const char *to)
{
	static char bytes[1 << 16];
	int in = open(from, O_RDONLY | O_CLOEXEC), out = open(to, O_WRONLY | O_APPEND | O_CLOEXEC);
	ssize_t n = read(in, bytes, sizeof bytes);
	assert_true(n > 0 && write(out, bytes, (size_t)n) == n);
	close(in);
	close(out);
}

/* How a farm changes its authority without a day on which peers are refused: first both are trusted everywhere, then
 * new certificates are issued, then the old authority is removed. */
static void one_authority_replaces_another(void **state)
{
	(void)state;
	struct error e;
	unsigned count;
	char farm[256], node[256];
	pair_issue(pair_ours, "old-farm", TLS_COORDINATOR, 5);
	pair_issue(pair_ours, "old-node", TLS_WORKER, 5);
	pair_issue(pair_theirs, "lost", TLS_WORKER, 5);
	snprintf(farm, sizeof farm, "%s/old-farm", pair_ours);
	snprintf(node, sizeof node, "%s/old-node", pair_ours);
	static const char *const files[] = {"ca.pem", "crl.pem"};
	for (size_t i = 0; i < 2; i++) {
		append(pair_at(pair_theirs, files[i]), pair_at(farm, files[i]));
		append(pair_at(pair_theirs, files[i]), pair_at(node, files[i]));
	}
	char new_node[256], new_lost[256];
	snprintf(new_node, sizeof new_node, "%s/node", pair_theirs);
	snprintf(new_lost, sizeof new_lost, "%s/lost", pair_theirs);
	append(pair_at(pair_ours, "ca.pem"), pair_at(new_node, "ca.pem"));
	append(pair_at(pair_ours, "crl.pem"), pair_at(new_node, "crl.pem"));
	append(pair_at(pair_ours, "ca.pem"), pair_at(new_lost, "ca.pem"));
	append(pair_at(pair_ours, "crl.pem"), pair_at(new_lost, "crl.pem"));
	const char *const callers[] = {node, new_node, new_lost};
	for (size_t i = 0; i < 3; i++) {
		pair_shake(callers[i], farm, 100000);
		if (pair_caller.rc || pair_listener.rc)
			fail_msg("%s: %s / %s", callers[i], pair_caller.e.text, pair_listener.e.text);
		assert_true(tls_link_is_open(pair_listener.link));
		pair_hang_up();
	}
	/* The lists of both authorities apply. */
	assert_int_equal(authority_revoke(pair_theirs, "lost", &count, &e), 0);
	assert_int_equal(authority_revoke(pair_ours, "old-node", &count, &e), 0);
	copy(pair_at(pair_ours, "crl.pem"), pair_at(farm, "crl.pem"));
	append(pair_at(pair_theirs, "crl.pem"), pair_at(farm, "crl.pem"));
	refuses(new_lost, farm, "revoked", "revoked");
	refuses(node, farm, "revoked", "revoked");
	pair_shake(new_node, farm, 100000);
	assert_true(tls_link_is_open(pair_listener.link));
	pair_hang_up();
	/* The old authority is removed: its certificates are refused. */
	copy(pair_at(pair_theirs, "ca.pem"), pair_at(farm, "ca.pem"));
	copy(pair_at(pair_theirs, "crl.pem"), pair_at(farm, "crl.pem"));
	pair_shake(pair_at(pair_ours, "node"), farm, 100000);
	assert_false(tls_link_is_open(pair_listener.link));
	pair_hang_up();
}

static void names_are_strict(void **state)
{
	(void)state;
	struct error e;
	static const char *const bad[] = {"", ".", "..", "../up", "a/b", "-x", "a b", "a\nb", "issued", "\xc3\xa4"};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		assert_int_equal(authority_issue(pair_ours, bad[i], TLS_CLIENT, 5, true, &e), -EINVAL);
	assert_int_equal(authority_init(pair_ours, "again", 5, &e), -EEXIST);
	struct stat st;
	assert_int_equal(stat(pair_at(pair_ours, "ca.key"), &st), 0);
	assert_int_equal(st.st_mode & 0777, 0600);
	assert_int_equal(stat(pair_at(pair_ours, "node/key.pem"), &st), 0);
	assert_int_equal(st.st_mode & 0777, 0600);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(who_has_expired_is_not),
		cmocka_unit_test(those_of_the_farm_are_let_in),
		cmocka_unit_test(others_are_not),
		cmocka_unit_test(a_foreign_certificate_with_our_authority_beside_it),
		cmocka_unit_test(certificates_need_one_role_and_a_name),
		cmocka_unit_test(who_is_revoked_is_not),
		cmocka_unit_test(a_wrong_clock_is_named),
		cmocka_unit_test(an_interrupted_revocation_is_repeated),
		cmocka_unit_test(a_full_disk_takes_no_certificate_away),
		cmocka_unit_test(an_error_leaves_nothing_behind),
		cmocka_unit_test(clocks_may_be_behind),
		cmocka_unit_test(one_authority_replaces_another),
		cmocka_unit_test(names_are_strict),
	};
	return cmocka_run_group_tests(tests, pair_make_folders, pair_remove_folders);
}
