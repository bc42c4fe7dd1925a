/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The client's side of the protocol (hslt-submit, hslt-job): hello, then requests and answers, one at a time, with an
 * event loop of its own. One thread.
 */
#ifndef COMMON_NET_CLIENT_H
#define COMMON_NET_CLIENT_H

#include "common/base/buf.h"
#include "common/net/conn.h"

struct client;

enum { CLIENT_NAME_BYTES = 240 };

struct client_message { /* fini with client_message_fini */
	struct envelope envelope;
	struct buf payload;
};

/* Connects and exchanges hello. tls: a folder (tls.h); NULL or "" means plaintext. -ECONNREFUSED: nobody answers (or
 * not a coordinator), -EPROTO: hello is refused, -EACCES: one side does not accept the other's certificate, or only
 * one uses TLS, -EKEYEXPIRED: the same because of its date, -EPERM or -EIO: our own folder is unusable. */
int client_open(struct client **cl, const char *host_port, const char *tls, bool insecure, const char *name,
		struct error *e);
void client_close(struct client *cl);
/* Prints on stderr which certificates expire soon, and what the coordinator says about its own. */
void client_print_notes(const struct client *cl, const char *program);

/* Sends, and waits until the kernel has it. */
int client_send(struct client *cl, const Farm__Envelope *m, const void *payload, size_t size, struct error *e);
/* The next message. -ETIMEDOUT after `seconds` without any message, heartbeats included (< 0: waits forever),
 * -ECONNRESET if the connection is lost, -EPROTO if the coordinator reports a fault. */
int client_wait(struct client *cl, double seconds, struct client_message *m, struct error *e);
/* Sends, and waits for a message of this kind; any other is -EPROTO. */
int client_call(struct client *cl, const Farm__Envelope *m, Farm__Envelope__BodyCase want,
		struct client_message *answer, struct error *e);
void client_message_fini(struct client_message *m);

/* Fetches a job's result or log chunk by chunk into a temporary file, then renames it. If the coordinator drops the
 * fetch on the way, in favour of others, it begins again up to four times, and says so on stderr. -EIO: an error of the
 * local file; -EAGAIN: it was dropped each time. */
int client_fetch(struct client *cl, uint64_t job, Farm__What what, const char *path, struct error *e);
/* A preview. The name that hslt-submit was given stays free for the image: if `path` has it, or leads there by a link,
 * the file is that of client_preview_name. *kept: whether that happened. */
int client_fetch_preview(struct client *cl, uint64_t job, const char *path, bool *kept, struct error *e);
/* room.preview.exr of room.exr; -ENAMETOOLONG. */
int client_preview_name(const char *path, char *name, size_t size, struct error *e);
/* The same as client_fetch into the current folder, under the last part of the name that hslt-submit was given, for a
 * preview with
 * `.preview` before its extension. Because that name came over the wire, -EEXIST if a file of that name exists, or if
 * the name is unsafe (hidden, or like an option). */
int client_fetch_here(struct client *cl, uint64_t job, Farm__What what, char name[CLIENT_NAME_BYTES], struct error *e);
/* A job's log to a stream, which gets nothing before the last byte has arrived. */
int client_fetch_log(struct client *cl, uint64_t job, int fd, struct error *e);

/* The exit code for an error of the functions above: 75 unreachable, 6 refused, otherwise 1. */
int client_exit_code(int rc);
/* Turns an error of local files into -EIO, so that it is not taken for one of the farm, whatever its number. 0 stays
 * 0. */
int client_local(int rc);

#endif
