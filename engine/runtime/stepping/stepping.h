/* Stage `stepping`: the loop over steps. */
#ifndef TR_STEPPING_H
#define TR_STEPPING_H
#include "time_stepping/time_stepping.h"

/* Write the row just before the event that cuts the step short. Returns a status. */
static int tr_write_event_row(tr_sim *s, double t, double *row);

/* Record the times at which velocities of pairs inside their proportional zones reverse, up to theta_end. */
static void tr_record_reversals(tr_sim *s, double theta_end);

static void tr_move_run_to(tr_sim *s, double t, const double *y);

/* Largest number of contacts for which all sets are tried. */
enum { SETS_OF_MOST = 6 };

/* One phase of an impact. at: contacts that touch. target: rate of each gap after the impact if its contact is closed, m/s. least:
 * lower bound of the impulse of each contact, N s. closed, impulse: results. from: see tr_impact. keeps: whether friction keeps its
 * modes. */
typedef struct tr_phase {
  const char *at;
  const double *target;
  double *least;
  char *closed;
  double *impulse;
  const double *from;
  int keeps;
} tr_phase;

/* Solve for the impulses with the contacts in `closed`. rate: rates of the gaps before the impact. slides: which sliding pairs keep
 * their direction; for the others, the rates after the impact decide. Returns 0 on failure. */
static int tr_solve_impulses(tr_sim *s, double t, const double *y, const tr_phase *p, const double *rate, int slides);

/* Find the impulses with which all touching contacts fulfil their conditions. Returns 0 if there are none. */
static int tr_find_impulses(tr_sim *s, double t, const double *y, const tr_phase *p, const double *rate);

/* Changes dv of the rates v by the impulses of the last solution. Requires maps of y. */
static void tr_find_rate_changes(tr_sim *s, const double *y, double *dv);

/* Apply `part` of the impulses of the last solution to the rates of y. The work that friction takes is added to the works. */
static void tr_apply_impulses(tr_sim *s, double t, double *y, double part);

/* Add to the works of y the work that the friction of each pair takes, J. */
static void tr_add_pair_works(const tr_sim *s, double *y, const double *works);

/* Whether the friction of a pair that slides in several directions turns between the rates `before` and `after`. */
static int tr_has_slip_turned(const tr_sim *s, const double *before, const double *after);

/* Part of the impulses after which the first sliding pair stops; 1 if none stops. *which: this pair. before, after: all rates before
 * and after the impulses. */
static double tr_find_first_stop(const tr_sim *s, const double *before, const double *after, int *which);

/* What the rates of touching contacts lack of their targets, m/s. */
static double tr_find_lack(const tr_sim *s, const tr_phase *p, const double *rate);

/* Make the part of a phase that ends where the first pair stops sliding. *which: the pair that stops, or −1. lack: what the rates
 * of touching contacts lack at the start of the phase, m/s. p->impulse receives the impulses of the part. Returns the part of the
 * last solution's impulses, or of the path, that was applied to `y`; 0 on failure. */
static double tr_make_part(tr_sim *s, double t, double *y, const tr_phase *p, const double *rate, double lack, int *which);

/* Change the rates of y at time t by the impulses of an impact. at: for each joint that only pushes, whether its contact touches.
 * Returns 0 if no impulses satisfy all conditions. */
static int tr_make_impact(tr_sim *s, double t, double *y, const char *at, const double *restitution);

/* Open or close the contacts of joints that only push at the start of a run. */
static void tr_set_initial_contacts(tr_sim *s);

/* Decide the contacts of joints that only push, at the state `y`. Make the impacts of contacts that approach, then decide which
 * contacts at rest stay closed. Returns a status. */
static int tr_decide_contacts(tr_sim *s);

/* Decide the contacts at the start of a run. Returns a status; TR_FAIL_PENETRATION if a gap is negative. */
static int tr_start_contacts(tr_sim *s);

/* Let a pin enter or leave its slot through a mouth, and decide the contacts. stop: index of the mouth's flag. Returns a status;
 * TR_FAIL_PENETRATION if the pin strikes the edge of the mouth. */
static int tr_pass_mouth(tr_sim *s, int stop);

/* Whether closed contacts would be redundant at the start of a run, although some of them are open. */
static int tr_has_redundant_contacts(tr_sim *s);

/* Returns TR_FAIL_PENETRATION if the closing of an open contact was missed, otherwise TR_OK. gap, rate: receive all gaps, m, and
 * their rates, m/s. */
static int tr_check_missed_contacts(tr_sim *s, double *gap, double *rate);

/* Longest step while a contact is open. (The error control of a part at rest does not notice another part that passes within a
 * single step.) */
static double tr_longest_open_step(const tr_sim *s);

/* Whether, after a jump of forces, a closed contact pulls at the present solution, or the parts of an open contact begin to
 * penetrate. gap, rate: results of tr_check_missed_contacts. */
static int tr_has_contact_to_decide(tr_sim *s, const double *gap, const double *rate);

/* Write the rows of the pending step, then complete the step. After TR_ROWS_FULL, the caller calls again with more space. Returns a
 * status, or TR_WAITS. */
static int tr_complete_step(tr_sim *s, double *rows, long capacity, long *count);

/* Latest end of the next step: the target, or an earlier break of the signals. */
static double tr_step_limit(const tr_sim *s, double target);

/* Whether a sliding pair is at rest at a break because its drive has come to rest. This stop is not a located event. Requires maps
 * of the current state. */
static int tr_has_stopped_with_drive(const tr_sim *s);

/* Make one acceptable step towards `limit`; the step is then pending. Returns a status, TR_NEED_JACOBIAN or TR_WAITS. After
 * TR_WAITS, the caller calls again with the same limit when lanes have served the case's request. */
static int tr_make_step(tr_sim *s, double limit);

/* Whether the run can continue after the friction failure `code` at the state `y`, with other modes, a spinning ball, another root,
 * or a stopped pair. The number of attempts at one time is limited by the number of pairs. */
static int tr_continue_after_failure(tr_sim *s, int code);
#endif
