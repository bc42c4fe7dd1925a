/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Statistics of the mutation strategies, for people and programs: names of the counters, a table, and notes on the
 * image that the counters justify. Pure; any thread.
 */
#ifndef COMMON_ESTIMATE_STRATEGY_H
#define COMMON_ESTIMATE_STRATEGY_H

#include "common/film/canvas.h"

/* "proposed", "accepted", ... and the reasons of failures: "outside", "missed", ... */
const char *strategy_counter_name(enum strategy_counter c);

/* One row per strategy: proposals, accepted, rays per proposal, walks, iterations per walk, reverse walks, failures
 * in % of the proposals. Lines end with '\n'; empty if the plan has no mixture or nothing was counted. Text that
 * does not fit is cut; STRATEGY_TABLE bytes are enough. */
enum { STRATEGY_TABLE = 4096 };
void strategy_table(const char *mixture, const struct canvas_counts *n, char *text, size_t size);

/* The counters of each strategy, one line per strategy, for the image's header. Empty if the plan has no mixture. */
void strategy_lines(const char *mixture, const struct canvas_counts *n, char *text, size_t size);

/* A note in one line for whoever looks at the image: that it is black, that contributions were left out, that "3 of
 * 8,192 times a chain accepted nothing during a whole epoch (1,024 chains); longest run: 5,210 rejections". Empty:
 * nothing to say. */
enum { STRATEGY_NOTE = 1024 };
void strategy_note(const struct plan *p, const struct canvas_counts *n, bool black, char *text, size_t size);
/* Appends that this share of the energy is missing in the image, because its paths are longer than chains hold;
 * nothing below 0.1 %. */
void strategy_add_beyond(double share, char *note, size_t size);

#endif
