/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A pair of two files cannot be replaced at once. hslt-ca writes the next certificate and the next key beside the old
 * ones, gives the key its name, and then the certificate (authority.c). If power is lost in between, the key is the
 * next certificate's, which is still under its own name: then that is used. Without a certificate for the key, what is
 * wrong with the first one is the failure.
 */
#include "common/net/key_pair.h"

#include <openssl/err.h>
#include <stdbool.h>
#include <stdio.h>

/* The certificate first: OpenSSL drops a key that does not match a later certificate. */
static bool use_both(SSL_CTX *context, const char *key, const char *cert)
{
	return SSL_CTX_use_certificate_chain_file(context, cert) == 1 &&
	       SSL_CTX_use_PrivateKey_file(context, key, SSL_FILETYPE_PEM) == 1 &&
	       SSL_CTX_check_private_key(context) == 1;
}

const char *key_pair_use(SSL_CTX *context, const char *key, const char *cert)
{
	char next[4096 + sizeof KEY_PAIR_NEXT];
	if (SSL_CTX_use_PrivateKey_file(context, key, SSL_FILETYPE_PEM) != 1)
		return key;
	if (SSL_CTX_use_certificate_chain_file(context, cert) == 1 && SSL_CTX_check_private_key(context) == 1)
		return NULL;
	snprintf(next, sizeof next, "%s" KEY_PAIR_NEXT, cert);
	ERR_set_mark();
	bool used = use_both(context, key, next);
	ERR_pop_to_mark();
	return used ? NULL : cert;
}
