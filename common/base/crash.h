/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The last message of a program that SIGSEGV, SIGBUS, SIGFPE, SIGILL or SIGABRT ends (a fault of the program or of a
 * library, or a failed assertion): which signal it was and what the thread was doing. The handler neither allocates nor
 * locks.
 */
#ifndef COMMON_BASE_CRASH_H
#define COMMON_BASE_CRASH_H

enum { CRASH_TEXT_MAX = 256 };

/* Records what the calling thread is doing ("building the scene"; NULL: nothing worth reporting), and for which line of
 * which file (NULL: none). The texts are not copied and must stay valid until the next call. */
void crash_set_context(const char *activity, const char *file, int line);

/* Returns the name of one of the signals listed above or of SIGKILL, such as "SIGSEGV"; "a signal" for any other. */
const char *crash_signal_name(int number);

/* on_crash is called on the thread that received the signal, with a text such as "SIGABRT while building the
 * scene: scene.xml:12". When it returns, the signal takes its default action. Call once, before threads are started. */
void crash_install_handler(void (*on_crash)(int number, const char *text));

/* Call at the start of each further thread: gives the thread a stack of its own for the handler, so that stack
 * overflows are reported, and unblocks the signals. crash_install_handler does this for the calling thread. */
void crash_init_thread(void);

/* Like crash_install_handler, for a command-line program: prints its name, the text, and that this is a fault of the
 * program or of a library on stderr, then exits with 1. */
void crash_install_exit_handler(const char *program);

#endif
