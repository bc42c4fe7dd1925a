/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Handshakes in memory, between folders that an authority of the test has made: who is let in, who is not and why, and
 * what becomes of streams that are cut, changed, or no TLS at all.
 */
#include "common/base/mem.h"
#include "common/net/authority.h"
#include "common/net/conn.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <fcntl.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char root[64], ours[128], theirs[128]; /* two authorities */

static const char *at(const char *folder, const char *name)
{
	static char paths[4][512];
	static unsigned next;
	char *path = paths[next++ % 4];
	snprintf(path, sizeof paths[0], "%s/%s", folder, name);
	return path;
}

static void issue(const char *folder, const char *name, enum tls_role role, double days)
{
	struct error e = {""};
	int rc = authority_issue(folder, name, role, days, false, &e);
	if (rc)
		fail_msg("%s: %s", name, e.text);
}

static int make_folders(void **state)
{
	(void)state;
	struct error e;
	snprintf(root, sizeof root, "/tmp/hslt-tls.XXXXXX");
	if (!mkdtemp(root))
		return -1;
	snprintf(ours, sizeof ours, "%s/ours", root);
	snprintf(theirs, sizeof theirs, "%s/theirs", root);
	if (authority_init(ours, "ours", 10, &e) || authority_init(theirs, "theirs", 10, &e))
		return -1;
	issue(ours, "farm", TLS_COORDINATOR, 5);
	issue(ours, "node", TLS_WORKER, 5);
	issue(ours, "ann", TLS_CLIENT, 5);
	issue(ours, "root", TLS_OPERATOR, 5);
	issue(theirs, "farm", TLS_COORDINATOR, 5);
	issue(theirs, "node", TLS_WORKER, 5);
	return 0;
}

static int remove_folders(void **state)
{
	(void)state;
	char command[128];
	snprintf(command, sizeof command, "rm -rf '%s'", root);
	return system(command);
}

/* ---- two ends ---- */

struct end {
	struct tls *tls;
	struct tls_link *link;
	struct error e;
	int rc;
	unsigned char got[1 << 17];
	size_t got_size;
};

static void open_end(struct end *x, const char *folder, bool listening)
{
	x->rc = 0;
	x->got_size = 0;
	x->e.text[0] = 0;
	int rc = tls_open(&x->tls, folder, &x->e);
	if (rc)
		fail_msg("%s", x->e.text);
	assert_int_equal(tls_link_new(&x->link, x->tls, listening, &x->e), 0);
}

static void close_end(struct end *x)
{
	tls_link_free(x->link);
	tls_close(x->tls);
}

static void read_all(struct end *x)
{
	ssize_t n = 1;
	while (!x->rc && n > 0) {
		n = tls_link_read(x->link, x->got + x->got_size, sizeof x->got - x->got_size, &x->e);
		if (n > 0)
			x->got_size += (size_t)n;
		else if (n < 0)
			x->rc = (int)n;
	}
}

/* What `from` has to say goes to `to`, `piece` bytes at a time; whether there was anything. */
static bool carry(struct end *from, struct end *to, size_t piece)
{
	const unsigned char *bytes;
	size_t size = tls_link_output(from->link, &bytes);
	for (size_t i = 0; i < size && !to->rc; i += piece) {
		to->rc = tls_link_take(to->link, bytes + i, size - i < piece ? size - i : piece, &to->e);
		read_all(to);
	}
	tls_link_output_taken(from->link);
	return size > 0;
}

static struct end caller, listener;

static void shake_by(const char *from, const char *to, size_t piece)
{
	open_end(&caller, from, false);
	open_end(&listener, to, true);
	read_all(&caller);
	while (carry(&caller, &listener, piece) || carry(&listener, &caller, piece))
		;
}

static void hang_up(void)
{
	close_end(&caller);
	close_end(&listener);
}

static void accepts(const char *folder, const char *name, enum tls_role role)
{
	for (size_t piece = 1; piece < 100000; piece *= 317) {
		shake_by(at(ours, folder), at(ours, "farm"), piece);
		if (listener.rc || caller.rc)
			fail_msg("%s: %s / %s", folder, caller.e.text, listener.e.text);
		assert_true(tls_link_is_open(caller.link) && tls_link_is_open(listener.link));
		assert_string_equal(tls_link_peer(listener.link)->name, name);
		assert_int_equal(tls_link_peer(listener.link)->role, role);
		assert_int_equal(tls_link_peer(caller.link)->role, TLS_COORDINATOR);
		assert_int_equal(tls_link_recheck(listener.link, &listener.e), 0);
		assert_int_equal(tls_link_recheck(caller.link, &caller.e), 0);
		hang_up();
	}
}

static void those_of_the_farm_are_let_in(void **state)
{
	(void)state;
	accepts("node", "node", TLS_WORKER);
	accepts("ann", "ann", TLS_CLIENT);
	accepts("root", "root", TLS_OPERATOR);
}

/* Both ends give it up, and both say why. */
static void refuses(const char *from, const char *to, const char *caller_says, const char *listener_says)
{
	shake_by(from, to, 100000);
	assert_false(tls_link_is_open(listener.link));
	if (caller.rc != -EACCES || !strstr(caller.e.text, caller_says))
		fail_msg("the caller says %d '%s', not '%s'", caller.rc, caller.e.text, caller_says);
	if (listener.rc != -EACCES || !strstr(listener.e.text, listener_says))
		fail_msg("the listener says %d '%s', not '%s'", listener.rc, listener.e.text, listener_says);
	hang_up();
}

static void others_are_not(void **state)
{
	(void)state;
	refuses(at(theirs, "node"), at(ours, "farm"), "certificate is not accepted",
		"does not accept this certificate");
	refuses(at(ours, "node"), at(theirs, "farm"), "certificate is not accepted",
		"does not accept this certificate");
	/* A worker that plays coordinator to another: the purpose is wrong already. */
	refuses(at(ours, "node"), at(ours, "root"), "certificate is not accepted", "does not accept this certificate");
	/* A coordinator does not call. */
	refuses(at(ours, "farm"), at(ours, "farm"), "does not accept this certificate", "certificate is not accepted");
}

/* A folder made by hand: this caller trusts the farm but shows a certificate of somebody else, or the other way round.
 */
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
	snprintf(mixed, sizeof mixed, "%s/mixed", root);
	assert_int_equal(mkdir(mixed, 0700), 0);
	snprintf(path, sizeof path, "%s/ca.pem", mixed);
	copy(at(ours, "ca.pem"), path);
	snprintf(path, sizeof path, "%s/cert.pem", mixed);
	copy(at(theirs, "node/cert.pem"), path);
	snprintf(path, sizeof path, "%s/key.pem", mixed);
	copy(at(theirs, "node/key.pem"), path);
	refuses(mixed, at(ours, "farm"), "does not accept this certificate", "certificate is not accepted");
	/* ... and the key of another certificate is noticed at home. */
	copy(at(ours, "node/key.pem"), path);
	struct tls *t;
	struct error e;
	assert_int_equal(tls_open(&t, mixed, &e), -EBADMSG);
	chmod(path, 0604);
	assert_int_equal(tls_open(&t, mixed, &e), -EPERM);
	assert_int_equal(tls_open(&t, at(root, "nowhere"), &e), -ENOENT);
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
	FILE *f = fopen(at(folder, name), mode);
	assert_non_null(f);
	return f;
}

/* What hslt-ca never makes, signed by our authority nevertheless: good for both purposes, with any words in it. */
static const char *forge(const char *name, const char *shown, const char *other_names)
{
	static char folder[256];
	snprintf(folder, sizeof folder, "%s/%s", root, name);
	assert_int_equal(mkdir(folder, 0700), 0);
	copy(at(ours, "ca.pem"), at(folder, "ca.pem"));
	FILE *f = file(ours, "ca.key", "r");
	EVP_PKEY *signer = PEM_read_PrivateKey(f, NULL, NULL, NULL), *key = EVP_EC_gen("P-256");
	fclose(f);
	f = file(ours, "ca.pem", "r");
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
	chmod(at(folder, "key.pem"), 0600);
	X509_free(ca);
	X509_free(cert);
	EVP_PKEY_free(key);
	EVP_PKEY_free(signer);
	return folder;
}

/* A caller that has the worst of intentions: any certificate or none, any version, and it accepts whoever answers. */
static void raw_caller(const char *folder, int version, const char *listener_says)
{
	SSL_CTX *context = SSL_CTX_new(TLS_client_method());
	SSL_CTX_set_max_proto_version(context, version);
	if (folder) {
		assert_int_equal(SSL_CTX_use_certificate_file(context, at(folder, "cert.pem"), SSL_FILETYPE_PEM), 1);
		assert_int_equal(SSL_CTX_use_PrivateKey_file(context, at(folder, "key.pem"), SSL_FILETYPE_PEM), 1);
	}
	SSL *ssl = SSL_new(context);
	BIO *in = BIO_new(BIO_s_mem()), *out = BIO_new(BIO_s_mem());
	BIO_set_mem_eof_return(in, -1);
	SSL_set_bio(ssl, in, out);
	SSL_set_connect_state(ssl);
	open_end(&listener, at(ours, "farm"), true);
	for (int turn = 0; turn < 6; turn++) {
		char *bytes;
		const unsigned char *answer;
		char word;
		SSL_read(ssl, &word, 1);
		long size = BIO_get_mem_data(out, &bytes);
		if (size > 0 && !listener.rc) {
			listener.rc = tls_link_take(listener.link, bytes, (size_t)size, &listener.e);
			read_all(&listener);
		}
		(void)BIO_reset(out);
		size_t said = tls_link_output(listener.link, &answer);
		BIO_write(in, answer, (int)said);
		tls_link_output_taken(listener.link);
	}
	if (*listener_says) {
		assert_false(tls_link_is_open(listener.link));
		if (listener.rc >= 0 || !strstr(listener.e.text, listener_says))
			fail_msg("the listener says %d '%s', not '%s'", listener.rc, listener.e.text, listener_says);
	} else {
		assert_true(tls_link_is_open(listener.link));
	}
	close_end(&listener);
	SSL_free(ssl);
	SSL_CTX_free(context);
}

static void certificates_need_one_role_and_a_name(void **state)
{
	(void)state;
	raw_caller(at(ours, "node"), TLS1_3_VERSION, ""); /* the caller of this test can be let in */
	raw_caller(NULL, TLS1_3_VERSION, "the peer has no certificate");
	raw_caller(at(ours, "node"), TLS1_2_VERSION, "unsupported protocol");
	raw_caller(forge("good", "good", "URI:hslt:role:client"), TLS1_3_VERSION, "");
	raw_caller(forge("none", "none", NULL), TLS1_3_VERSION, "no role");
	raw_caller(forge("two", "two", "URI:hslt:role:client,URI:hslt:role:worker"), TLS1_3_VERSION, "no role");
	raw_caller(forge("like", "like", "URI:hslt:role:workers"), TLS1_3_VERSION, "no role");
	raw_caller(forge("part", "part", "URI:hslt:role:work"), TLS1_3_VERSION, "no role");
	raw_caller(forge("dns", "dns", "DNS:hslt:role:worker"), TLS1_3_VERSION, "no role");
	raw_caller(forge("name", "../name", "URI:hslt:role:client"), TLS1_3_VERSION, "no name");
	raw_caller(forge("line", "a\nb", "URI:hslt:role:client"), TLS1_3_VERSION, "no name");
	/* Whose purpose would do, but who is no coordinator, cannot play one. */
	refuses(at(ours, "node"), forge("false", "farm", "URI:hslt:role:worker"),
		"certificate of a worker, not of a coordinator", "does not accept this certificate");
}

static void who_has_expired_is_not(void **state)
{
	(void)state;
	issue(ours, "brief", TLS_WORKER, 3.0 / 86400);
	shake_by(at(ours, "brief"), at(ours, "farm"), 100000);
	while (!tls_link_is_open(listener.link)) { /* the machine stood still meanwhile: once more */
		struct error e;
		if (listener.rc != -EACCES || !strstr(listener.e.text, "expired"))
			fail_msg("the listener says %d '%s'", listener.rc, listener.e.text);
		hang_up();
		assert_int_equal(authority_issue(ours, "brief", TLS_WORKER, 3.0 / 86400, true, &e), 0);
		shake_by(at(ours, "brief"), at(ours, "farm"), 100000);
	}
	while (tls_link_recheck(listener.link, &listener.e) == 0)
		usleep(50000);
	assert_non_null(strstr(listener.e.text, "expired"));
	hang_up();
	refuses(at(ours, "brief"), at(ours, "farm"), "does not accept this certificate", "expired");
}

static void who_is_revoked_is_not(void **state)
{
	(void)state;
	unsigned count;
	struct error e;
	issue(ours, "gone", TLS_WORKER, 5);
	assert_int_equal(tls_open(&listener.tls, at(ours, "farm"), &e), 0);
	tls_close(listener.tls);
	shake_by(at(ours, "gone"), at(ours, "farm"), 100000);
	assert_true(tls_link_is_open(listener.link));
	assert_int_equal(tls_refresh(listener.tls, &e), 0);
	assert_int_equal(authority_revoke(ours, "gone", &count, &e), 0);
	assert_int_equal(count, 1);
	assert_int_equal(authority_revoke(ours, "gone", &count, &e), -ENOENT);
	assert_int_equal(tls_link_recheck(listener.link, &e), 0); /* nobody has read it */
	assert_int_equal(tls_refresh(listener.tls, &e), 1);
	assert_int_equal(tls_link_recheck(listener.link, &e), -EACCES);
	assert_non_null(strstr(e.text, "revoked"));
	/* The list does not lose its power with its file. */
	assert_int_equal(unlink(at(ours, "farm/crl.pem")), 0);
	assert_int_equal(tls_refresh(listener.tls, &e), -ENOENT);
	assert_int_equal(tls_refresh(listener.tls, &e), 0); /* it is said once */
	assert_int_equal(tls_link_recheck(listener.link, &e), -EACCES);
	time_t until = tls_self(listener.tls)->until;
	assert_int_equal(authority_issue(ours, "farm", TLS_COORDINATOR, 50, true, &e), 0);
	unlink(at(ours, "farm/crl.pem")); /* whoever renews need not bring a list */
	assert_int_equal(tls_refresh(listener.tls, &e), 1);
	assert_true(tls_self(listener.tls)->until != until);
	assert_int_equal(tls_link_recheck(listener.link, &e), -EACCES);
	assert_non_null(strstr(e.text, "revoked"));
	copy(at(ours, "crl.pem"), at(ours, "farm/crl.pem"));
	assert_int_equal(tls_refresh(listener.tls, &e), 1);
	hang_up();
	refuses(at(ours, "gone"), at(ours, "farm"), "revoked", "revoked");
	accepts("node", "node", TLS_WORKER);
	/* By serial number; and what was renewed goes on. */
	struct authority_entry *list;
	size_t n;
	issue(ours, "twice", TLS_WORKER, 5);
	assert_int_equal(authority_list(ours, &list, &n, &e), 0);
	char serial[48] = "";
	for (size_t i = 0; i < n; i++) {
		assert_int_equal(list[i].revoked, strcmp(list[i].who.name, "gone") == 0);
		if (strcmp(list[i].who.name, "twice") == 0)
			strcpy(serial, list[i].who.serial);
	}
	mem_free(list);
	assert_int_equal(authority_issue(ours, "twice", TLS_WORKER, 5, false, &e), -EEXIST);
	assert_int_equal(authority_issue(ours, "twice", TLS_WORKER, 5, true, &e), 0);
	assert_int_equal(authority_revoke(ours, serial, &count, &e), 0);
	assert_int_equal(count, 1);
	accepts("twice", "twice", TLS_WORKER);
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

/* How a farm changes its authority without a day on which nobody gets in: first both are trusted everywhere, then new
 * certificates are given out, then the old authority goes. */
static void one_authority_replaces_another(void **state)
{
	(void)state;
	struct error e;
	unsigned count;
	char farm[256], node[256];
	issue(ours, "old-farm", TLS_COORDINATOR, 5);
	issue(ours, "old-node", TLS_WORKER, 5);
	issue(theirs, "lost", TLS_WORKER, 5);
	snprintf(farm, sizeof farm, "%s/old-farm", ours);
	snprintf(node, sizeof node, "%s/old-node", ours);
	static const char *const files[] = {"ca.pem", "crl.pem"};
	for (size_t i = 0; i < 2; i++) {
		append(at(theirs, files[i]), at(farm, files[i]));
		append(at(theirs, files[i]), at(node, files[i]));
	}
	char new_node[256], new_lost[256];
	snprintf(new_node, sizeof new_node, "%s/node", theirs);
	snprintf(new_lost, sizeof new_lost, "%s/lost", theirs);
	append(at(ours, "ca.pem"), at(new_node, "ca.pem"));
	append(at(ours, "crl.pem"), at(new_node, "crl.pem"));
	append(at(ours, "ca.pem"), at(new_lost, "ca.pem"));
	append(at(ours, "crl.pem"), at(new_lost, "crl.pem"));
	const char *const callers[] = {node, new_node, new_lost};
	for (size_t i = 0; i < 3; i++) {
		shake_by(callers[i], farm, 100000);
		if (caller.rc || listener.rc)
			fail_msg("%s: %s / %s", callers[i], caller.e.text, listener.e.text);
		assert_true(tls_link_is_open(listener.link));
		hang_up();
	}
	/* Both lists hold. */
	assert_int_equal(authority_revoke(theirs, "lost", &count, &e), 0);
	assert_int_equal(authority_revoke(ours, "old-node", &count, &e), 0);
	copy(at(ours, "crl.pem"), at(farm, "crl.pem"));
	append(at(theirs, "crl.pem"), at(farm, "crl.pem"));
	refuses(new_lost, farm, "revoked", "revoked");
	refuses(node, farm, "revoked", "revoked");
	shake_by(new_node, farm, 100000);
	assert_true(tls_link_is_open(listener.link));
	hang_up();
	/* The old one goes: nobody of it gets in any more. */
	copy(at(theirs, "ca.pem"), at(farm, "ca.pem"));
	copy(at(theirs, "crl.pem"), at(farm, "crl.pem"));
	shake_by(at(ours, "node"), farm, 100000);
	assert_false(tls_link_is_open(listener.link));
	hang_up();
}

static void names_are_strict(void **state)
{
	(void)state;
	struct error e;
	static const char *const bad[] = {"", ".", "..", "../up", "a/b", "-x", "a b", "a\nb", "issued", "\xc3\xa4"};
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		assert_int_equal(authority_issue(ours, bad[i], TLS_CLIENT, 5, true, &e), -EINVAL);
	assert_int_equal(authority_init(ours, "again", 5, &e), -EEXIST);
	struct stat st;
	assert_int_equal(stat(at(ours, "ca.key"), &st), 0);
	assert_int_equal(st.st_mode & 0777, 0600);
	assert_int_equal(stat(at(ours, "node/key.pem"), &st), 0);
	assert_int_equal(st.st_mode & 0777, 0600);
}

/* ---- what is said ---- */

static void write_bytes(struct end *x, size_t size)
{
	static unsigned char bytes[1 << 16];
	for (size_t i = 0; i < size; i++)
		bytes[i] = (unsigned char)(i * 7);
	assert_int_equal(tls_link_write(x->link, bytes, size, &x->e), 0);
}

static void what_is_said_arrives(void **state)
{
	(void)state;
	shake_by(at(ours, "node"), at(ours, "farm"), 100000);
	write_bytes(&caller, 60000);
	write_bytes(&listener, 1);
	carry(&caller, &listener, 999);
	carry(&listener, &caller, 1);
	assert_int_equal(listener.got_size, 60000);
	assert_int_equal(caller.got_size, 1);
	for (size_t i = 0; i < 60000; i++)
		assert_int_equal(listener.got[i], (unsigned char)(i * 7));
	hang_up();
}

/* Nothing of a record that is cut off is believed. */
static void half_a_record_says_nothing(void **state)
{
	(void)state;
	const unsigned char *bytes;
	shake_by(at(ours, "node"), at(ours, "farm"), 100000);
	write_bytes(&caller, 10000);
	size_t size = tls_link_output(caller.link, &bytes);
	assert_int_equal(tls_link_take(listener.link, bytes, size - 1, &listener.e), 0);
	read_all(&listener);
	assert_int_equal(listener.rc, 0);
	assert_int_equal(listener.got_size, 0);
	hang_up();
}

static void a_changed_bit_ends_it(void **state)
{
	(void)state;
	unsigned char copied[2048];
	for (size_t bit = 0; bit < 8; bit++) {
		const unsigned char *bytes;
		shake_by(at(ours, "node"), at(ours, "farm"), 100000);
		write_bytes(&caller, 1000);
		size_t size = tls_link_output(caller.link, &bytes);
		assert_true(size > 1000 && size < sizeof copied);
		memcpy(copied, bytes, size);
		copied[5 + 100 * bit] ^= (unsigned char)(1 << bit);
		assert_int_equal(tls_link_take(listener.link, copied, size, &listener.e), 0);
		read_all(&listener);
		assert_int_equal(listener.rc, -EPROTO);
		assert_int_equal(listener.got_size, 0);
		hang_up();
	}
}

/* A record once more: the numbers of TLS run on, so that it does not decrypt. */
static void a_replayed_record_ends_it(void **state)
{
	(void)state;
	unsigned char copied[2048];
	const unsigned char *bytes;
	shake_by(at(ours, "node"), at(ours, "farm"), 100000);
	write_bytes(&caller, 1000);
	size_t size = tls_link_output(caller.link, &bytes);
	assert_true(size < sizeof copied);
	memcpy(copied, bytes, size);
	for (int i = 0; i < 2 && !listener.rc; i++) {
		assert_int_equal(tls_link_take(listener.link, copied, size, &listener.e), 0);
		read_all(&listener);
	}
	assert_int_equal(listener.got_size, 1000);
	assert_int_equal(listener.rc, -EPROTO);
	hang_up();
}

static void nonsense_ends_it(void **state)
{
	(void)state;
	uint32_t random = 12345;
	for (int round = 0; round < 200; round++) {
		unsigned char bytes[512];
		for (size_t i = 0; i < sizeof bytes; i++)
			bytes[i] = (unsigned char)((random = random * 1664525 + 1013904223) >> 24);
		bytes[0] = 22;	 /* else it is known for plaintext at once */
		if (round % 2) { /* a record, well-formed on the outside */
			bytes[1] = 3;
			bytes[2] = 1;
			bytes[3] = 1;
			bytes[4] = 0xfb;
		}
		open_end(&listener, at(ours, "farm"), true);
		listener.rc = tls_link_take(listener.link, bytes, sizeof bytes, &listener.e);
		read_all(&listener);
		assert_true(listener.rc == -EPROTO || listener.rc == -EACCES || (!listener.rc && !listener.got_size));
		assert_false(tls_link_is_open(listener.link));
		close_end(&listener);
	}
}

static void a_handshake_does_not_grow(void **state)
{
	(void)state;
	unsigned char header[5] = {22, 3, 1, 0x40, 0}, zeroes[1024] = {1, 0xff, 0xff, 0xff};
	size_t total = 0;
	open_end(&listener, at(ours, "farm"), true);
	while (!listener.rc && total < 1 << 20) {
		listener.rc = tls_link_take(listener.link, total % (1 << 14) ? zeroes : header,
					    total % (1 << 14) ? 1024 : 5, &listener.e);
		total += 1024;
		read_all(&listener);
	}
	assert_true(listener.rc < 0 && total <= 1 << 17);
	close_end(&listener);
}

static void plaintext_is_known(void **state)
{
	(void)state;
	const unsigned char *bytes;
	open_end(&listener, at(ours, "farm"), true);
	assert_int_equal(tls_link_take(listener.link, "\0\0\0\x10", 4, &listener.e), -EACCES);
	assert_non_null(strstr(listener.e.text, "does not use TLS"));
	assert_int_equal(tls_link_output(listener.link, &bytes), sizeof tls_none_here);
	assert_true(tls_is_first_byte(*bytes) && !tls_is_first_byte(0));
	close_end(&listener);
	/* The same words tell a caller with TLS that there is none. */
	open_end(&caller, at(ours, "node"), false);
	read_all(&caller);
	assert_int_equal(tls_link_take(caller.link, tls_none_here, sizeof tls_none_here, &caller.e), 0);
	read_all(&caller);
	assert_int_equal(caller.rc, -EACCES);
	assert_non_null(strstr(caller.e.text, "does not speak TLS"));
	close_end(&caller);
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
		cmocka_unit_test(one_authority_replaces_another),
		cmocka_unit_test(names_are_strict),
		cmocka_unit_test(what_is_said_arrives),
		cmocka_unit_test(half_a_record_says_nothing),
		cmocka_unit_test(a_changed_bit_ends_it),
		cmocka_unit_test(a_replayed_record_ends_it),
		cmocka_unit_test(nonsense_ends_it),
		cmocka_unit_test(a_handshake_does_not_grow),
		cmocka_unit_test(plaintext_is_known),
	};
	return cmocka_run_group_tests(tests, make_folders, remove_folders);
}
