/* Joints that only push (unilateral contacts): the state of each contact, and its constraint row. While a contact is open, its row
 * is absent: the maps do not couple the row with others, and its multiplier is 0. */
#ifndef TR_UNILATERAL_H
#define TR_UNILATERAL_H
#include "base/accessors.h"

/* in units of energy over length: a smaller contact force is round-off, even if it is the largest contact force */
#define UNLOADED 1e-12
#define OPEN_FORCE 1e-140 /* N: a smaller contact force is zero; the contact equations regularise square roots at zero */

static inline const tr_unilateral *tr_unilateral_of(const tr_sim *s, int c) { return s->k->unilateral + c; }

/* Record of contact c in the block. */
static inline tr_touch *tr_touch_of(const tr_sim *s, int c) { return (tr_touch *)TR_A(s, touch) + c; }

static inline int tr_is_contact_open(const tr_sim *s, int c) { return !tr_is_pressed(s, tr_unilateral_of(s, c)->stop); }
static inline void tr_set_contact(tr_sim *s, int c, int closed) { *tr_stop_flag(s, tr_unilateral_of(s, c)->stop) = closed ? TR_STOP_PRESSED : TR_STOP_OPEN; }

/* Whether the parts of contact c cannot touch: its pin has left the slot. */
static inline int tr_is_contact_away(const tr_sim *s, int c) {
  const int inside = tr_unilateral_of(s, c)->inside;
  return inside >= 0 && !tr_is_pressed(s, inside);
}

/* Whether contact c is open, but touches without load: closed contacts keep its gap 0. */
static inline int tr_is_contact_unloaded(const tr_sim *s, int c) { return tr_is_contact_open(s, c) && tr_touch_of(s, c)->unloaded > 0.0; }

/* The contact whose flag `inside` has the index `stop`; −1: none. */
static inline int tr_contact_of_mouth(const tr_sim *s, int stop) {
  for (int c = 0; c < s->k->nunilateral; ++c)
    if (tr_unilateral_of(s, c)->inside == stop) return c;
  return -1;
}

/* The contact whose own flag has the index `stop`; −1: the flag belongs to an end stop or a latch. */
static inline int tr_contact_of_stop(const tr_sim *s, int stop) {
  for (int c = 0; c < s->k->nunilateral; ++c)
    if (tr_unilateral_of(s, c)->stop == stop) return c;
  return -1;
}

/* Index of the row of contact c among the active rows, which include all rows of contacts. */
static inline int tr_active_row(const tr_sim *s, int c) {
  int i = 0;
  while (i < s->k->active - 1 && s->k->active_rows[i] != tr_unilateral_of(s, c)->row) ++i;
  return i;
}

/* Row of contact c as the kernel wrote it: S (active), Se (neta), g0. */
static inline double *tr_raw_row(const tr_sim *s, int c) { return TR_A(s, raw_rows) + (size_t)c * (s->k->active + s->k->neta + 1); }

/* Normal force of contact c at the present solution, N. */
static inline double tr_normal_force(const tr_sim *s, int c) { return TR_A(s, z)[tr_active_row(s, c)]; }

/* Unit of normal forces, N. */
static inline double tr_force_unit(const tr_sim *s) { return s->set.energy / s->set.length; }

/* Contact force, N, below which a contact carries only round-off. */
static inline double tr_unloaded_force(const tr_sim *s) { return fmax(OPEN_FORCE, UNLOADED * tr_force_unit(s)); }
#endif
