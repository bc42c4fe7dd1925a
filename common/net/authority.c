/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The commands of hslt-ca. Each locks the folder, reads the authority, makes a certificate or list in memory, and
 * replaces files in an order in which a crash or power failure leaves a usable folder: keys before certificates, the
 * record in issued/ before the certificate itself. Each file and its name are flushed before the next one is written;
 * key and certificate are renamed together (write_pair).
 *
 * Failures: the folder is not an authority's, a name belongs to another role, a file cannot be read or written, OpenSSL
 * fails (with its reason). A certificate that was not handed out completely is not recorded.
 */
#include "common/net/authority.h"

#include "common/base/disk.h"
#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/base/spelling.h"
#include "common/net/key_pair.h"

#include <dirent.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>

enum { PATH_SIZE = 4096, SERIAL_BYTES = 16, ENTRIES_MAX = 1 << 20 };
/* Certificates and lists are valid from this many seconds before they are signed, since the clocks of other machines
 * may be behind or be set back. */
enum { BACKDATE_SECONDS = 86400 };

struct authority {
	const char *folder;
	int lock_fd;
	X509 *cert;
	EVP_PKEY *key;
	X509_CRL *crl;
};

/* ---- files ---- */

static int join_path(char *path, struct error *e, const char *folder, const char *subfolder, const char *name)
{
	int n = snprintf(path, PATH_SIZE, "%s/%s%s%s", folder, subfolder, *subfolder ? "/" : "", name);
	return n < 0 || n >= PATH_SIZE ? error_set(e, ENAMETOOLONG, "%s: the name is too long", folder) : 0;
}

static int set_crypto_error(struct error *e, const char *what)
{
	unsigned long code = ERR_peek_last_error();
	const char *text = code ? ERR_reason_error_string(code) : NULL;
	error_set(e, EBADMSG, "%s: %s", what, text ? text : "OpenSSL fails");
	ERR_clear_error();
	return -EBADMSG;
}

/* Writes the bytes of b, atomically and durably, into a file of the folder. Frees b. */
static int write_pem(const char *folder, const char *subfolder, const char *name, BIO *b, mode_t mode, struct error *e)
{
	char path[PATH_SIZE], *bytes = NULL;
	long size = b ? BIO_get_mem_data(b, &bytes) : 0;
	int rc = join_path(path, e, folder, subfolder, name);
	if (!rc)
		rc = size > 0 ? disk_replace(path, bytes, (size_t)size, mode, e) : set_crypto_error(e, path);
	if (!rc) {
		*strrchr(path, '/') = 0;
		rc = disk_sync_folder(path, e);
	}
	BIO_free(b);
	return rc;
}

static bool path_exists(const char *path)
{
	struct stat st;
	return disk_stat(path, &st) == 0;
}

static bool has_file(const struct authority *a, const char *subfolder, const char *name)
{
	char path[PATH_SIZE];
	struct error e;
	return join_path(path, &e, a->folder, subfolder, name) == 0 && path_exists(path);
}

static BIO *cert_to_pem(X509 *cert)
{
	BIO *b = BIO_new(BIO_s_mem());
	if (b)
		PEM_write_bio_X509(b, cert);
	return b;
}

static BIO *key_to_pem(EVP_PKEY *key)
{
	BIO *b = BIO_new(BIO_s_secmem());
	if (b)
		PEM_write_bio_PKCS8PrivateKey(b, key, NULL, NULL, 0, NULL, NULL);
	return b;
}

static BIO *crl_to_pem(X509_CRL *list)
{
	BIO *b = BIO_new(BIO_s_mem());
	if (b)
		PEM_write_bio_X509_CRL(b, list);
	return b;
}

static int read_cert(const char *path, X509 **cert, struct error *e)
{
	BIO *b = BIO_new_file(path, "r");
	*cert = b ? PEM_read_bio_X509(b, NULL, NULL, NULL) : NULL;
	BIO_free(b);
	return *cert ? 0 : set_crypto_error(e, path);
}

/* ---- the authority ---- */

static void authority_close(struct authority *a)
{
	X509_free(a->cert);
	EVP_PKEY_free(a->key);
	X509_CRL_free(a->crl);
	if (a->lock_fd >= 0)
		disk_close(a->lock_fd);
}

static int lock_folder(struct authority *a, const char *folder, struct error *e)
{
	*a = (struct authority){.folder = folder};
	a->lock_fd = disk_open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC, 0);
	if (a->lock_fd < 0 && errno == ENOENT)
		return error_set(e, ENOENT, "%s: there is no authority here (hslt-ca init creates one)", folder);
	if (a->lock_fd < 0 || disk_flock(a->lock_fd, LOCK_EX))
		return error_file(e, errno, folder);
	return 0;
}

static int read_crl(struct authority *a, struct error *e)
{
	char path[PATH_SIZE];
	int rc = join_path(path, e, a->folder, "", "crl.pem");
	BIO *b = rc ? NULL : BIO_new_file(path, "r");
	a->crl = b ? PEM_read_bio_X509_CRL(b, NULL, NULL, NULL) : NULL;
	BIO_free(b);
	return rc || a->crl ? rc : set_crypto_error(e, path);
}

static int authority_open(struct authority *a, const char *folder, bool with_key, struct error *e)
{
	char path[PATH_SIZE];
	int rc = lock_folder(a, folder, e);
	if (!rc)
		rc = join_path(path, e, folder, "", "ca.pem");
	if (!rc && !path_exists(path))
		rc = error_set(e, errno, "%s: there is no authority here (hslt-ca init creates one): %s", path,
			       strerror(errno));
	if (!rc)
		rc = read_cert(path, &a->cert, e);
	if (!rc)
		rc = read_crl(a, e);
	if (!rc && with_key)
		rc = join_path(path, e, folder, "", "ca.key");
	if (!rc && with_key) {
		BIO *b = BIO_new_file(path, "r");
		a->key = b ? PEM_read_bio_PrivateKey(b, NULL, NULL, NULL) : NULL;
		BIO_free(b);
		if (!a->key)
			rc = set_crypto_error(e, path);
	}
	if (rc)
		authority_close(a);
	return rc;
}

/* ---- certificates ---- */

static bool add_extension(X509 *cert, X509 *issuer, int nid, const char *value)
{
	X509V3_CTX context;
	X509V3_set_ctx_nodb(&context);
	X509V3_set_ctx(&context, issuer, cert, NULL, NULL, 0);
	X509_EXTENSION *x = X509V3_EXT_conf_nid(NULL, &context, nid, value);
	bool ok = x && X509_add_ext(cert, x, -1) == 1;
	X509_EXTENSION_free(x);
	return ok;
}

static bool set_serial(X509 *cert)
{
	unsigned char bytes[SERIAL_BYTES];
	if (RAND_bytes(bytes, sizeof bytes) != 1)
		return false;
	bytes[0] = (unsigned char)((bytes[0] & 0x7f) | 0x40); /* positive, and of constant length */
	BIGNUM *n = BN_bin2bn(bytes, sizeof bytes, NULL);
	bool ok = n && BN_to_ASN1_INTEGER(n, X509_get_serialNumber(cert));
	BN_free(n);
	return ok;
}

static bool set_subject(X509 *cert, const char *name)
{
	X509_NAME *subject = X509_NAME_new();
	bool ok = subject &&
		  X509_NAME_add_entry_by_txt(subject, "O", MBSTRING_UTF8, (const unsigned char *)"HSLT Farm", -1, -1,
					     0) &&
		  X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, (const unsigned char *)name, -1, -1, 0) &&
		  X509_set_subject_name(cert, subject);
	X509_NAME_free(subject);
	return ok;
}

static bool set_times(X509 *cert, double days, const X509 *issuer)
{
	time_t now = time(NULL), until = now + (time_t)(86400 * days);
	if (issuer && X509_cmp_time(X509_get0_notAfter(issuer), &until) < 0)
		return ASN1_TIME_set(X509_getm_notBefore(cert), now - BACKDATE_SECONDS) &&
		       X509_set1_notAfter(cert, X509_get0_notAfter(issuer));
	return ASN1_TIME_set(X509_getm_notBefore(cert), now - BACKDATE_SECONDS) &&
	       ASN1_TIME_set(X509_getm_notAfter(cert), until);
}

/* Returns a certificate without extensions and signature; NULL if OpenSSL fails. issuer NULL: it is the authority's. */
static X509 *new_cert(const char *name, EVP_PKEY *key, const X509 *issuer, double days)
{
	X509 *cert = X509_new();
	if (cert && X509_set_version(cert, X509_VERSION_3) && set_serial(cert) && set_subject(cert, name) &&
	    set_times(cert, days, issuer) && X509_set_pubkey(cert, key))
		return cert;
	X509_free(cert);
	return NULL;
}

static bool sign_self(X509 *cert, EVP_PKEY *key)
{
	return X509_set_issuer_name(cert, X509_get_subject_name(cert)) &&
	       add_extension(cert, cert, NID_basic_constraints, "critical,CA:TRUE,pathlen:0") &&
	       add_extension(cert, cert, NID_key_usage, "critical,keyCertSign,cRLSign") &&
	       add_extension(cert, cert, NID_subject_key_identifier, "hash") && X509_sign(cert, key, EVP_sha256());
}

static bool sign_cert(const struct authority *a, X509 *cert, enum tls_role role)
{
	char uri[64];
	snprintf(uri, sizeof uri, "URI:hslt:role:%s", tls_role_name(role));
	return X509_set_issuer_name(cert, X509_get_subject_name(a->cert)) &&
	       add_extension(cert, a->cert, NID_basic_constraints, "critical,CA:FALSE") &&
	       add_extension(cert, a->cert, NID_key_usage, "critical,digitalSignature") &&
	       add_extension(cert, a->cert, NID_ext_key_usage, role == TLS_COORDINATOR ? "serverAuth" : "clientAuth") &&
	       add_extension(cert, a->cert, NID_subject_alt_name, uri) &&
	       add_extension(cert, a->cert, NID_subject_key_identifier, "hash") &&
	       add_extension(cert, a->cert, NID_authority_key_identifier, "keyid") &&
	       X509_sign(cert, a->key, EVP_sha256());
}

/* ---- the revocation list ---- */

/* Dates and signs the list. It is valid as long as the authority: an expired list would lock everybody out. */
static int sign_crl(struct authority *a, struct error *e)
{
	ASN1_TIME *from = ASN1_TIME_set(NULL, time(NULL) - BACKDATE_SECONDS);
	bool ok = from && X509_CRL_set_version(a->crl, X509_CRL_VERSION_2) &&
		  X509_CRL_set_issuer_name(a->crl, X509_get_subject_name(a->cert)) &&
		  X509_CRL_set1_lastUpdate(a->crl, from) &&
		  X509_CRL_set1_nextUpdate(a->crl, X509_get0_notAfter(a->cert)) && X509_CRL_sort(a->crl) &&
		  X509_CRL_sign(a->crl, a->key, EVP_sha256());
	ASN1_TIME_free(from);
	return ok ? 0 : set_crypto_error(e, "the revocation list");
}

static bool is_revoked(const struct authority *a, X509 *cert)
{
	X509_REVOKED *found = NULL;
	return X509_CRL_get0_by_serial(a->crl, &found, X509_get_serialNumber(cert)) == 1;
}

static bool add_revoked(struct authority *a, X509 *cert)
{
	X509_REVOKED *r = X509_REVOKED_new();
	ASN1_TIME *now = ASN1_TIME_set(NULL, time(NULL));
	bool ok = r && now && X509_REVOKED_set_serialNumber(r, X509_get_serialNumber(cert)) &&
		  X509_REVOKED_set_revocationDate(r, now) && X509_CRL_add0_revoked(a->crl, r);
	ASN1_TIME_free(now);
	if (!ok)
		X509_REVOKED_free(r);
	return ok;
}

static int write_crl(struct authority *a, const char *subfolder, struct error *e)
{
	return write_pem(a->folder, subfolder, "crl.pem", crl_to_pem(a->crl), 0644, e);
}

/* ---- commands ---- */

static int write_authority(struct authority *a, struct error *e)
{
	char path[PATH_SIZE];
	a->crl = X509_CRL_new();
	int rc = a->crl ? sign_crl(a, e) : set_crypto_error(e, "the revocation list");
	if (!rc)
		rc = join_path(path, e, a->folder, "", "issued");
	if (!rc)
		rc = disk_make_folder(path, e);
	if (!rc)
		rc = write_pem(a->folder, "", "ca.key", key_to_pem(a->key), 0600, e);
	if (!rc)
		rc = write_crl(a, "", e);
	if (!rc) /* written last: it marks a complete authority */
		rc = write_pem(a->folder, "", "ca.pem", cert_to_pem(a->cert), 0644, e);
	return rc;
}

int authority_create(const char *folder, const char *name, double days, struct error *e)
{
	char path[PATH_SIZE];
	struct authority a = {.lock_fd = -1};
	int rc = disk_make_folder(folder, e);
	if (!rc)
		rc = lock_folder(&a, folder, e);
	if (!rc)
		rc = join_path(path, e, folder, "", "ca.pem");
	if (!rc && path_exists(path))
		rc = error_set(
			e, EEXIST, "%s exists: a farm has one authority%s", path,
			has_file(&a, "coordinator", "cert.pem")
				? ""
				: ", and its coordinator lacks a certificate, which `hslt-ca coordinator coordinator` makes");
	if (!rc) {
		char unique[TLS_NAME_MAX + 16];
		unsigned char random[4] = {0};
		/* A unique name: two authorities with the same name could not be told apart while one replaces the
		 * other. */
		RAND_bytes(random, sizeof random);
		snprintf(unique, sizeof unique, "%.*s-%02x%02x%02x%02x", TLS_NAME_MAX - 9, name, random[0], random[1],
			 random[2], random[3]);
		a.key = EVP_EC_gen("P-256");
		a.cert = a.key ? new_cert(unique, a.key, NULL, days) : NULL;
		if (!a.cert || !sign_self(a.cert, a.key))
			rc = set_crypto_error(e, "the authority's certificate");
	}
	if (!rc)
		rc = write_authority(&a, e);
	authority_close(&a);
	return rc;
}

/* Renames a file in the folder of a name. */
static int rename_in_folder(const struct authority *a, const char *name, const char *from, const char *to,
			    struct error *e)
{
	char next[PATH_SIZE], path[PATH_SIZE];
	int rc = join_path(next, e, a->folder, name, from);
	if (!rc)
		rc = join_path(path, e, a->folder, name, to);
	return !rc && disk_rename(next, path) ? error_file(e, errno, path) : rc;
}

/* Writes both files before either replaces the old one, so that the old pair stays if the disk is full. The key is
 * renamed first, and flushed: a program that starts in between, or after a power failure there, finds the certificate
 * of this key beside it (key_pair.c). *key_replaced: the key has been replaced, so there is no way back to the old
 * pair. */
static int write_pair(const struct authority *a, const char *name, X509 *cert, EVP_PKEY *key, bool *key_replaced,
		      struct error *e)
{
	char path[PATH_SIZE];
	struct error ignored;
	int rc = write_pem(a->folder, name, "cert.pem" KEY_PAIR_NEXT, cert_to_pem(cert), 0644, e);
	if (!rc)
		rc = write_pem(a->folder, name, "key.pem.next", key_to_pem(key), 0600, e);
	if (!rc)
		rc = rename_in_folder(a, name, "key.pem.next", "key.pem", e);
	*key_replaced = !rc && has_file(a, name, "cert.pem");
	if (!rc && !(rc = join_path(path, e, a->folder, "", name)))
		rc = disk_sync_folder(path, e);
	if (!rc)
		rc = rename_in_folder(a, name, "cert.pem" KEY_PAIR_NEXT, "cert.pem", e);
	static const char *const files[] = {"cert.pem" KEY_PAIR_NEXT, "key.pem.next"};
	for (size_t i = 0; i < 2; i++)
		/* It will not be recorded. */
		if (!*key_replaced && join_path(path, &ignored, a->folder, name, files[i]) == 0)
			disk_unlink(path);
	return rc;
}

static int write_issued(const struct authority *a, const char *name, X509 *cert, EVP_PKEY *key, struct error *e)
{
	char file[80], path[PATH_SIZE];
	struct tls_peer who;
	bool key_replaced = false;
	int rc = tls_read_peer(cert, &who, e);
	if (rc)
		return rc;
	snprintf(file, sizeof file, "%s.pem", who.serial);
	/* Recorded before anybody can use it: a certificate that is not recorded cannot be revoked by name. */
	rc = write_pem(a->folder, "issued", file, cert_to_pem(cert), 0644, e);
	if (!rc)
		rc = write_pem(a->folder, name, "ca.pem", cert_to_pem(a->cert), 0644, e);
	if (!rc)
		rc = write_pair(a, name, cert, key, &key_replaced, e);
	struct error ignored;
	if (rc && !key_replaced && join_path(path, &ignored, a->folder, "issued", file) == 0) /* nobody has its key */
		disk_unlink(path);
	return rc;
}

/* A folder may only be renewed with a certificate of the same name and role. */
static int check_renewal(const struct authority *a, const char *name, enum tls_role role, struct error *e)
{
	char path[PATH_SIZE];
	X509 *cert;
	struct tls_peer who;
	int rc = join_path(path, e, a->folder, name, "cert.pem");
	if (rc || !has_file(a, name, "cert.pem"))
		return rc;
	rc = read_cert(path, &cert, e);
	if (rc)
		return rc;
	rc = tls_read_peer(cert, &who, e);
	X509_free(cert);
	if (!rc && (who.role != role || strcmp(who.name, name) != 0))
		rc = error_set(e, EEXIST, "%s belongs to the %s %s: --renew cannot change the role to %s", path,
			       tls_role_name(who.role), who.name, tls_role_name(role));
	return rc;
}

/* Returns whether an interrupted call has left the folder: it lacks the certificate, which is written last, and has the
 * revocation list, which is written first, or a part of it, or is empty. An empty folder is removed. */
static bool is_incomplete(const struct authority *a, const char *name, const char *path)
{
	return !has_file(a, name, "cert.pem") &&
	       (has_file(a, name, "crl.pem") || has_file(a, name, "crl.pem.tmp") || disk_rmdir(path) == 0);
}

int authority_issue(const char *folder, const char *name, enum tls_role role, double days, bool renew, struct error *e)
{
	char path[PATH_SIZE];
	struct authority a;
	if (!tls_name_is_valid(name) || strcmp(name, "issued") == 0)
		return error_set(e, EINVAL,
				 "'%s' is not a name: up to %d letters, digits and ._@-, the first a letter or digit",
				 name, TLS_NAME_MAX);
	int rc = authority_open(&a, folder, true, e);
	if (rc)
		return rc;
	rc = join_path(path, e, folder, "", name);
	if (!rc && !renew && path_exists(path) && !is_incomplete(&a, name, path))
		rc = error_set(e, EEXIST, "%s exists: --renew replaces its certificate and key", path);
	if (!rc && renew)
		rc = check_renewal(&a, name, role, e);
	if (!rc)
		rc = disk_make_folder(path, e);
	EVP_PKEY *key = rc ? NULL : EVP_EC_gen("P-256");
	X509 *cert = key ? new_cert(name, key, a.cert, days) : NULL;
	if (!rc && (!cert || !sign_cert(&a, cert, role)))
		rc = set_crypto_error(e, "the certificate");
	if (!rc)
		rc = write_crl(&a, name, e);
	if (!rc)
		rc = write_issued(&a, name, cert, key, e);
	if (!rc)
		rc = disk_sync_folder(path, e);
	X509_free(cert);
	EVP_PKEY_free(key);
	authority_close(&a);
	return rc;
}

/* Calls `each` for every certificate in issued/, until it fails. Files that are not certificates are skipped; *damage
 * describes the first of them, or is empty. */
static int for_each_issued(const char *folder,
			   int (*each)(void *user, X509 *cert, const struct tls_peer *who, struct error *e), void *user,
			   struct error *damage, struct error *e)
{
	char issued[PATH_SIZE], path[PATH_SIZE];
	struct disk_list l;
	int rc = join_path(issued, e, folder, "", "issued");
	damage->text[0] = 0;
	if (rc)
		return rc;
	disk_list_begin(&l, issued);
	for (const char *name; !rc && (name = disk_list_next(&l));) {
		X509 *cert = NULL;
		struct tls_peer who;
		struct error read_error;
		size_t length = strlen(name);
		if (length < 5 || strcmp(name + length - 4, ".pem") != 0)
			continue;
		rc = join_path(path, e, folder, "issued", name);
		if (!rc && !read_cert(path, &cert, &read_error) && !tls_read_peer(cert, &who, &read_error))
			rc = each(user, cert, &who, e);
		else if (!rc && !*damage->text)
			*damage = read_error;
		X509_free(cert);
	}
	return disk_list_end(&l, rc, e);
}

struct revocation {
	struct authority *a;
	struct spelling suggestion;
	const char *name_or_serial;
	unsigned revoked_count, already_revoked_count; /* certificates revoked now, and those revoked before */
};

static int revoke_one(void *user, X509 *cert, const struct tls_peer *who, struct error *e)
{
	struct revocation *r = user;
	if (X509_cmp_current_time(X509_get0_notAfter(cert)) >= 0 && !is_revoked(r->a, cert))
		spelling_offer(&r->suggestion, who->name);
	if ((strcmp(who->name, r->name_or_serial) != 0 && strcasecmp(who->serial, r->name_or_serial) != 0) ||
	    X509_cmp_current_time(X509_get0_notAfter(cert)) < 0)
		return 0;
	if (is_revoked(r->a, cert)) {
		r->already_revoked_count++;
		return 0;
	}
	r->revoked_count++;
	return add_revoked(r->a, cert) ? 0 : set_crypto_error(e, "the revocation list");
}

static int copy_crl_to_coordinator(void *user, X509 *cert, const struct tls_peer *who, struct error *e)
{
	struct authority *a = user;
	char path[PATH_SIZE];
	(void)cert;
	int rc = join_path(path, e, a->folder, "", who->name);
	return rc || who->role != TLS_COORDINATOR || !path_exists(path) ? rc : write_crl(a, who->name, e);
}

int authority_revoke(const char *folder, const char *name_or_serial, unsigned *count, struct error *e)
{
	struct authority a;
	int rc = authority_open(&a, folder, true, e);
	if (rc)
		return rc;
	struct revocation r = {
		.a = &a, .suggestion = {.wanted_name = name_or_serial}, .name_or_serial = name_or_serial};
	struct error damage;
	char hint[96];
	rc = for_each_issued(folder, revoke_one, &r, &damage, e);
	if (!rc && !r.revoked_count && !r.already_revoked_count)
		rc = error_set(e, ENOENT, "no valid certificate has the name or serial number '%s'%s%s%s",
			       name_or_serial, spelling_hint(&r.suggestion, hint, sizeof hint),
			       *damage.text ? "; " : "", damage.text);
	if (!rc && r.revoked_count)
		rc = sign_crl(&a, e);
	if (!rc) /* also if all were revoked before: an interrupted call may not have told the coordinators */
		rc = write_crl(&a, "", e);
	*count = rc ? 0 : r.revoked_count;
	if (!rc)
		rc = for_each_issued(folder, copy_crl_to_coordinator, &a, &damage, e);
	if (!rc && *damage.text)
		rc = error_set(e, EBADMSG, "%s: if that was a certificate of %s, it is not revoked", damage.text,
			       name_or_serial);
	authority_close(&a);
	return rc;
}

struct listing {
	const struct authority *a;
	struct authority_entry *entries;
	size_t count;
};

static time_t asn1_to_time(const ASN1_TIME *t)
{
	struct tm tm;
	return ASN1_TIME_to_tm(t, &tm) ? timegm(&tm) : 0;
}

static int append_entry(void *user, X509 *cert, const struct tls_peer *who, struct error *e)
{
	struct listing *l = user;
	struct authority_entry *grown =
		l->count == ENTRIES_MAX ? NULL : list_grow_array(l->entries, l->count, sizeof *grown);
	if (!grown)
		return error_set(e, ENOMEM, "no memory for the list of certificates");
	l->entries = grown;
	l->entries[l->count++] = (struct authority_entry){.subject = *who,
							  .valid_from = asn1_to_time(X509_get0_notBefore(cert)),
							  .valid_until = asn1_to_time(X509_get0_notAfter(cert)),
							  .is_revoked = is_revoked(l->a, cert)};
	return 0;
}

static int compare_entries(const void *x, const void *y)
{
	const struct authority_entry *a = x, *b = y;
	int order = strcmp(a->subject.name, b->subject.name);
	return order ? order : (a->valid_from > b->valid_from) - (a->valid_from < b->valid_from);
}

int authority_list(const char *folder, struct authority_entry **entries, size_t *count, struct error *e)
{
	struct authority a;
	struct listing l = {.a = &a};
	struct error damage;
	*entries = NULL;
	*count = 0;
	int rc = authority_open(&a, folder, false, e);
	if (rc)
		return rc;
	rc = for_each_issued(folder, append_entry, &l, &damage, e);
	authority_close(&a);
	if (rc) {
		mem_free(l.entries);
		return rc;
	}
	if (l.count)
		qsort(l.entries, l.count, sizeof *l.entries, compare_entries);
	*entries = l.entries;
	*count = l.count;
	return *damage.text ? error_set(e, EBADMSG, "%s", damage.text) : 0;
}
