/* Findings of the audit as warnings in the host's log. */

/* Log a warning about the law that a step violates most, as the audit found. */
static fmu_status fmu_law_broken(fmu_instance *m, const tr_judgement *said) {
  int worst = 0;
  for (int i = 1; i < TR_LAWS; ++i)
    if (said->law[i].size > said->law[worst].size) worst = i;
  const tr_worst *w = said->law + worst;
  const char *joint = fmu_joint(w->joint);
  return fmu_log(m, FMU_WARNING, "audit at t = %.9g s%s%s: %s: %.1g", w->time, *joint ? ", joint " : "", joint, MODEL->law[worst], w->size);
}

/* Log a warning when the verdict of the audit gets worse: one warning for a note, and one for an inaccurate run. */
static fmu_status fmu_audit(fmu_instance *m) {
  fmu_state *s = m->state;
  tr_judgement said;
  tr_judge(FMU_SIM(s), &said);
  if (said.verdict <= s->told) return FMU_OK;
  s->told = (int)said.verdict;
  if (!(said.judged && said.share > said.noted_energy)) return fmu_law_broken(m, &said);
  const fmu_outcome *o = fmu_outcome_of(TR_INACCURATE, TR_WHY_UNKNOWN);
  const char *joint = fmu_joint(said.jump_joint);
  const int far = said.verdict == TR_VERDICT_INACCURATE;
  return fmu_log(m, FMU_WARNING, "audit at t = %.9g s%s%s: %s %.3g J of the %.3g J turned over%s%s%s", said.jump_time, *joint ? ", joint " : "", joint,
                 said.lost > 0.0 ? "gained" : "lost", fabs(said.lost), said.turned, far ? ": " : "", far ? o->name : "", far ? "" : " (a note)");
}
