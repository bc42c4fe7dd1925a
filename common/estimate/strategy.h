/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Statistics of the mutation strategies as text: names of the counters, a table, lines for the image's header, and
 * notes on the image that follow from the counters. Pure; any thread.
 */
#ifndef COMMON_ESTIMATE_STRATEGY_H
#define COMMON_ESTIMATE_STRATEGY_H

#include "common/film/canvas.h"

/* Returns "proposed", "accepted", ..., and for the reasons of failures "outside", "missed", ... */
const char *strategy_counter_name(enum strategy_counter c);

/* Prints one row per strategy: proposals, accepted, rays per proposal, walks, iterations per walk, reverse walks,
 * failures in % of the proposals. Lines end with '\n'; empty if the plan has no mixture or nothing was counted. Text
 * that does not fit is cut; STRATEGY_TABLE_MAX bytes are enough. */
enum { STRATEGY_TABLE_MAX = 4096 };
void strategy_print_table(const char *mixture, const struct canvas_counts *n, char *text, size_t size);

/* Prints the counters of each strategy, one line per strategy, for the image's header. The text is empty if the plan
 * has no mixture. */
void strategy_print_lines(const char *mixture, const struct canvas_counts *n, char *text, size_t size);

/* Prints a note on the image in one line: that it is black, that contributions were left out, that "3 of 8,192 chain
 * epochs accepted nothing (1,024 chains); longest run: 5,210 rejections". Empty if there is nothing to note. */
enum { STRATEGY_NOTE_MAX = 1024 };
void strategy_print_note(const struct plan *p, const struct canvas_counts *n, bool black, char *text, size_t size);
/* Appends that this share of the energy is missing in the image, because its paths are too long for the chains; does
 * nothing up to 0.1 %. */
void strategy_append_overlong(double share, char *note, size_t size);

#endif
