/* Instances: memory, log, start of a run, changes from outside, steps. */
#include <math.h>
#include <stdarg.h>
#include <string.h>
#include "fmu.h"

#define MODEL (&fmu_the_model)
#define RTOL 1e-6       /* where neither the host nor a parameter says anything */
#define SAME_POINT 1e-9 /* of a communication step: how far apart two communication points may be and still be the same */
#define FAR 1e4         /* communication steps: the run's own steps may reach so far ahead, beyond a stop time too: it is no reason for other steps */
#define MANY_STEPS 1e9  /* of one communication step: no limit */

#include "log.c"
#include "block.c"

static double fmu_setting_of(const fmu_state *s, int kind, double otherwise) {
  for (int i = 0; i < MODEL->settings; ++i)
    if (MODEL->setting[i].kind == kind) return FMU_A(s, settings)[i];
  return otherwise;
}

#include "ticks.c"
#include "diagnosis.c"
#include "warnings.c"

/* Hand the simulation the parameters that are numbers of its equations. */
static void fmu_numbers(fmu_state *s) {
  double *p = tr_array(FMU_SIM(s), TR_ARRAY_PARAMETERS);
  for (int i = 0; i < MODEL->settings; ++i) {
    const fmu_setting *g = MODEL->setting + i;
    if (g->kind == FMU_NUMBER) p[g->index] = FMU_A(s, settings)[i];
    if (g->kind == FMU_NUMBER && g->also >= 0) p[g->also] = FMU_A(s, settings)[i];
  }
}

#include "motion.c"

#if defined FMU_ALONE
#define fmu_row_here(m) FMU_ERROR /* a plain library makes its own steps */
#else
static fmu_status fmu_row_here(fmu_instance *m);
#endif

/* Hand the simulation the start values of coordinates and rates; its assembly normalises the quaternions. */
static void fmu_start_values(fmu_state *s) {
  double *y = tr_array(FMU_SIM(s), TR_ARRAY_STATE);
  memcpy(y, MODEL->q, sizeof(double) * MODEL->kernel->nq);
  memcpy(y + MODEL->kernel->nq, MODEL->v, sizeof(double) * MODEL->kernel->nv);
  for (int i = 0; i < MODEL->settings; ++i) {
    const fmu_setting *g = MODEL->setting + i;
    if (g->kind == FMU_START_Q) y[g->index] = FMU_A(s, settings)[i];
    if (g->kind == FMU_START_QD) y[MODEL->kernel->nq + g->index] = FMU_A(s, settings)[i];
  }
}

/* Whether parameters that depend on each other go together; says which do not. They are judged when they take effect, not when they
 * are set, for hosts set them one after the other. Nothing is lost: the host can set others and go on. */
static fmu_status fmu_together(fmu_instance *m) {
  const double *value = FMU_A(m->state, settings);
  for (int i = 0; i < MODEL->settings; ++i) {
    const fmu_setting *g = MODEL->setting + i, *low = MODEL->setting + g->above;
    if (g->above >= 0 && !(g->strict ? value[g->above] < value[i] : value[g->above] <= value[i]))
      return fmu_log(m, FMU_DISCARD, "%s: %s must %s %s: %g is %s %g", g->name, g->key, g->strict ? "be above" : "not be below", low->key,
                     value[i], g->strict ? "not above" : "below", value[g->above]);
    if (g->rotation && value[i] == 0.0 && value[i + 1] == 0.0 && value[i + 2] == 0.0 && value[i + 3] == 0.0)
      return fmu_log(m, FMU_DISCARD, "%s: a quaternion of four zeros is no rotation", g->name);
  }
  return FMU_OK;
}

/* The relative tolerance of the run: that of its parameter or the host's. Says which, where they differ. */
static double fmu_tolerance(const fmu_instance *m) {
  const fmu_state *s = m->state;
  const double own = fmu_setting_of(s, FMU_TOLERANCE, RTOL);
  const int rule = (int)fmu_setting_of(s, FMU_HOST_TOLERANCE, FMU_HOST_TIGHTER);
  if (!s->has_tolerance || s->tolerance == own) return own;
  const int taken = rule == FMU_HOST_COUNTS || (rule == FMU_HOST_TIGHTER && s->tolerance < own);
  fmu_log(m, FMU_OK, "the tolerance that counts is %g, of %s; %s gives %g, which solver.host_tolerance = %d leaves aside", taken ? s->tolerance : own,
          taken ? "the host" : "solver.tolerance", taken ? "solver.tolerance" : "the host", taken ? own : s->tolerance, rule);
  return taken ? s->tolerance : own;
}

/* What steps for real time may take, as the parameters say now. */
static void fmu_bound(fmu_state *s) {
  tr_settings *set = &FMU_SIM(s)->set;
  if (!MODEL->bounded) return;
  set->events = (int)fmu_setting_of(s, FMU_MOST_EVENTS, 0.0);
  set->evaluations = (int)fmu_setting_of(s, FMU_MOST_EVALUATIONS, 1.0), set->iterations = (int)fmu_setting_of(s, FMU_MOST_ITERATIONS, 1.0);
}

#include "second.c"

/* Assemble and start a run at the start time, at a tolerance so many times tighter, from the values as they are set. */
static fmu_status fmu_begin_run(fmu_instance *m, double tighter) {
  fmu_state *s = m->state;
  tr_sim *sim = FMU_SIM(s);
  memset(sim, 0, tr_size(MODEL->kernel, MODEL->columns, MODEL->jacobian, MODEL->nbreaks, MODEL->ntables, MODEL->events));
  tr_init(sim, MODEL->kernel, MODEL->columns, MODEL->jacobian, MODEL->nbreaks, MODEL->ntables, MODEL->events);
  memcpy(tr_array(sim, TR_ARRAY_PARAMETERS), MODEL->p, sizeof(double) * MODEL->kernel->np);
  memcpy(tr_array(sim, TR_ARRAY_BREAKS), MODEL->breaks, sizeof(double) * MODEL->nbreaks);
  memcpy(tr_array(sim, TR_ARRAY_TABLES), MODEL->tables, sizeof(double) * MODEL->ntables);
  fmu_numbers(s);
  tr_set_parameters(sim);
  const tr_settings set = {.rtol = fmu_tolerance(m) / tighter, .hmax = INFINITY, .hfixed = fmu_setting_of(s, FMU_STEP, 0.0), .length = MODEL->length,
                           .rate = MODEL->rate, .energy = MODEL->energy, .method = MODEL->method, .project = 1, .locate = 1,
                           .through_jams = MODEL->through_jams};
  tr_configure(sim, &set);
  fmu_bound(s);
  fmu_start_values(s);
  s->time = s->reached = s->point = s->start, s->failed = s->why = s->told = s->tenths = 0;
  fmu_forget_events(s);
  fmu_hand_inputs(m, s->start, 1);
  int closed = tr_assemble(sim, s->start, MODEL->q_given, MODEL->v_given);
  if (closed != 1) {
    s->failed = TR_FAIL_CLOSURE;
    return fmu_log(m, FMU_ERROR, "open_loop: the start %s cannot be made to close the loops: check lengths and start values",
                   closed ? "velocities" : "positions");
  }
  int status = tr_start(sim, s->start, s->start, INFINITY, FMU_A(s, row));
  if (status == TR_NEED_REDUNDANT) {
    s->failed = status;
    return fmu_log(m, FMU_ERROR, "with these values the loops become redundant and friction depends on it: export the scene with them");
  }
  if (status != TR_OK) return fmu_failed(m, status, FMU_ERROR);
  return FMU_OK;
}

/* Assemble and start the run at the start time, from the values as they are set. */
static fmu_status fmu_begin(fmu_instance *m) {
  fmu_state *s = m->state;
  fmu_status status = fmu_together(m);
  if (status == FMU_OK) status = fmu_begin_run(m, 1.0);
  if (status != FMU_OK) return status;
  if (!m->exchange) fmu_begin_second(m, fmu_begin_run);
  s->ready = 1, s->changed = s->known = 0;
  if (m->exchange) tr_arm_here(FMU_SIM(s));
  return FMU_OK;
}

/* Let what the host changed take effect in the run at hand. */
static int fmu_change_run(fmu_instance *m) {
  fmu_state *s = m->state;
  int status = tr_cut(FMU_SIM(s), s->time), anew = (s->changed & FMU_NEW_PARAMETERS) != 0;
  if (status == TR_OK && anew) fmu_numbers(s), fmu_bound(s);
  fmu_hand_inputs(m, s->time, 0);
  return status == TR_OK ? tr_resume(FMU_SIM(s), anew) : status;
}

/* Let what the host changed take effect at the present time. */
static fmu_status fmu_take_over(fmu_instance *m) {
  fmu_state *s = m->state;
  if (!s->changed) return FMU_OK;
  fmu_status together = fmu_together(m);
  if (together != FMU_OK) return together;
  const int status = fmu_change_run(m);
  if (status != TR_OK) return fmu_failed(m, status, FMU_DISCARD);
  if (s->certified > 0) {
    fmu_swap(s);
    if (fmu_change_run(m) != TR_OK) s->certified = -1;
    fmu_swap(s);
  }
  s->changed = 0, s->ready = 0, s->moved = 1, s->event = 0, s->seen = s->time;
  return FMU_OK;
}

/* Make the row of outputs belong to everything that is set now. */
static fmu_status fmu_refresh(fmu_instance *m) {
  fmu_state *s = m->state;
  if (s->ready && !s->changed) return FMU_OK;
  if (s->mode == FMU_INSTANTIATED || s->mode == FMU_INITIALIZATION) return fmu_begin(m);
  if (m->exchange && !s->failed) return fmu_row_here(m);
  if (s->failed) return FMU_OK; /* the outputs stay at the last row of the run */
  fmu_status status = fmu_take_over(m);
  if (status != FMU_OK) return status;
  int code = tr_row(FMU_SIM(s), FMU_A(s, row));
  if (code != TR_OK) return fmu_failed(m, code, FMU_DISCARD);
  s->ready = 1;
  return FMU_OK;
}

static int fmu_near(double a, double b, double scale) { return fabs(a - b) <= SAME_POINT * fmax(fabs(scale), fmax(fabs(a), fabs(b))); }

/* Whether a communication step of length h from t can be made; says why not. */
static fmu_status fmu_may_step(fmu_instance *m, double t, double h) {
  fmu_state *s = m->state;
  double target = t + h;
  if (s->failed) {
    const char *name = fmu_outcome_of(s->failed, s->why)->name;
    return fmu_log(m, FMU_DISCARD, "the run ended at t = %.6g s (%s): go back to an earlier state, or reset", s->reached, name);
  }
  if (!(h > 0.0) || !isfinite(h) || !isfinite(t))
    return fmu_log(m, FMU_DISCARD, "a communication step must have a positive, finite length (%g s is refused)", h);
  if (!fmu_near(t, s->time, h))
    return fmu_log(m, FMU_ERROR, "the communication point is t = %.17g s, not %.17g s: steps follow one another", s->time, t);
  if (s->has_stop && target > s->stop && !fmu_near(target, s->stop, h))
    return fmu_log(m, FMU_ERROR, "the step would pass the stop time %.17g s that was agreed on", s->stop);
  if (!(target > s->time)) return fmu_log(m, FMU_DISCARD, "the step of %g s is lost in the round-off of t = %.17g s", h, s->time);
  return FMU_OK;
}

/* What the host changed takes effect before a step. */
static fmu_status fmu_set_off(fmu_instance *m) {
  fmu_state *s = m->state;
  if (!s->midway && fmu_input_stopped(s)) s->changed |= FMU_NEW_INPUTS;
  return fmu_take_over(m);
}

/* How far the run's own steps may reach on the way to `target`: beyond it. After a change another is likely, which would make such work useless. */
static double fmu_limit(const fmu_state *s, double target, double h) { return s->moved ? target : target + FAR * h; }

/* How many steps of its own a communication step may take. */
static long fmu_most_steps(const fmu_state *s) {
  const double most = fmu_setting_of(s, FMU_MAX_STEPS, 0.0);
  return most >= 1.0 && most < MANY_STEPS ? (long)most : (long)MANY_STEPS;
}

/* What the host is told of a step up to `target` that ended as `status`. */
static fmu_status fmu_arrived(fmu_instance *m, int status, double target) {
  fmu_state *s = m->state;
  const double reach = fmu_limit(s, target, target - s->time);
  s->moved = 0, s->event = 0;
  if (status == TR_DONE) {
    s->point = s->midway ? s->point : s->time;
    s->time = s->reached = target, s->ready = 1;
    fmu_second_follows(m, reach);
    fmu_tell_events(m);
    fmu_tell_progress(m);
    return fmu_audit(m);
  }
  s->reached = fmax(s->time, tr_time(FMU_SIM(s)));
  s->time = s->reached;
  s->ready = tr_row(FMU_SIM(s), FMU_A(s, row)) == TR_OK;
  if (status == TR_MORE)
    return fmu_log(m, FMU_DISCARD, "solver.max_steps = %ld steps reach t = %.17g s only", fmu_most_steps(s), s->reached);
  return fmu_failed(m, status, FMU_DISCARD);
}

/* Go on to `target`, h ahead, by steps of the run's own or by bounded ones, and write the row there. How it ended. */
static int fmu_reach(fmu_instance *m, double target, double h) {
  static const char *const said[] = {0, "one step of impulses", "one step of impulses whose friction a few sweeps found"};
  fmu_state *s = m->state;
  tr_sim *sim = FMU_SIM(s);
  if (!MODEL->bounded) return tr_reach(sim, target, fmu_limit(s, target, h), fmu_most_steps(s), FMU_A(s, row));
  const int status = tr_reach_bounded(sim, target, FMU_A(s, row)), how = sim->bound.overrun;
  if (how) fmu_tell(m, (int)FMU_WARNING, "the step to t = %.9g s is over its bounds: its rest was %s (realtime.overrun = %d)", target, said[how], how);
  return status;
}

/* One communication step of length h from t. */
static fmu_status fmu_step(fmu_instance *m, double t, double h) {
  fmu_status status = fmu_may_step(m, t, h);
  if (status == FMU_OK) status = fmu_set_off(m);
  if (status != FMU_OK) return status;
  const double target = t + h;
  return fmu_arrived(m, fmu_reach(m, target, h), target);
}
