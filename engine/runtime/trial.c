/* A trial step: made, brought back onto the manifold, evaluated, searched for events; accepted, refused, or made anew up to its event. */
#include "modes.h"

#define CHATTER_MAX 12          /* events in a row at one time: after that a step is made without looking for more */
#define GROW_FIXED 2.0       /* where fixed steps have been made in parts, the parts grow by this */
#define LEAST_PART 1e-4      /* of a fixed step in which friction cannot be followed (sliding of several components that ends inside
                                it): it is made in parts not smaller than this */
#define LEFT_OVER 1e-10         /* of what is left to the limit: no step leaves so little */
#define CUT_ERROR 1e-2          /* of a step with a larger error the inside is known less well than its end: it is made anew up to its event */
#define CUT_EARLY 0.9           /* of the step: not where the event is behind that */
#define CUT_BEYOND 1.02         /* of the time to the event: by so much such a step reaches beyond it */
#define CUTS_MOST 2             /* such steps at one event */

/* Why the last trial step towards ynew was refused. */
static int tr_fault(const tr_sim *s, double err, const double *ynew) {
  if (err == err) return TR_FAIL_STEP;
  if (s->step.trouble != TR_OK) return s->step.trouble;
  return s->k->neta && tr_finite(s->ny, ynew) ? TR_FAIL_MULTIPLIERS : TR_FAIL_NOT_FINITE;
}

/* A trial step: how long it is, whether it reaches the limit of the call, and what came of it. */
typedef struct tr_trial {
  double h, end;   /* its length and the time of its end, s */
  int last;        /* it ends at the limit */
  double err;      /* its error, 1 at the tolerance; not a number: it is of no use */
  int found, which; /* what a search for events found in it, of which pair or stop, and where */
  double theta;
  int cuts;        /* how often it was made anew up to its event */
  double whole;    /* and how long it was at first; 0: never */
  int corners;     /* how often up to a corner */
} tr_trial;

/* The length of the next trial step: two equal ones rather than a long one and a sliver in front of the limit. */
TR_INLINE tr_trial tr_trial_towards(const tr_sim *s, double limit) {
  const double fixed = s->set.hfixed, left = limit - s->clock.t;
  tr_trial trial = {.theta = 1.0, .which = -1, .found = TR_NO_EVENT};
  trial.h = fixed > 0.0 && !s->k->sets ? fixed : fmin(s->step.h, fixed > 0.0 ? fixed : s->set.hmax);
  trial.last = trial.h >= left * (1.0 - LEFT_OVER);
  if (trial.last) trial.h = left;
  else if (trial.h > 0.5 * left && fixed <= 0.0) trial.h = 0.5 * left;
  trial.end = trial.last ? limit : s->clock.t + trial.h;
  return trial;
}

/* Bring y at time t back onto the manifold, and evaluate ẏ there. 0 when one of them is not possible. */
static inline int tr_evaluated(tr_sim *s, double t, double *y, double *dy) {
  return tr_asks_end(s, TR_ASK_ALL, t, y, dy) || (tr_project(s, t, y) && tr_rhs(s, t, y, dy));
}

/* What becomes of a trial step within the tolerance: it is brought back onto the manifold, evaluated at its end and searched for events. */
TR_INLINE void tr_examine(tr_sim *s, const tr_method *m, tr_trial *trial) {
  const int n = tr_width(s), live = s->ny;
  double *ynew = TR_A(s, ynew), *slope = TR_A(s, K) + m->end * n;
  s->step.t0 = s->clock.t, s->step.size = trial->end - s->clock.t, s->step.have_dense = 0;
  tr_copy(n, TR_A(s, y), TR_A(s, yold));
  if (m->kind == TR_IMPLICIT && s->naudit) tr_works_middle(s, m->rosenbrock);
  if (!tr_finite(live, ynew) || !tr_evaluated(s, trial->end, ynew, slope) || !tr_finite(live, slope))
    trial->err = NAN;
  else if ((trial->err = fmax(trial->err, tr_singular_error(s, m, trial->h))) <= 1.0) {
    s->step.margin_end = NAN;
    if (s->k->sets && tr_leaves_lines(s)) {
      trial->err = NAN;
      return;
    }
    tr_note_end(s);
    const int broken = tr_broken(s, ynew, 0, 0);
    tr_audit_look(s);
    if (s->events.chatter <= CHATTER_MAX) trial->found = tr_find_event(s, &trial->which, &trial->theta);
    if (broken && trial->found == TR_NO_EVENT) {
      if (tr_another_end(s, broken, trial->end, ynew, slope)) tr_audit_look(s);
      else trial->err = NAN;
    }
  }
  if (trial->found == TR_TOO_LARGE || (s->k->sets && s->set.hfixed <= 0.0 && tr_onset_too_fast(s, ynew, trial->h))) trial->err = NAN;
}

/* Make the trial step. TR_OK, or TR_NEED_JACOBIAN. */
TR_INLINE int tr_try(tr_sim *s, const tr_method *m, tr_trial *trial) {
  tr_moment_of(s)->inside = s->clock.t + 0.5 * trial->h;
  s->step.watch = s->set.locate && s->k->nsliders > 0;
  s->step.trouble = TR_OK;
  trial->err = m->kind == TR_IMPLICIT ? tr_step_rosenbrock(s, m->rosenbrock, trial->h) : tr_step_explicit(s, m->explicit, trial->h);
  if (s->clock.status == TR_NEED_JACOBIAN) return TR_NEED_JACOBIAN;
  if (trial->err <= 1.0) tr_examine(s, m, trial);
  s->step.watch = 0;
  return TR_OK;
}

/* An accepted trial step waits to be completed. `most`: by how much the next one may be longer. */
TR_INLINE void tr_accept(tr_sim *s, const tr_method *m, const tr_trial *trial, double most) {
  const tr_kernel *k = s->k;
  const int event = trial->found == TR_FOUND;
  tr_waiting *wait = &s->pending;
  s->stats.steps++;
  tr_strays(s);
  wait->kind = event ? TR_STEP_TO_EVENT : TR_WHOLE_STEP;
  wait->captured = 0;
  wait->theta = trial->theta, wait->which = trial->which, wait->h = fmax(trial->h, trial->whole), wait->cut = trial->last;
  const int missed = trial->cuts && !event; /* the event is later than it seemed: twice in a row it is sought by growing steps */
  if (missed && s->step.missed) wait->h = trial->h;
  s->step.missed = missed;
  wait->t = event ? s->step.t0 + trial->theta * s->step.size : trial->end;
  wait->grow = s->set.hfixed > 0.0 ? GROW_FIXED : tr_grow(s, trial->err, m->order, most);
  if (trial->corners) wait->grow = fmin(wait->grow, 1.0);
  if (event) {
    tr_sharpen_pending(s), tr_integrate_works(s, m);
    return;
  }
  tr_copy(tr_nz(s), TR_A(s, z), TR_A(s, zold));
  if (k->sets) s->friction.capture = tr_ends_sliding(s);
  if (k->nsliders) tr_watch_contacts(s, TR_A(s, K) + m->end * tr_width(s) + k->nq);
  tr_integrate_works(s, m);
  tr_audit_step(s, trial->end, TR_A(s, ynew));
}

/* Go back to the start of the step after a refused trial, for a smaller one: TR_OK, or why there is none. */
TR_INLINE int tr_refuse(tr_sim *s, const tr_method *m, const tr_trial *trial) {
  const double err = trial->err;
  s->stats.rejected++;
  tr_copy(tr_nz(s), TR_A(s, zold), TR_A(s, z));
  tr_forget_extremes(s);
  s->step.h = err == err ? trial->h * tr_factor_of(err, m->order, RETRY_MOST) : SHRINK_MOST * trial->h;
  if (s->k->sets && s->set.hfixed <= 0.0) s->step.h = fmin(s->step.h, tr_onset_step(s, TR_A(s, K) + s->k->nq));
  const int parts = s->set.hfixed > 0.0 && (!s->k->sets || s->step.h < LEAST_PART * s->set.hfixed);
  const int lost = s->step.h <= s->set.hmin + TIME_ROUND_OFF * fabs(s->clock.t);
  return parts || lost ? tr_fault(s, err, TR_A(s, ynew)) : TR_OK;
}

/* Whether a trial step is to be made anew up to the event that was found in it. */
TR_INLINE int tr_is_cut(const tr_sim *s, const tr_trial *trial) {
  if (trial->which < 0 || trial->which >= s->k->nsliders || !tr_is_set(s, trial->which)) return 0;
  if (tr_is_stuck(s, trial->which) && s->friction.shares) return 0; /* Newton's method may come to loads that are shared otherwise */
  return trial->found == TR_FOUND && trial->err > CUT_ERROR && trial->theta < CUT_EARLY && trial->cuts < CUTS_MOST && s->set.hfixed <= 0.0;
}

/* The step anew, up to a little beyond the event that was found in it. Its dense output is known to a lower order than its end; what it is off by
 * moved the times of events by hundreds of tolerances. */
TR_INLINE void tr_step_to_event(tr_sim *s, tr_trial *trial) {
  const double h = CUT_BEYOND * trial->theta * trial->h, whole = fmax(trial->whole, trial->h);
  tr_copy(tr_nz(s), TR_A(s, zold), TR_A(s, z));
  tr_forget_extremes(s);
  *trial = (tr_trial){.h = h, .end = s->clock.t + h, .theta = 1.0, .which = -1, .found = TR_NO_EVENT, .cuts = trial->cuts + 1, .whole = whole};
}

/* Whether an acceptable step is to be made anew up to a corner inside it. */
TR_INLINE int tr_ends_at_corner(tr_sim *s, tr_trial *trial) {
  if (!s->k->nstops || trial->corners >= CORNER_CUTS) return 0;
  const double theta = tr_first_corner(s, trial->found == TR_FOUND ? trial->theta : 1.0);
  if (theta >= 1.0) return 0;
  const double whole = fmax(trial->whole, trial->h);
  tr_copy(tr_nz(s), TR_A(s, zold), TR_A(s, z));
  tr_forget_extremes(s);
  const int corners = trial->corners + 1;
  *trial = (tr_trial){.h = theta * trial->h, .theta = 1.0, .which = -1, .found = TR_NO_EVENT, .cuts = trial->cuts, .whole = whole, .corners = corners};
  trial->end = s->clock.t + trial->h;
  return 1;
}
