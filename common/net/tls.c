/* SPDX-License-Identifier: Apache-2.0 */
/*
 * An SSL_CTX is made from the folder's files, and made again when one of them changes. A link is the TLS state of one
 * connection, between two memory buffers of OpenSSL: received bytes go into one, bytes to send come out of the other.
 * OpenSSL checks chain, revocation and expiry of the peer's certificate; verify_certificate() then checks the role.
 *
 * If the files cannot be used after a change, the old SSL_CTX stays. A link that fails returns an error of tls.h and,
 * as its last output, an alert for the peer; explain_failure() puts into words why either side does not accept a
 * certificate.
 */
#include "common/net/tls.h"

#include "common/base/mem.h"
#include "common/base/text.h"
#include "common/net/key_pair.h"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

enum {
	HANDSHAKE_BYTES_MAX = 1 << 16, /* bytes accepted from a peer before its certificate was checked */
	CERTIFICATES_MAX = 1 << 14,
	CHAIN_DEPTH_MAX = 1,
	ALERT_REASON_BASE = 1000, /* OpenSSL's number for the reason of a received alert */
	ALERT_RECORD = 21,
	HANDSHAKE_RECORD = 22,
	BAD_CERTIFICATE = 42,
	CERTIFICATE_EXPIRED = 45,
	PROTOCOL_VERSION = 70,
};

const unsigned char tls_mismatch_alert[7] = {ALERT_RECORD, 3, 3, 0, 2, 2, PROTOCOL_VERSION};

enum { FILE_COUNT = 4 };
static const char *const file_names[FILE_COUNT] = {"ca.pem", "cert.pem", "key.pem", "crl.pem"};

struct file_version { /* identifies a version of a file; zeros: the file does not exist */
	ino_t inode;
	off_t size;
	struct timespec changed;
};

struct tls {
	char folder[3072];
	SSL_CTX *context;
	struct file_version used_versions[FILE_COUNT]; /* of the files in use */
	struct file_version read_versions[FILE_COUNT]; /* of the files that were read last, usable or not */
	struct tls_peer self;
	time_t authority_expiry;
	time_t warning_time; /* time of the last tls_expiry_warning_due that returned true; 0: not since the files were
				read */
	double recheck_seconds; /* see tls_recheck_seconds */
};

struct tls_link {
	struct tls *tls;
	SSL *ssl;
	BIO *input, *output; /* owned by `ssl` */
	struct tls_peer peer;
	size_t handshake_bytes; /* bytes received before the handshake was complete */
	bool is_server, has_input, is_open;
	char role_error[128]; /* why the peer's certificate is refused although its chain is valid */
};

bool tls_is_first_byte(unsigned char c)
{
	return c == HANDSHAKE_RECORD || c == ALERT_RECORD;
}

/* ---- names and roles ---- */

static const char role_prefix[] = "hslt:role:";
static const char *const role_names[TLS_ROLES] = {"nobody", "coordinator", "worker", "client", "operator"};

const char *tls_role_name(enum tls_role r)
{
	return role_names[r];
}

static bool is_alphanumeric(char c)
{
	return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

bool tls_name_is_valid(const char *name)
{
	size_t length = strlen(name);
	if (length > TLS_NAME_MAX || !is_alphanumeric(*name))
		return false;
	for (size_t i = 0; i < length; i++)
		if (!is_alphanumeric(name[i]) && !strchr("._@-", name[i]))
			return false;
	return true;
}

static enum tls_role role_from_uri(const ASN1_IA5STRING *uri)
{
	const char *text = (const char *)ASN1_STRING_get0_data(uri);
	size_t length = (size_t)ASN1_STRING_length(uri), prefix = sizeof role_prefix - 1;
	if (length <= prefix || memcmp(text, role_prefix, prefix) != 0)
		return TLS_NO_ROLE;
	for (int r = TLS_COORDINATOR; r < TLS_ROLES; r++)
		if (length - prefix == strlen(role_names[r]) &&
		    memcmp(text + prefix, role_names[r], length - prefix) == 0)
			return (enum tls_role)r;
	return TLS_NO_ROLE;
}

/* Returns the role of a certificate; TLS_NO_ROLE unless it has exactly one: with two, its rights would be unclear. */
static enum tls_role read_role(X509 *cert)
{
	enum tls_role found = TLS_NO_ROLE;
	int count = 0;
	GENERAL_NAMES *names = X509_get_ext_d2i(cert, NID_subject_alt_name, NULL, NULL);
	for (int i = 0; i < sk_GENERAL_NAME_num(names); i++) {
		const GENERAL_NAME *n = sk_GENERAL_NAME_value(names, i);
		enum tls_role r = n->type == GEN_URI ? role_from_uri(n->d.uniformResourceIdentifier) : TLS_NO_ROLE;
		if (r != TLS_NO_ROLE) {
			found = r;
			count++;
		}
	}
	GENERAL_NAMES_free(names);
	return count == 1 ? found : TLS_NO_ROLE;
}

static time_t cert_expiry(const X509 *cert)
{
	struct tm tm;
	return ASN1_TIME_to_tm(X509_get0_notAfter(cert), &tm) ? timegm(&tm) : 0;
}

int tls_read_peer(X509 *cert, struct tls_peer *p, struct error *e)
{
	memset(p, 0, sizeof *p);
	p->expiry_time = cert_expiry(cert);
	X509_NAME *subject = X509_get_subject_name(cert);
	int at = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
	const ASN1_STRING *name = at < 0 ? NULL : X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at));
	size_t length = name ? (size_t)ASN1_STRING_length(name) : 0;
	if (length > 0 && length <= TLS_NAME_MAX &&
	    strnlen((const char *)ASN1_STRING_get0_data(name), length) == length)
		memcpy(p->name, ASN1_STRING_get0_data(name), length);
	if (!tls_name_is_valid(p->name))
		return error_set(e, EACCES, "the certificate has no name that is valid in this farm");
	BIGNUM *serial = ASN1_INTEGER_to_BN(X509_get0_serialNumber(cert), NULL);
	char *hex = serial ? BN_bn2hex(serial) : NULL;
	text_copy(p->serial, sizeof p->serial, hex ? hex : "");
	OPENSSL_free(hex);
	BN_free(serial);
	p->role = read_role(cert);
	if (p->role == TLS_NO_ROLE)
		return error_set(e, EACCES, "the certificate of %s has no role in the farm", p->name);
	return 0;
}

/* ---- certificates that expire soon ---- */

static bool describe_expiry(const char *subject, time_t until, time_t now, char *text, size_t size)
{
	char when[32];
	struct tm tm;
	double days = difftime(until, now) / 86400;
	if (size)
		*text = 0;
	if (!until || days > TLS_WARN_DAYS)
		return false;
	strftime(when, sizeof when, "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&until, &tm));
	if (days > 0)
		snprintf(text, size, "%s expires in %.3g days, at %s", subject, days, when);
	else
		snprintf(text, size, "%s has expired, at %s", subject, when);
	return true;
}

bool tls_describe_expiry(const struct tls_peer *p, time_t now, char *text, size_t size)
{
	char subject[TLS_NAME_MAX + 32];
	snprintf(subject, sizeof subject, "the certificate of %s", p->name);
	return describe_expiry(subject, p->expiry_time, now, text, size);
}

bool tls_expiry_warning(const struct tls *t, time_t now, char *text, size_t size)
{
	char own_text[192], authority[160];
	bool first = tls_describe_expiry(&t->self, now, own_text, sizeof own_text);
	bool second =
		describe_expiry("the authority's certificate", t->authority_expiry, now, authority, sizeof authority);
	snprintf(text, size, "%s%s%s", own_text, first && second ? "; " : "", authority);
	return first || second;
}

bool tls_expiry_warning_due(struct tls *t, time_t now, char *text, size_t size)
{
	if ((t->warning_time && difftime(now, t->warning_time) < 86400) || !tls_expiry_warning(t, now, text, size))
		return false;
	t->warning_time = now;
	return true;
}

time_t tls_authority_expiry(const struct tls *t)
{
	return t->authority_expiry;
}

/* ---- the folder ---- */

static int file_path(const struct tls *t, int file, char *path, size_t size)
{
	return snprintf(path, size, "%s/%s", t->folder, file_names[file]);
}

static void stat_files(const struct tls *t, struct file_version *stamps)
{
	for (int i = 0; i < FILE_COUNT; i++) {
		char path[4096];
		struct stat st;
		file_path(t, i, path, sizeof path);
		memset(&stamps[i], 0, sizeof stamps[i]);
		if (stat(path, &st))
			continue;
		stamps[i].inode = st.st_ino;
		stamps[i].size = st.st_size;
		stamps[i].changed = st.st_mtim;
	}
}

static int set_file_error(struct error *e, int code, const char *path)
{
	unsigned long reason = ERR_peek_last_error();
	const char *text = reason ? ERR_reason_error_string(reason) : NULL;
	return error_set(e, code, "%s: %s", path, text ? text : "cannot be used");
}

/* Called by OpenSSL for each certificate of the chain. At depth 0, the chain is valid: checks the peer's role. */
static int verify_certificate(int good, X509_STORE_CTX *sc)
{
	if (!good || X509_STORE_CTX_get_error_depth(sc) != 0)
		return good;
	SSL *ssl = X509_STORE_CTX_get_ex_data(sc, SSL_get_ex_data_X509_STORE_CTX_idx());
	struct tls_link *l = ssl ? SSL_get_app_data(ssl) : NULL;
	struct error e;
	if (!l)
		return good;
	if (tls_read_peer(X509_STORE_CTX_get_current_cert(sc), &l->peer, &e) == 0) {
		if (l->is_server || l->peer.role == TLS_COORDINATOR)
			return 1;
		error_set(&e, EACCES, "it is the certificate of a %s, not of a coordinator", role_names[l->peer.role]);
	}
	text_copy(l->role_error, sizeof l->role_error, e.text);
	X509_STORE_CTX_set_error(sc, X509_V_ERR_APPLICATION_VERIFICATION);
	return 0;
}

/* Copies the revocation lists of an old context, so that certificates stay revoked if crl.pem is lost. Returns their
 * number; -1 if memory is out. */
static int copy_crls(SSL_CTX *from, X509_STORE *to)
{
	int count = 0;
	STACK_OF(X509_OBJECT) *all = X509_STORE_get0_objects(SSL_CTX_get_cert_store(from));
	for (int i = 0; i < sk_X509_OBJECT_num(all); i++) {
		X509_CRL *list = X509_OBJECT_get0_X509_CRL(sk_X509_OBJECT_value(all, i));
		if (list && X509_STORE_add_crl(to, list) != 1)
			return -1;
		count += list != NULL;
	}
	return count;
}

static int load_store(const struct tls *t, SSL_CTX *context, bool revocations, struct error *e)
{
	char path[4096];
	X509_STORE *store = X509_STORE_new();
	file_path(t, 0, path, sizeof path);
	if (!store || X509_STORE_load_file(store, path) != 1) {
		X509_STORE_free(store);
		return set_file_error(e, EBADMSG, path);
	}
	SSL_CTX_set_cert_store(context, store); /* the context now owns the store */
	int kept_crls = revocations || !t->context ? 0 : copy_crls(t->context, store);
	if (kept_crls < 0)
		return error_set(e, ENOMEM, "no memory for TLS");
	if (!revocations && !kept_crls)
		return 0;
	file_path(t, 3, path, sizeof path);
	if (revocations &&
	    X509_load_crl_file(X509_STORE_add_lookup(store, X509_LOOKUP_file()), path, X509_FILETYPE_PEM) < 1)
		return set_file_error(e, EBADMSG, path);
	X509_STORE_set_flags(store, X509_V_FLAG_CRL_CHECK);
	return 0;
}

static int load_key_pair(const struct tls *t, SSL_CTX *context, struct tls_peer *self, struct error *e)
{
	char path[4096], key[4096];
	struct stat st;
	file_path(t, 2, key, sizeof key);
	if (stat(key, &st))
		return error_file(e, errno, key);
	if (st.st_mode & 0007)
		return error_set(e, EPERM, "%s: everybody on this machine can read the key: chmod 600", key);
	file_path(t, 1, path, sizeof path);
	const char *bad = key_pair_load(context, key, path);
	if (bad)
		return set_file_error(e, EBADMSG, bad);
	int rc = tls_read_peer(SSL_CTX_get0_certificate(context), self, e);
	return rc ? error_prefix(e, rc, "%s", path) : 0;
}

/* Returns when the certificate of the authority expires; the latest, if one authority is being replaced by another. */
static time_t find_authority_expiry(SSL_CTX *context)
{
	time_t last = 0;
	STACK_OF(X509_OBJECT) *all = X509_STORE_get0_objects(SSL_CTX_get_cert_store(context));
	for (int i = 0; i < sk_X509_OBJECT_num(all); i++) {
		X509 *cert = X509_OBJECT_get0_X509(sk_X509_OBJECT_value(all, i));
		if (!cert || X509_check_issued(cert, SSL_CTX_get0_certificate(context)) != X509_V_OK)
			continue;
		time_t until = cert_expiry(cert);
		last = until > last ? until : last;
	}
	return last;
}

static void set_protocol(SSL_CTX *context)
{
	SSL_CTX_set_min_proto_version(context, TLS1_3_VERSION);
	SSL_CTX_set_max_proto_version(context, TLS1_3_VERSION);
	SSL_CTX_set_options(context, SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION |
					     SSL_OP_CIPHER_SERVER_PREFERENCE);
	SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
	SSL_CTX_set_num_tickets(context, 0);
	SSL_CTX_set_mode(context, SSL_MODE_RELEASE_BUFFERS);
	SSL_CTX_set_max_cert_list(context, CERTIFICATES_MAX);
	SSL_CTX_set_verify(context, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, verify_certificate);
	SSL_CTX_set_verify_depth(context, CHAIN_DEPTH_MAX);
}

static int load_context(const struct tls *t, bool revocations, SSL_CTX **out, struct tls_peer *self, struct error *e)
{
	ERR_clear_error();
	SSL_CTX *context = SSL_CTX_new(TLS_method());
	if (!context)
		return error_set(e, ENOMEM, "no memory for TLS");
	set_protocol(context);
	int rc = load_key_pair(t, context, self, e);
	if (!rc)
		rc = load_store(t, context, revocations, e);
	ERR_clear_error();
	if (rc)
		SSL_CTX_free(context);
	else
		*out = context;
	return rc;
}

static bool file_exists(const struct file_version *s)
{
	return s->inode != 0;
}

int tls_open(struct tls **out, const char *folder, struct error *e)
{
	struct tls *t = mem_alloc(1, sizeof *t);
	if (!t)
		return error_set(e, ENOMEM, "no memory for TLS");
	int n = snprintf(t->folder, sizeof t->folder, "%s", folder);
	int rc = n < 0 || (size_t)n >= sizeof t->folder ? error_set(e, EINVAL, "%s: the name is too long", folder) : 0;
	struct stat st;
	if (!rc && (stat(folder, &st) || !S_ISDIR(st.st_mode)))
		rc = error_set(e, EPERM, "%s is not a folder", folder);
	t->recheck_seconds = 60;
	stat_files(t, t->used_versions);
	memcpy(t->read_versions, t->used_versions, sizeof t->read_versions);
	if (!rc)
		rc = load_context(t, file_exists(&t->used_versions[3]), &t->context, &t->self, e);
	if (rc) {
		mem_free(t);
		return error_prefix(e, rc, "TLS");
	}
	t->authority_expiry = find_authority_expiry(t->context);
	*out = t;
	return 0;
}

void tls_close(struct tls *t)
{
	if (!t)
		return;
	SSL_CTX_free(t->context);
	mem_free(t);
}

int tls_refresh(struct tls *t, struct error *e)
{
	struct file_version now[FILE_COUNT];
	struct tls_peer self;
	SSL_CTX *fresh;
	stat_files(t, now);
	bool files_changed = memcmp(now, t->read_versions, sizeof now) != 0;
	memcpy(t->read_versions, now, sizeof now);
	if (memcmp(now, t->used_versions, sizeof now) == 0)
		return 0;
	bool crl_lost = file_exists(&t->used_versions[3]) && !file_exists(&now[3]);
	int rc = load_context(t, file_exists(&now[3]), &fresh, &self, e);
	if (rc && !files_changed)
		return 0;
	if (rc)
		return error_prefix(e, rc, "TLS; the previous files stay in use%s",
				    crl_lost ? ", including crl.pem, which is missing" : "");
	memcpy(t->used_versions, now, sizeof now);
	SSL_CTX_free(t->context);
	t->context = fresh;
	t->self = self;
	t->authority_expiry = find_authority_expiry(fresh);
	t->warning_time = 0;
	return crl_lost
		       ? error_set(e, ENOENT, "TLS: %s/crl.pem is missing; the previous list stays in force", t->folder)
		       : 1;
}

const struct tls_peer *tls_own_certificate(const struct tls *t)
{
	return &t->self;
}

void tls_set_recheck(struct tls *t, double seconds)
{
	t->recheck_seconds = seconds;
}

double tls_recheck_seconds(const struct tls *t)
{
	return t->recheck_seconds;
}

/* ---- links ---- */

int tls_link_new(struct tls_link **out, struct tls *t, bool is_server, struct error *e)
{
	struct tls_link *l = mem_alloc(1, sizeof *l);
	SSL *ssl = l ? SSL_new(t->context) : NULL;
	BIO *in = ssl ? BIO_new(BIO_s_mem()) : NULL, *to = in ? BIO_new(BIO_s_mem()) : NULL;
	if (!to) {
		BIO_free(in);
		SSL_free(ssl);
		mem_free(l);
		return error_set(e, ENOMEM, "no memory for TLS");
	}
	BIO_set_mem_eof_return(in, -1);
	SSL_set_bio(ssl, in, to);
	SSL_set_app_data(ssl, l);
	if (is_server)
		SSL_set_accept_state(ssl);
	else
		SSL_set_connect_state(ssl);
	*l = (struct tls_link){.tls = t, .ssl = ssl, .input = in, .output = to, .is_server = is_server};
	*out = l;
	return 0;
}

void tls_link_free(struct tls_link *l)
{
	if (!l)
		return;
	SSL_free(l->ssl);
	mem_free(l);
}

int tls_link_receive(struct tls_link *l, const void *bytes, size_t size, struct error *e)
{
	if (!size)
		return 0;
	if (!l->has_input && !tls_is_first_byte(*(const unsigned char *)bytes)) {
		BIO_write(l->output, tls_mismatch_alert, sizeof tls_mismatch_alert);
		return error_set(e, EACCES, "the peer does not use TLS, which is required here");
	}
	l->has_input = true;
	l->handshake_bytes += l->is_open ? 0 : size;
	if (BIO_write(l->input, bytes, (int)size) != (int)size)
		return error_set(e, ENOMEM, "no memory for TLS");
	return 0;
}

/* Sets the error for a certificate that OpenSSL refuses. If its dates are the reason, this machine's clock may be
 * wrong, so the sentence names the time. */
static int set_verify_error(struct error *e, const char *refusal, int verdict)
{
	char clock[64] = "";
	time_t now = time(NULL);
	struct tm tm;
	bool is_date_error = verdict == X509_V_ERR_CERT_NOT_YET_VALID || verdict == X509_V_ERR_CERT_HAS_EXPIRED ||
			     verdict == X509_V_ERR_CRL_NOT_YET_VALID || verdict == X509_V_ERR_CRL_HAS_EXPIRED;
	if (is_date_error)
		strftime(clock, sizeof clock, " by the clock of this machine, %Y-%m-%dT%H:%M:%SZ", gmtime_r(&now, &tm));
	return error_set(e, is_date_error ? EKEYEXPIRED : EACCES, "%s: %s%s", refusal,
			 X509_verify_cert_error_string(verdict), clock);
}

/* Sets the error for an alert of the peer. OpenSSL sends "bad certificate" for one that is not valid yet. */
static int set_alert_error(struct error *e, int alert)
{
	bool is_date_error = alert == CERTIFICATE_EXPIRED || alert == BAD_CERTIFICATE;
	return error_set(e, is_date_error ? EKEYEXPIRED : EACCES, "the peer does not accept this certificate: %s%s",
			 SSL_alert_desc_string_long(alert),
			 alert == CERTIFICATE_EXPIRED ? " by the clock of its machine" : "");
}

/* Sets the error for a failure of OpenSSL, worded for the person who has to fix it. */
static int explain_failure(struct tls_link *l, struct error *e)
{
	unsigned long code = ERR_peek_error();
	int reason = ERR_GET_REASON(code), alert = reason - ALERT_REASON_BASE;
	long verdict = SSL_get_verify_result(l->ssl);
	const char *text = code ? ERR_reason_error_string(code) : NULL;
	if (*l->role_error)
		return error_set(e, EACCES, "the peer's certificate is not accepted: %s", l->role_error);
	if (ERR_GET_LIB(code) == ERR_LIB_SSL && reason == SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE)
		return error_set(e, EACCES, "the peer has no certificate");
	if (ERR_GET_LIB(code) == ERR_LIB_SSL && alert == PROTOCOL_VERSION)
		return error_set(e, EACCES, "the peer does not speak TLS 1.3: was it started without --tls?");
	if (ERR_GET_LIB(code) == ERR_LIB_SSL && alert >= 40 && alert < 256)
		return set_alert_error(e, alert);
	if (verdict != X509_V_OK)
		return set_verify_error(e, "the peer's certificate is not accepted", (int)verdict);
	return error_set(e, EPROTO, "TLS: %s", text ? text : "invalid data on the wire");
}

/* OpenSSL's buffers never shrink: after 64 KiB came at once they hold 87 KB, for each of thousands of peers. Replaces
 * *b by a new buffer if it is large and empty; `set` gives it to the SSL object. */
static void replace_large_buffer(struct tls_link *l, BIO **b, void (*set)(SSL *, BIO *))
{
	enum { KEPT_BYTES_MAX = 4096 };
	BUF_MEM *m = NULL;
	BIO_get_mem_ptr(*b, &m);
	BIO *fresh = l->is_open && BIO_pending(*b) == 0 && m && m->max > KEPT_BYTES_MAX ? BIO_new(BIO_s_mem()) : NULL;
	if (!fresh)
		return;
	BIO_set_mem_eof_return(fresh, -1);
	set(l->ssl, fresh);
	*b = fresh;
}

ssize_t tls_link_read(struct tls_link *l, void *out, size_t size, struct error *e)
{
	size_t count = 0;
	ERR_clear_error();
	int ok = SSL_read_ex(l->ssl, out, size, &count);
	if (!l->is_open && SSL_is_init_finished(l->ssl))
		l->is_open = true;
	if (ok == 1)
		return (ssize_t)count;
	int rc;
	switch (SSL_get_error(l->ssl, ok)) {
	case SSL_ERROR_WANT_READ: /* all input is used up. (Bytes that follow the handshake do not count against it.) */
		if (!l->is_open && l->handshake_bytes > HANDSHAKE_BYTES_MAX)
			return error_set(e, EPROTO, "the TLS handshake is longer than %d bytes", HANDSHAKE_BYTES_MAX);
		replace_large_buffer(l, &l->input, SSL_set0_rbio);
		return 0;
	case SSL_ERROR_ZERO_RETURN:
		return error_set(e, ECONNRESET, "the peer hung up");
	default:
		rc = explain_failure(l, e);
		ERR_clear_error();
		return rc;
	}
}

int tls_link_write(struct tls_link *l, const void *bytes, size_t size, struct error *e)
{
	size_t done = 0;
	ERR_clear_error();
	if (SSL_write_ex(l->ssl, bytes, size, &done) == 1 && done == size)
		return 0;
	int rc = explain_failure(l, e);
	ERR_clear_error();
	return rc;
}

size_t tls_link_output(struct tls_link *l, const unsigned char **bytes)
{
	char *at = NULL;
	long size = BIO_get_mem_data(l->output, &at);
	*bytes = (const unsigned char *)at;
	return size > 0 ? (size_t)size : 0;
}

void tls_link_clear_output(struct tls_link *l)
{
	(void)BIO_reset(l->output);
	replace_large_buffer(l, &l->output, SSL_set0_wbio);
}

bool tls_link_is_open(const struct tls_link *l)
{
	return l->is_open;
}

const struct tls_peer *tls_link_peer(const struct tls_link *l)
{
	return &l->peer;
}

int tls_link_recheck(struct tls_link *l, struct error *e)
{
	int rc = 0;
	X509 *cert = SSL_get0_peer_certificate(l->ssl);
	X509_STORE_CTX *sc = X509_STORE_CTX_new();
	if (!sc || !cert ||
	    X509_STORE_CTX_init(sc, SSL_CTX_get_cert_store(l->tls->context), cert, SSL_get_peer_cert_chain(l->ssl)) !=
		    1 ||
	    X509_STORE_CTX_set_default(sc, l->is_server ? "ssl_client" : "ssl_server") != 1)
		rc = error_set(e, ENOMEM, "the peer's certificate cannot be checked again");
	else if (X509_verify_cert(sc) != 1)
		rc = set_verify_error(e, "the peer's certificate is no longer accepted", X509_STORE_CTX_get_error(sc));
	X509_STORE_CTX_free(sc);
	ERR_clear_error();
	return rc;
}
