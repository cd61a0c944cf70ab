/* Extrapolation of inputs between communication points, and motions that follow inputs. */

#define CARRIED 0.2 /* largest product of bandwidth and sample time. With a larger product, the motion jerks at every sample.
                     * A host that feeds the force back to the source of the input then amplifies these jerks */
#define SWINGS 8    /* this many swings in a row, each larger than the last, mean that a coupling diverges */
#define IN_A_ROW 2  /* an input that changes at this many consecutive communication points is sampled; a single change is a jump */

/* Whether an input is sampled. The value of a sampled input changes at consecutive communication points, and the host does not give
 * its acceleration. */
static int fmu_sampled(const fmu_input *in) { return in->changes >= IN_A_ROW && in->derived < 2.0 && in->last_t > in->before_t; }

/* Derivative of order k + 1 of an input: from a function call of the host, or from a derivative input. */
static double fmu_told(const fmu_input *in, int k) { return in->told[k] + in->given[k]; }

/* Bandwidth with which a motion follows its input. asked: requested bandwidth. The sample time limits the bandwidth of a sampled
 * input. */
static double fmu_bandwidth(const fmu_input *in, double asked) {
  return fmu_sampled(in) ? fmin(asked, CARRIED / (in->last_t - in->before_t)) : asked;
}

/* Compute rate and curvature (second derivative) of a sampled input from its last samples. The curvature is smoothed with the
 * bandwidth of the motion. Without smoothing, a feedback of the force would react to every sample. */
static void fmu_sample(fmu_input *in, double asked) {
  const double h = in->last_t - in->before_t;
  in->rate = in->derived > 0.0 ? fmu_told(in, 0) : (in->last - in->before) / h;
  in->curve = 0.0;
  if (!fmu_sampled(in) || in->changes < IN_A_ROW + 1.0) return;
  const double part = fmin(1.0, h * fmu_bandwidth(in, asked));
  in->curve = in->curve_before + part * ((in->rate - in->rate_before) / h - in->curve_before);
}

/* Count the consecutive samples at which the acceleration of an input grows and changes its sign. */
static void fmu_count_swings(fmu_input *in) {
  const double now = in->derived < 2.0 ? in->curve : fmu_told(in, 1);
  in->swings = now * in->swing < 0.0 && fabs(now) > fabs(in->swing) ? in->swings + 1.0 : 0.0;
  in->swing = now;
}

/* Update an input at the communication point t. */
static void fmu_note_input(const fmu_state *s, fmu_input *in, double t, double asked) {
  for (int k = 0; k < 2; ++k)
    if (fmu_told(in, k) != 0.0) in->derived = fmax(in->derived, k + 1.0);
  if (t > in->last_t) {
    if (in->value == in->last) {
      in->changes = 0.0;
      return;
    }
    in->changes = in->last_t >= s->point ? in->changes + 1.0 : 1.0;
    in->before = in->last, in->before_t = in->last_t, in->last_t = t;
    in->rate_before = in->rate, in->curve_before = in->curve;
    fmu_count_swings(in);
  }
  in->last = in->value; /* a host may set the input several times at one communication point */
  if (in->last_t > in->before_t) fmu_sample(in, asked);
}

/* Whether a sampled input kept its value at the present communication point. Its extrapolation must then stop. */
static int fmu_input_stopped(const fmu_state *s) {
  for (int i = 0; i < MODEL->inputs; ++i) {
    const fmu_input *in = FMU_INPUTS(s) + i;
    if (fmu_sampled(in) && in->last_t < s->time && in->value == in->last) return 1;
  }
  return 0;
}

/* Log once that a motion follows its sampled input more slowly than requested. */
static void fmu_say_slower(fmu_instance *m, const fmu_input *in, double asked, const char *name) {
  const double used = fmu_bandwidth(in, asked);
  if (used >= asked || m->state->slower) return;
  m->state->slower = 1;
  fmu_log(m, FMU_OK, "%s = %g rad/s is more than samples %g s apart carry: the motion follows with %g rad/s; give its rate and acceleration too, "
          "or couple by torque", name, asked, in->last_t - in->before_t, used);
}

/* Warn once that a motion and the source of its input make each other grow. The cause is that the force on the source acts one
 * communication step late. */
static void fmu_say_swings(const fmu_instance *m, fmu_input *in, const char *name) {
  if (in->swings != SWINGS) return;
  in->swings += 1.0;
  fmu_log(m, FMU_WARNING, "%.*s: the acceleration grows and changes its sign at every communication point: the inertia that this motion moves is larger "
          "than that of the source of the motion; no step size helps: couple by torque (effort: {input: ...}), or give the source more inertia",
          (int)(strlen(name) - strlen(".bandwidth")), name);
}

/* Pass the inputs to the simulation, valid from time t on. A motion that follows an input continues from its present position and
 * rate. At the start of the run (begin), the motion starts at the value of the input. A sampled input is extrapolated with the rate
 * of its last two samples. */
static void fmu_hand_inputs(fmu_instance *m, double t, int begin) {
  fmu_state *s = m->state;
  for (int i = 0; i < MODEL->settings; ++i) {
    if (MODEL->setting[i].kind != FMU_BANDWIDTH) continue;
    fmu_input *told = FMU_INPUTS(s) + MODEL->setting[i].index;
    if (begin) told->last = told->before = told->value, told->last_t = told->before_t = t, told->changes = told->derived = told->rate = told->curve = told->swing = told->swings = 0.0;
    fmu_note_input(s, told, t, FMU_A(s, settings)[i]);
  }
  for (int i = 0; i < MODEL->inputs; ++i) {
    const fmu_input *told = FMU_INPUTS(s) + i;
    tr_input *in = tr_input_record(FMU_SIM(s), i);
    tr_signal now;
    tr_input_value(in, t, &now);
    in->t0 = t, in->u[0] = told->value, in->u[1] = fmu_told(told, 0), in->u[2] = fmu_told(told, 1);
    /* The mean rate between two samples is the rate at the middle of their interval, half a sample time ago. */
    const double half = told->derived > 0.0 ? 0.0 : 0.5 * (told->last_t - told->before_t);
    if (fmu_sampled(told)) in->u[1] = told->rate + half * told->curve, in->u[2] = told->curve;
    int behind = in->followed != 0.0 && !begin;
    in->gap = behind ? now.value - in->u[0] : 0.0;
    in->gap_rate = behind ? now.first - in->u[1] : 0.0;
  }
  for (int i = 0; i < MODEL->settings; ++i) {
    const fmu_setting *g = MODEL->setting + i;
    if (g->kind != FMU_BANDWIDTH) continue;
    tr_input_record(FMU_SIM(s), g->index)->bandwidth = fmu_bandwidth(FMU_INPUTS(s) + g->index, FMU_A(s, settings)[i]);
    fmu_say_slower(m, FMU_INPUTS(s) + g->index, FMU_A(s, settings)[i], g->name);
    fmu_say_swings(m, FMU_INPUTS(s) + g->index, g->name);
  }
}
