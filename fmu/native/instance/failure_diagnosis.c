/* Reason and joint of a failed run. The texts of the messages are those of engine/simulation/execution/failure_diagnosis.py. */

/* The name of a joint with friction by its number (from 1); "" for other numbers. */
static const char *fmu_joint(double number) { return number >= 1.0 && number <= MODEL->joints ? MODEL->joint[(int)number - 1] : ""; }

/* The outcome of a friction failure with the reason `why`, if this reason is known; otherwise the outcome of the status. */
static const fmu_outcome *fmu_outcome_of(int status, int why) {
  for (const fmu_outcome *o = MODEL->why; why != TR_WHY_UNKNOWN && o->status >= 0; ++o)
    if (o->status == why) return o;
  for (int i = 0; i < MODEL->noutcomes; ++i)
    if (MODEL->outcome[i].status == status) return MODEL->outcome + i;
  return MODEL->outcome + MODEL->noutcomes - 1;
}

/* The joint with the largest friction multiplier in the last row. */
static const char *fmu_most_loaded(tr_sim *sim) {
  const double *z = tr_array(sim, TR_ARRAY_MULTIPLIERS) + MODEL->kernel->active;
  double most = -1.0;
  int joint = -1;
  for (int i = 0; i < MODEL->kernel->neta; ++i)
    if (MODEL->eta_joint[i] >= 0 && fabs(z[i]) > most) most = fabs(z[i]), joint = MODEL->eta_joint[i];
  return fmu_joint(joint + 1);
}

/* The tree joint that moves fastest; if all joints are at rest, the first joint with a degree of freedom. */
static const char *fmu_fastest(tr_sim *sim) {
  const double *v = tr_array(sim, TR_ARRAY_STATE) + MODEL->kernel->nq;
  double most = -1.0;
  const char *joint = "";
  for (int i = 0; i < MODEL->rates; ++i) {
    const double rate = fabs(v[MODEL->moving[i].index]) * MODEL->moving[i].unit;
    if (rate > most) most = rate, joint = MODEL->moving[i].joint;
  }
  return joint;
}

/* The joint in which a run failed; "" if no joint is known. *why: reason. *more: further text. The function changes sim. */
static const char *fmu_cause(tr_sim *sim, int status, int *why, const char **more) {
  int pair = -1;
  double number;
  if (status == TR_FAIL_MULTIPLIERS || status == TR_FAIL_MODES) {
    *why = tr_diagnose_friction(sim, &pair);
    if (*why == TR_WHY_UNDECIDED) return "";
    if (*why != TR_WHY_UNKNOWN) return pair < 0 ? "" : fmu_joint(MODEL->pair_joint[pair] + 1);
    return status == TR_FAIL_MULTIPLIERS ? fmu_most_loaded(sim) : "";
  }
  if (status == TR_FAIL_NOT_FINITE) return fmu_fastest(sim);
  const int row = tr_fail_row(sim, &number);
  if (row < 0 || MODEL->row_loop[row] < 0) return "";
  const fmu_loop *loop = MODEL->loop + MODEL->row_loop[row];
  *more = loop->words;
  return status == TR_FAIL_GIMBAL ? loop->gimbal : loop->joint;
}

/* Log the failure of the run. The diagnosis uses a copy of the run, so that the state keeps the last row. */
static fmu_status fmu_failed(fmu_instance *m, int status, fmu_status as) {
  fmu_state *s = m->state;
  const char *more = "", *joint = "";
  s->failed = status, s->why = TR_WHY_UNKNOWN, s->ready = 0;
  fmu_state *copy = fmu_copied(m);
  if (copy) {
    joint = fmu_cause(FMU_SIM(copy), status, &s->why, &more);
    fmu_free(copy);
  }
  const fmu_outcome *o = fmu_outcome_of(status, s->why);
  return fmu_log(m, as, "%s%s%s at t = %.6g s: %s%s", o->name, *joint ? " in joint " : "", joint, s->reached, o->advice, more);
}
