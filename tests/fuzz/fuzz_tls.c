/* SPDX-License-Identifier: Apache-2.0 */
/*
 * TLS in memory. The first byte says what the others are: bytes that a stranger sends to a listener or to a caller;
 * changes to one direction of a handshake and of the stream after it; records for an established link; a certificate.
 * Whatever is changed, no link may open to a stranger, and the received bytes are a prefix of those sent.
 */
#include "common/net/authority.h"
#include "tests/fuzz/folders.h"
#include "tests/fuzz/seeds.h"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <stdio.h>
#include <string.h>

enum input_kind { TO_LISTENER, TO_CALLER, CHANGE_CALLER, CHANGE_LISTENER, RECORDS, CERTIFICATE, INPUT_KINDS };
enum { STREAM_BYTES = 3000, EDITS_MAX = 16, PIECE_BYTES = 700 };

static struct tls *farm, *node, *stranger;

static void require(int rc, const struct error *e)
{
	if (rc) {
		fprintf(stderr, "%s\n", e->text);
		abort();
	}
}

static struct tls *issue_and_open(const char *authority, const char *name, enum tls_role role)
{
	char path[256], home[128];
	struct tls *t;
	struct error e = {""};
	snprintf(home, sizeof home, "%s/%s", folders_base(), authority);
	snprintf(path, sizeof path, "%s/%s", home, name);
	require(authority_issue(home, name, role, 1, false, &e), &e);
	require(tls_open(&t, path, &e), &e);
	return t;
}

static void make_folders(void)
{
	static const char *const homes[] = {"ours", "theirs"};
	struct error e = {""};
	if (farm)
		return;
	for (int i = 0; i < 2; i++) {
		char home[128];
		snprintf(home, sizeof home, "%s/%s", folders_base(), homes[i]);
		require(authority_create(home, homes[i], 2, &e), &e);
	}
	farm = issue_and_open("ours", "farm", TLS_COORDINATOR);
	node = issue_and_open("ours", "node", TLS_WORKER);
	stranger = issue_and_open("theirs", "node", TLS_WORKER);
}

/* ---- an end ---- */

struct tls_end {
	struct tls_link *link;
	bool is_broken;
	uint8_t received[2 * STREAM_BYTES];
	size_t received_size;
};

static struct tls_end caller, listener;

static void open_end(struct tls_end *x, struct tls *t, bool listening)
{
	struct error e;
	*x = (struct tls_end){0};
	require(tls_link_new(&x->link, t, listening, &e), &e);
}

static void read_all(struct tls_end *x)
{
	struct error e;
	ssize_t n = 1;
	while (!x->is_broken && n > 0) {
		uint8_t bytes[512];
		n = tls_link_read(x->link, bytes, sizeof bytes, &e);
		x->is_broken = n < 0;
		for (ssize_t i = 0; i < n && x->received_size < sizeof x->received; i++)
			x->received[x->received_size++] = bytes[i];
	}
}

static void pass_bytes(struct tls_end *x, const void *bytes, size_t size)
{
	struct error e;
	for (size_t i = 0; i < size && !x->is_broken; i += PIECE_BYTES) {
		x->is_broken = tls_link_receive(x->link, (const uint8_t *)bytes + i,
						size - i < PIECE_BYTES ? size - i : PIECE_BYTES, &e) != 0;
		read_all(x);
	}
}

/* ---- two ends, and an attacker between them ---- */

struct edits { /* changes to one direction: u16 BE position, one byte to xor */
	const uint8_t *bytes;
	size_t size, passed;
	const struct tls_end *from;
};

static void apply_edits(struct edits *d, uint8_t *bytes, size_t size)
{
	for (size_t i = 0; i + 3 <= d->size && i < 3 * EDITS_MAX; i += 3) {
		size_t place = (size_t)d->bytes[i] << 8 | d->bytes[i + 1];
		if (place >= d->passed && place < d->passed + size)
			bytes[place - d->passed] ^= d->bytes[i + 2];
	}
	d->passed += size;
}

static bool carry_output(struct tls_end *from, struct tls_end *to, struct edits *d)
{
	const unsigned char *bytes;
	static uint8_t copy[1 << 17];
	size_t size = tls_link_output(from->link, &bytes);
	if (!size)
		return false;
	if (size > sizeof copy)
		abort();
	memcpy(copy, bytes, size);
	tls_link_clear_output(from->link);
	if (d && d->from == from)
		apply_edits(d, copy, size);
	pass_bytes(to, copy, size);
	return true;
}

static void carry_all(struct edits *d)
{
	bool more = true;
	while (more) {
		more = carry_output(&caller, &listener, d);
		more |= carry_output(&listener, &caller, d);
	}
}

static uint8_t stream_byte(size_t i)
{
	return (uint8_t)(i * 7 + i / 251);
}

static void write_bytes(struct tls_end *x)
{
	uint8_t bytes[STREAM_BYTES];
	struct error e;
	for (size_t i = 0; i < STREAM_BYTES; i++)
		bytes[i] = stream_byte(i);
	if (!x->is_broken && tls_link_is_open(x->link))
		x->is_broken = tls_link_write(x->link, bytes, STREAM_BYTES, &e) != 0;
}

static void check_received(const struct tls_end *x, const char *name)
{
	if (x->received_size > STREAM_BYTES)
		abort();
	for (size_t i = 0; i < x->received_size; i++)
		if (x->received[i] != stream_byte(i))
			abort();
	if (tls_link_is_open(x->link) && strcmp(tls_link_peer(x->link)->name, name) != 0)
		abort();
}

static void run_conversation(const uint8_t *bytes, size_t size, const struct tls_end *changed, struct tls *caller_tls)
{
	struct edits d = {bytes, size, 0, changed};
	open_end(&caller, caller_tls, false);
	open_end(&listener, farm, true);
	read_all(&caller);
	carry_all(&d);
	write_bytes(&caller);
	write_bytes(&listener);
	carry_all(&d);
	check_received(&caller, "farm");
	check_received(&listener, "node");
	if (caller_tls == stranger && tls_link_is_open(listener.link))
		abort();
	tls_link_free(caller.link);
	tls_link_free(listener.link);
}

static void send_records(const uint8_t *bytes, size_t size)
{
	struct error e;
	open_end(&caller, node, false);
	open_end(&listener, farm, true);
	read_all(&caller);
	carry_all(NULL);
	if (!tls_link_is_open(listener.link) || !tls_link_is_open(caller.link))
		abort();
	pass_bytes(&listener, bytes, size);
	if (listener.received_size)
		abort(); /* without the keys nothing may be received from a peer */
	if (tls_link_recheck(listener.link, &e))
		abort();
	tls_link_free(caller.link);
	tls_link_free(listener.link);
}

static void send_alone(const uint8_t *bytes, size_t size, bool listening)
{
	struct tls_end *x = listening ? &listener : &caller;
	open_end(x, listening ? farm : node, listening);
	read_all(x);
	pass_bytes(x, bytes, size);
	if (tls_link_is_open(x->link))
		abort();
	tls_link_free(x->link);
}

static void read_certificate(const uint8_t *bytes, size_t size)
{
	struct tls_peer p;
	struct error e;
	X509 *cert = d2i_X509(NULL, &bytes, (long)size);
	if (cert && tls_read_peer(cert, &p, &e) == 0 && (!tls_name_is_valid(p.name) || p.role == TLS_NO_ROLE))
		abort();
	X509_free(cert);
	ERR_clear_error();
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	make_folders();
	if (!size)
		return 0;
	unsigned kind = *bytes++;
	size--;
	switch ((enum input_kind)(kind % INPUT_KINDS)) {
	case TO_LISTENER:
	case TO_CALLER:
		send_alone(bytes, size, kind % INPUT_KINDS == TO_LISTENER);
		break;
	case CHANGE_CALLER:
	case CHANGE_LISTENER:
		run_conversation(bytes, size, kind % INPUT_KINDS == CHANGE_CALLER ? &caller : &listener,
				 kind / INPUT_KINDS % 8 == 1 ? stranger : node);
		break;
	case RECORDS:
		send_records(bytes, size);
		break;
	default:
		read_certificate(bytes, size);
	}
	return 0;
}

/* ---- seeds ---- */

static void write_seed(enum input_kind kind, const void *bytes, size_t size)
{
	static uint8_t seed_bytes[1 << 16];
	seed_bytes[0] = (uint8_t)kind;
	memcpy(seed_bytes + 1, bytes, size);
	seed_write_file("tls", kind, seed_bytes, size + 1);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	(void)argc;
	(void)argv;
	if (!seeds_are_requested())
		return 0;
	const unsigned char *bytes;
	char path[256];
	make_folders();
	open_end(&caller, node, false);
	open_end(&listener, farm, true);
	read_all(&caller);
	size_t size = tls_link_output(caller.link, &bytes);
	write_seed(TO_LISTENER, bytes, size);
	write_seed(RECORDS, bytes, size);
	carry_output(&caller, &listener, NULL);
	size = tls_link_output(listener.link, &bytes);
	write_seed(TO_CALLER, bytes, size);
	write_seed(CHANGE_CALLER, "\0\60\1", 3);
	write_seed(CHANGE_LISTENER, "\1\0\1", 3);
	tls_link_free(caller.link);
	tls_link_free(listener.link);
	snprintf(path, sizeof path, "%s/ours/node/cert.pem", folders_base());
	FILE *f = fopen(path, "r");
	X509 *cert = f ? PEM_read_X509(f, NULL, NULL, NULL) : NULL;
	unsigned char *der = NULL;
	int n = cert ? i2d_X509(cert, &der) : 0;
	if (n > 0)
		write_seed(CERTIFICATE, der, (size_t)n);
	OPENSSL_free(der);
	X509_free(cert);
	if (f)
		fclose(f);
	exit(0);
}
