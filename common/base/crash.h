/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The last words of a program that a signal ends (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT: a fault of ours or of a
 * library, an assertion): which signal, and what its thread was doing. What is said meanwhile uses no memory but its
 * own and no lock.
 */
#ifndef COMMON_BASE_CRASH_H
#define COMMON_BASE_CRASH_H

#include <stddef.h>

enum { CRASH_TEXT = 256 };

/* What the calling thread does from now on, at which line of which file (NULL: of none). The texts are not copied: they
 * stay until another place is said. doing NULL: nothing. */
void crash_place(const char *doing, const char *file, int line);

/* "SIGSEGV"; "signal 9" of those that are not listed above is "SIGKILL", of others "a signal". */
const char *crash_signal_name(int number);

/* last_words is called on the thread that the signal hit with a text like "SIGABRT while building the scene:
 * scene.xml:12"; when it returns the program ends as it would have without. Once, before there are threads. */
void crash_catch(void (*last_words)(int number, const char *text));

/* For threads but the first: a signal for want of stack is handled, too. */
void crash_thread(void);

/* The same for a program: its name, the text, "it is a fault of the program or of a library" on stderr, then exit
 * code 1. */
void crash_exit(const char *program);

#endif
