/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Two files cannot be replaced at once. hslt-ca therefore writes the next certificate and the next key beside the old
 * ones, then renames the key, and then the certificate (authority.c). If the power fails in between, key.pem is the key
 * of the next certificate, which still has the suffix, and that certificate is used. If neither certificate matches the
 * key, the error is about the one without the suffix.
 */
#include "common/net/key_pair.h"

#include <openssl/err.h>
#include <stdbool.h>
#include <stdio.h>

/* Loads the certificate before the key, because OpenSSL drops a key that does not match a certificate loaded later. */
static bool use_key_and_cert(SSL_CTX *context, const char *key, const char *cert)
{
	return SSL_CTX_use_certificate_chain_file(context, cert) == 1 &&
	       SSL_CTX_use_PrivateKey_file(context, key, SSL_FILETYPE_PEM) == 1 &&
	       SSL_CTX_check_private_key(context) == 1;
}

const char *key_pair_load(SSL_CTX *context, const char *key, const char *cert)
{
	char next[4096 + sizeof KEY_PAIR_NEXT];
	if (SSL_CTX_use_PrivateKey_file(context, key, SSL_FILETYPE_PEM) != 1)
		return key;
	if (SSL_CTX_use_certificate_chain_file(context, cert) == 1 && SSL_CTX_check_private_key(context) == 1)
		return NULL;
	snprintf(next, sizeof next, "%s" KEY_PAIR_NEXT, cert);
	ERR_set_mark();
	bool used = use_key_and_cert(context, key, next);
	ERR_pop_to_mark();
	return used ? NULL : cert;
}
