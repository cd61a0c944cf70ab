/* Functions that access parts of a simulation's block: pairs and their modes, signals, end stops, multipliers, units. Two functions
 * cancel a run. */
#ifndef TR_ACCESSORS_H
#define TR_ACCESSORS_H
#include <math.h>
#include <string.h>
#include "base/map_block_offsets.h"
#include "base/simulation.h"
#include "base/tolerances.h"
#include "base/vectors.h"
#include "tr_tables.h"

/* Number of states of a step at which reserves are recorded: all stages, and the end of the step. */
enum { TR_RECORDS = TR_STAGES + 1 };

/* Kinds of equation that determine a multiplier. LAW: the friction law. REST: zero acceleration of a held pair. FREE: friction
 * zero, because loops prescribe the motion. SHARE: a share of the load of a group (pairs at rest among which statics does not
 * determine the load). STORED: a stored load. FULL: the capacity of a held pair that yields. */
enum { TR_ROW_LAW, TR_ROW_REST, TR_ROW_FREE, TR_ROW_SHARE, TR_ROW_STORED, TR_ROW_FULL };

/* Source of the loads that a group at rest stores. NONE: the group stores no loads, and shares its load by the sharing rule. CREEP:
 * a creep minimisation. PLACED: the present multipliers. */
enum { TR_STORES_NONE, TR_STORES_CREEP, TR_STORES_PLACED };

/* Leader of a group: the share of each other multiplier refers to the leader's share. Fields: index of the leader's multiplier, its
 * pair, and the offset in `dhold` of the derivative of the pair's capacity. */
typedef struct tr_leader {
  int multiplier, pair, dhold;
} tr_leader;

/* Data of a pair that is in the proportional zone of its law, stored until the pair leaves the zone. */
typedef struct tr_zone {
  int inside;
  int ncontacts;       /* number of contacts in `before` */
  double entered;      /* time of entry, s */
  double direction[3]; /* sliding direction at the entry */
  double reversal;     /* time of a reversal inside the zone, s; NaN: no reversal */
  tr_contact before[TR_EVENT_CONTACTS]; /* contacts at the entry */
} tr_zone;

/* Last value of a column with post-processing (tr_post). For an angle, the record also holds the time and the rate at the end of
 * the last step. */
typedef struct tr_memory {
  int known, rated;
  double value, t, rate;
} tr_memory;

#define ASK_AFTER 1e7 /* multiplications between two queries of the host: a few milliseconds, even on slow machines */

/* Work of a bounded step, in evaluations and iterations. Maps formed outside evaluations count as evaluations. Each solution in a
 * mode decision counts as one iteration. */
static inline long tr_counted_evaluations(const tr_sim *s) { return s->stats.rhs_evaluations + s->stats.maps; }
static inline long tr_counted_iterations(const tr_sim *s) { return s->stats.newton_iterations + s->stats.solutions; }

/* Whether a bounded step has used up its evaluations or iterations. If so, marks the run as cancelled. */
static inline int tr_is_at_bound(tr_sim *s) {
  if (!s->bound.evaluations || (tr_counted_evaluations(s) < s->bound.evaluations && tr_counted_iterations(s) < s->bound.iterations)) return 0;
  return s->ask.cancelled = 1;
}

/* Add `work` to the count of multiplications. Every ASK_AFTER multiplications, ask the host whether to cancel. Returns whether the
 * bound or the host has cancelled the run. */
static inline int tr_is_cancelled(tr_sim *s, double work) {
  if (tr_is_at_bound(s)) return 1;
  if (!s->ask.host || s->ask.cancelled || (s->ask.work += work) < ASK_AFTER) return s->ask.cancelled;
  s->ask.work = 0.0;
  return s->ask.cancelled = s->ask.host();
}

static inline const tr_pair *tr_pair_of(const tr_sim *s, int i) { return s->k->pair + i; }

/* Number of doubles in z. z contains the multipliers [λ active | η]; with recursive friction, the loads N follow the
 * multipliers. */
static inline int tr_z_length(const tr_sim *s) { return s->k->active + s->k->neta + (s->k->begin ? s->k->nn : 0); }
static inline double *tr_stored_loads(const tr_sim *s) { return TR_A(s, z) + s->k->active + s->k->neta; }

static inline const tr_method *tr_method_of(const tr_sim *s) { return tr_methods + s->step.method; }

static inline int tr_is_auto(const tr_sim *s) { return tr_methods[s->set.method].kind == TR_CHOSEN; }

/* The explicit method with which method auto starts. */
static inline int tr_auto_explicit_method(const tr_sim *s) { return s->set.rtol > TR_AUTO_LOOSE_ABOVE ? TR_AUTO_LOOSE : TR_AUTO_TIGHT; }

/* Parts of the signals x. */
static inline tr_moment *tr_moment_of(const tr_sim *s) { return (tr_moment *)TR_A(s, x); }
static inline tr_signal *tr_signal_of(const tr_sim *s, int table) { return (tr_signal *)(tr_moment_of(s) + 1) + table; }
static inline double *tr_stop_flag(const tr_sim *s, int stop) { return (double *)tr_signal_of(s, s->k->ntables) + stop; }
static inline tr_mode *tr_mode_of(const tr_sim *s, int i) { return (tr_mode *)tr_stop_flag(s, s->k->nstops) + i; }

/* Whether a stop is the hook of a latch. Hooks have their own event kinds. */
static inline int tr_is_hook(const tr_sim *s, int stop) { return stop >= s->k->nstops - s->k->nlatches; }

/* Whether an end stop is engaged, a latch's hook is down, or a contact is closed. The flag of a ratchet's hook is the number of the
 * engaged tooth, counted from 1. */
static inline int tr_is_pressed(const tr_sim *s, int stop) { return (int)*tr_stop_flag(s, stop) >= TR_STOP_PRESSED; }

/* Depth of each stop at y, m or rad; for hooks, see ``recursion/latch_forces.py``. `pushes` (null pointer: not requested) receives,
 * for an end stop, the factor of the elastic force, which is 0 at release. For a hook, `pushes` receives the excess of the hook's
 * signal over the release value. */
static inline void tr_stop_depths_and_pushes(const tr_sim *s, const double *y, double *depth, double *pushes) {
  const int n = s->k->nstops;
  double both[2 * n + s->k->npositions + 1];
  if (n) s->k->events(TR_A(s, x), y, TR_A(s, c) + s->k->c_events, both);
  for (int i = 0; i < n; ++i) depth[i] = both[i];
  for (int i = 0; i < n && pushes; ++i) pushes[i] = both[n + i];
}

static inline void tr_stop_depths(const tr_sim *s, const double *y, double *depth) { tr_stop_depths_and_pushes(s, y, depth, 0); }

/* The stop whose depth shows whether this hook's latch is pressed. */
static inline int tr_stop_behind_hook(const tr_sim *s, int hook) { return s->k->presses[hook - (s->k->nstops - s->k->nlatches)]; }
static inline int tr_mode_flag(const tr_mode *m) { return (int)m->flag; }
/* Whether a pair is not stuck. For a law with a kink: whether the pair is saturated. */
static inline int tr_is_sliding(const tr_sim *s, int i) { return tr_mode_flag(tr_mode_of(s, i)) != TR_STUCK; }
/* Index of the joint that only pushes and has friction pair i; −1: none. */
static inline int tr_unilateral_of_pair(const tr_sim *s, int i) {
  for (int c = 0; c < s->k->nunilateral; ++c)
    if (s->k->unilateral[c].pair == i) return c;
  return -1;
}

/* Whether pair i belongs to a joint that only pushes and is open. The pair then has no friction and no mode. */
static inline int tr_is_pair_open(const tr_sim *s, int i) {
  const int c = tr_unilateral_of_pair(s, i);
  return c >= 0 && !tr_is_pressed(s, s->k->unilateral[c].stop);
}
static inline int tr_kind_of(const tr_sim *s, int i) { return tr_is_pair_open(s, i) ? TR_KIND_SMOOTH : tr_pair_of(s, i)->kind; }
static inline int tr_is_set_valued(const tr_sim *s, int i) { return tr_kind_of(s, i) == TR_KIND_SET; }
static inline int tr_has_kink_at_rest(const tr_sim *s, int i) { return tr_pair_of(s, i)->kind == TR_KIND_TURN; }
static inline int tr_is_stuck(const tr_sim *s, int i) { return tr_is_set_valued(s, i) && !tr_is_sliding(s, i); }

/* tr_save_modes copies the modes of all pairs to `kept` (nsliders); tr_restore_modes copies them back. */
static inline void tr_save_modes(const tr_sim *s, tr_mode *kept) { memcpy(kept, tr_mode_of(s, 0), sizeof(tr_mode) * s->k->nsliders); }
static inline void tr_restore_modes(tr_sim *s, const tr_mode *kept) { memcpy(tr_mode_of(s, 0), kept, sizeof(tr_mode) * s->k->nsliders); }

static inline tr_sliding *tr_sliding_of(const tr_sim *s, int i) { return (tr_sliding *)TR_A(s, sliding) + i; }
static inline tr_hold *tr_hold_of(const tr_sim *s, int i) { return (tr_hold *)TR_A(s, hold) + i; }
static inline tr_zone *tr_zone_of(const tr_sim *s, int i) { return (tr_zone *)TR_A(s, zone) + i; }
static inline int *tr_row_kinds(const tr_sim *s) { return (int *)TR_A(s, row_kind); }
static inline int *tr_pair_classes(const tr_sim *s) { return (int *)TR_A(s, pair_class); }
static inline int *tr_stopping_marks(const tr_sim *s) { return (int *)TR_A(s, stopping); }
static inline tr_leader *tr_leaders(const tr_sim *s) { return (tr_leader *)TR_A(s, leaders); }

/* Number of active rows that constrain loops. The rows of light freedoms follow the rows of loops (theory, "Light bodies"). */
static inline int tr_loop_rows(const tr_sim *s) { return s->k->active - s->k->nlight; }

/* tr_row_unit: unit of a constraint row's residual; 1 for rotation (rad), the length scale for translation. tr_rate_unit: unit of a
 * rate, divided by the rate scale. */
static inline double tr_row_unit(const tr_sim *s, int row) { return s->k->row_kind[row] == TR_CONSTRAINS_TURNING ? 1.0 : s->set.length; }
static inline double tr_rate_unit(const tr_sim *s, int rate) { return s->k->vkind[rate] == TR_COORDINATE_LENGTH ? s->set.length : 1.0; }

/* Record of a table. `tables` begins with the offsets of all records. */
static inline double *tr_table_of(const tr_sim *s, int table) { return TR_A(s, tables) + (int)TR_A(s, tables)[table]; }

/* relative to max(time, 1 s): two times that differ by less count as equal; their difference is round-off of many steps */
#define SAME_TIME 1e-13
static inline double tr_time_tolerance(double t) { return SAME_TIME * fmax(1.0, fabs(t)); }

/* Unit of sliding speed, m/s. */
static inline double tr_speed_unit(const tr_sim *s) { return s->set.length * s->set.rate; }

/* Number of doubles in a state, including integrals and padding. */
static inline int tr_state_width(const tr_sim *s) { return TR_PAD(s->ny + s->nworks + TR_AUDIT_SUMS); }

/* Number of pairs and stops. An event of a pair has the pair's index; an event of a stop has nsliders + the stop's index. */
static inline int tr_watched_count(const tr_sim *s) { return s->k->nsliders + s->k->nstops; }

/* Rates of a pair in the current state. Requires maps. */
static const double *tr_pair_rates(const tr_sim *s, int i) {
  TR_NEED(s, TR_HAS_MAPS);
  return map_rates(s->k, TR_A(s, maps)) + tr_pair_of(s, i)->rate0;
}

/* Whether i is an element of `rest` (n). */
static int tr_contains(const int *rest, int n, int i) {
  for (int q = 0; q < n; ++q)
    if (rest[q] == i) return 1;
  return 0;
}
#endif
