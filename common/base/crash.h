/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The last message of a program that a signal ends (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT: our fault or a library's,
 * or an assertion): which signal it was and what the thread was doing. The handler neither allocates nor locks.
 */
#ifndef COMMON_BASE_CRASH_H
#define COMMON_BASE_CRASH_H

enum { CRASH_TEXT = 256 };

/* Sets what the calling thread is doing, and for which line of which file (NULL: none). The texts are not copied and
 * must stay valid until the next call. doing NULL: nothing. */
void crash_place(const char *doing, const char *file, int line);

/* "SIGSEGV"; of signals that are not listed above SIGKILL is "SIGKILL", others are "a signal". */
const char *crash_signal_name(int number);

/* last_words is called on the thread that received the signal, with a text such as "SIGABRT while building the
 * scene: scene.xml:12". When it returns, the signal takes its default action. Call once, before threads are started. */
void crash_catch(void (*last_words)(int number, const char *text));

/* For each further thread: also handles a signal caused by a stack overflow. */
void crash_thread(void);

/* The same for a command-line program: prints its name, the text, and "it is a fault of the program or of a library"
 * on stderr, then exits with 1. */
void crash_exit(const char *program);

#endif
