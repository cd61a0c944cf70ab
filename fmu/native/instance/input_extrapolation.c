/* Inputs between communication points, and motions that follow them. */

#define CARRIED 0.2 /* bandwidth · sample time of a sampled input. With more, the motion jerks at every sample, and a host that feeds the force
                     * back to the source amplifies the jerks */
#define IN_A_ROW 2  /* number of consecutive communication points at which an input changes before it counts as sampled; a single change is a step */

/* Whether an input is sampled: it changes at consecutive communication points, and its acceleration is not given. */
static int fmu_sampled(const fmu_input *in) { return in->changes >= IN_A_ROW && in->derived < 2.0 && in->last_t > in->before_t; }

/* Derivative k + 1 of an input, from either source. */
static double fmu_told(const fmu_input *in, int k) { return in->told[k] + in->given[k]; }

/* Bandwidth with which a motion follows its input: the requested one, limited by the samples of a sampled input. */
static double fmu_bandwidth(const fmu_input *in, double asked) {
  return fmu_sampled(in) ? fmin(asked, CARRIED / (in->last_t - in->before_t)) : asked;
}

/* Rate and curvature of a sampled input from its last samples. The curvature is smoothed like the motion: a feedback of the force would react to
 * every sample otherwise. */
static void fmu_sample(fmu_input *in, double asked) {
  const double h = in->last_t - in->before_t;
  in->rate = in->derived > 0.0 ? fmu_told(in, 0) : (in->last - in->before) / h;
  in->curve = 0.0;
  if (!fmu_sampled(in) || in->changes < IN_A_ROW + 1.0) return;
  const double part = fmin(1.0, h * fmu_bandwidth(in, asked));
  in->curve = in->curve_before + part * ((in->rate - in->rate_before) / h - in->curve_before);
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
  }
  in->last = in->value; /* a host may set it repeatedly at one point */
  if (in->last_t > in->before_t) fmu_sample(in, asked);
}

/* Whether a sampled input has not changed at the present communication point: then it moves no further. */
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

/* Hand the inputs to the simulation from time t on. A motion that follows an input goes on from where the motion is; when the run
 * begins, it starts at the input's value. A sampled input is taken to go on at the rate of its last two samples. */
static void fmu_hand_inputs(fmu_instance *m, double t, int begin) {
  fmu_state *s = m->state;
  for (int i = 0; i < MODEL->settings; ++i) {
    if (MODEL->setting[i].kind != FMU_BANDWIDTH) continue;
    fmu_input *told = FMU_INPUTS(s) + MODEL->setting[i].index;
    if (begin) told->last = told->before = told->value, told->last_t = told->before_t = t, told->changes = told->derived = told->rate = told->curve = 0.0;
    fmu_note_input(s, told, t, FMU_A(s, settings)[i]);
  }
  for (int i = 0; i < MODEL->inputs; ++i) {
    const fmu_input *told = FMU_INPUTS(s) + i;
    tr_input *in = tr_input_record(FMU_SIM(s), i);
    tr_signal now;
    tr_input_value(in, t, &now);
    in->t0 = t, in->u[0] = told->value, in->u[1] = fmu_told(told, 0), in->u[2] = fmu_told(told, 1);
    const double half = told->derived > 0.0 ? 0.0 : 0.5 * (told->last_t - told->before_t); /* a mean rate belongs to the middle of the sample */
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
  }
}
