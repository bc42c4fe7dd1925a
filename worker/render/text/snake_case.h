/* SPDX-License-Identifier: Apache-2.0 */
/* Converts Mitsuba 0.6's camelCase names to the spelling of 3.x. Pure; any thread. */
#ifndef WORKER_RENDER_TEXT_SNAKE_CASE_H
#define WORKER_RENDER_TEXT_SNAKE_CASE_H

/* toWorld -> to_world, intIOR -> int_ior. out holds 2 * strlen(name) + 1 bytes. */
void snake_case_from_camel(const char *name, char *out);

#endif
