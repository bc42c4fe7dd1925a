/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMMON_NET_KEY_PAIR_H
#define COMMON_NET_KEY_PAIR_H

#include <openssl/ssl.h>

/* The suffix of a certificate's file name until it replaces the certificate without the suffix. */
#define KEY_PAIR_NEXT ".next"

/* Uses the key and the certificate in these files or, if the key does not match the certificate, the next certificate.
 * Returns NULL on success, otherwise the path of the bad file; the reason is in OpenSSL's error queue. */
const char *key_pair_load(SSL_CTX *context, const char *key, const char *cert);

#endif
