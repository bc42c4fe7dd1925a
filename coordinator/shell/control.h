/* SPDX-License-Identifier: Apache-2.0 */
/* What clients want of jobs that are there: cancel, hold, release, priority. The loop's thread. */
#ifndef COORDINATOR_SHELL_CONTROL_H
#define COORDINATOR_SHELL_CONTROL_H

/* The sentence for the status. */
const char *control_held_by(const char *who, char text[256]);

#endif
