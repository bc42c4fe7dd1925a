/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The client's side of the protocol (hslt-submit, hslt-job): Hello, then requests and answers, one at a time, with an
 * event loop of its own. One thread. Functions return 0 or -errno with a sentence.
 */
#ifndef COMMON_NET_CLIENT_H
#define COMMON_NET_CLIENT_H

#include "common/base/buf.h"
#include "common/net/conn.h"

struct client;

enum { CLIENT_NAME_BYTES = 240 };

/* A received message, which client_message_fini frees. */
struct client_message {
	struct envelope envelope;
	struct buf payload;
};

/* Connects and exchanges Hello. tls: the folder with the certificate (tls.h); NULL or "": plaintext. Returns
 * -ECONNREFUSED if no coordinator answers, -EPROTO if the coordinator refuses Hello, -EACCES if one side does not
 * accept the other's certificate or only one side uses TLS, -EKEYEXPIRED if the date of a certificate is the reason,
 * -EPERM or -EIO if the own folder is unusable. */
int client_open(struct client **out, const char *host_port, const char *tls, bool insecure, const char *name,
		struct error *e);
void client_close(struct client *cl);
/* Prints on stderr which of the own certificates expire soon, and the note that the coordinator sent with its answer to
 * Hello. */
void client_print_notes(const struct client *cl, const char *program);

/* Sends a message and waits until the kernel has taken it. */
int client_send(struct client *cl, const Farm__Envelope *m, const void *payload, size_t size, struct error *e);
/* Waits for the next message. Returns -ETIMEDOUT after `seconds` without any message, heartbeats included (negative:
 * waits for ever), -ECONNRESET if the connection is lost, -EPROTO if the coordinator reports a fault. */
int client_receive(struct client *cl, double seconds, struct client_message *m, struct error *e);
/* Sends a message and waits for an answer of the kind `expected`; -EPROTO for any other answer. */
int client_call(struct client *cl, const Farm__Envelope *m, Farm__Envelope__BodyCase expected,
		struct client_message *answer, struct error *e);
void client_message_fini(struct client_message *m);

/* Fetches a job's result or log chunk by chunk into a temporary file, then renames it. If the coordinator drops the
 * fetch on the way, in favour of other clients, begins again up to four times and says so on stderr. Returns -EIO for
 * an error of the local file, -EAGAIN if the fetch was dropped each time. */
int client_fetch(struct client *cl, uint64_t job, Farm__What what, const char *path, struct error *e);
/* Like client_fetch, for a preview. The name of the job's final image stays free: if `path` has that name, or is a link
 * to it, the preview is written under client_preview_name() instead, and *is_renamed is true. */
int client_fetch_preview(struct client *cl, uint64_t job, const char *path, bool *is_renamed, struct error *e);
/* Makes room.preview.exr of room.exr; -ENAMETOOLONG if `size` is too small. */
int client_preview_name(const char *path, char *name, size_t size, struct error *e);
/* Like client_fetch, into the current folder under the last part of the name of the job's image, which is returned; a
 * preview has `.preview` before the extension. That name was chosen by whoever submitted the job, so existing files are
 * not replaced: -EEXIST if one of that name exists, or if the name is unsafe (hidden, or like an option). */
int client_fetch_to_current_folder(struct client *cl, uint64_t job, Farm__What what, char name[CLIENT_NAME_BYTES],
				   struct error *e);
/* Writes a job's log to a descriptor, once all of it has arrived. */
int client_fetch_log(struct client *cl, uint64_t job, int fd, struct error *e);

/* Returns the exit code for an error of the functions above: 75 if the coordinator cannot be reached, 2 for a usage
 * error, 6 if the request was refused, otherwise 1. */
int client_exit_code(int rc);
/* Turns an error of a local file into -EIO, so that client_exit_code does not take it for an error of the farm. 0 stays
 * 0. */
int client_local_error(int rc);

#endif
