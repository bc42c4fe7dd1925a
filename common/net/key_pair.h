/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMMON_NET_KEY_PAIR_H
#define COMMON_NET_KEY_PAIR_H

#include <openssl/ssl.h>

/* What a certificate is called before it replaces the one whose name is before it. */
#define KEY_PAIR_NEXT ".next"

/* Uses the key and the certificate in these files, or the next certificate if the key is that one's. Returns the path
 * of the file that is to blame, NULL: neither; OpenSSL's queue has the reason. */
const char *key_pair_use(SSL_CTX *context, const char *key, const char *cert);

#endif
