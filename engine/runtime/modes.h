/* Modes of sliding pairs: where they are kept and what they mean. */
#ifndef TR_MODES_H
#define TR_MODES_H
#include <math.h>
#include "tr.h"

/* Code that runs at events, at the start or after failures, compiled for size: inlined like the stepping loop it would take most of the
 * compiler's time. */
#ifdef __clang__
#define TR_RARE _Pragma("clang attribute push(__attribute__((minsize, noinline)), apply_to = function)")
#define TR_OFTEN _Pragma("clang attribute pop")
#else
#define TR_RARE
#define TR_OFTEN
#endif

/* First number of a pair's mode. Law with a kink: 0 proportional, 1 saturated; with one at rest only (|v|): always 0, the direction
 * changes. Set-valued law: */
enum { TR_STUCK = 0, TR_SLIPS = 1, TR_CONE = 2 };
enum { TR_KIND_SMOOTH = 0, TR_KIND_KINK = 1, TR_KIND_SET = 2, TR_KIND_TURN = 3 };
/* How the multiplier of a freedom is found: by its law; by the acceleration of a pair held at rest; zero, where the motion is
 * prescribed anyway; as its share of what a group of pairs holds together. */
enum { TR_ROW_LAW = 0, TR_ROW_STILL = 1, TR_ROW_FREE = 2, TR_ROW_SHARE = 3 };

#define TR_SLIDER 10
static inline const int *tr_slider(const tr_sim *s, int i) { return s->k->slider + TR_SLIDER * i; }
static inline double *tr_mode(const tr_sim *s, int slider) {
  const tr_kernel *k = s->k;
  return TR_A(s, x) + 2 + TR_TABLE * k->ntables + k->nstops + TR_MODE * slider;
}
static inline double *tr_stop_flag(const tr_sim *s, int stop) { return TR_A(s, x) + 2 + TR_TABLE * s->k->ntables + stop; }
static inline int tr_is_set(const tr_sim *s, int i) { return tr_slider(s, i)[5] == TR_KIND_SET; }
static inline int tr_is_turn(const tr_sim *s, int i) { return tr_slider(s, i)[5] == TR_KIND_TURN; }
static inline int tr_is_stuck(const tr_sim *s, int i) { return tr_is_set(s, i) && tr_mode(s, i)[0] < 0.5; }
/* Unit of sliding speed, m/s. */
static inline double tr_speed_unit(const tr_sim *s) { return s->length * s->rate; }
#endif
