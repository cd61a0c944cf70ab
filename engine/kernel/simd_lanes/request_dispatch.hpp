/* Dispatch of requests: copy the states of the cases into lanes, serve the request, and copy the results back. */
#if NETA
/* Copy back the loads at zero friction, their derivative by η, and laws and sliding at the solution. */
static void leave_friction(Lanes &s, tr_request **r) {
  V Np[NN * (1 + NETA) + 8];
  Law last;
  law(s, s.z + ACTIVE, last);
  for (int i = 0; i < NN; ++i) Np[i] = s.N0[i];
  for (int i = 0; i < NN * NETA; ++i) Np[NN + i] = s.Ne[i];
  GIVE_GOOD(NW, s.w, w)
  GIVE_GOOD(NN * (1 + NETA), Np, Np)
  GIVE_GOOD(ACTIVE * NETA, s.T, T)
  GIVE_GOOD(NN, last.N, N)
  GIVE_GOOD(NETA, last.eta, law)
  GIVE_GOOD(NDN, last.dn, dn)
  GIVE_GOOD(SLIDING_NUMBERS * NSLIDERS, last.sliding, sliding)
}

/* Copy the data of friction into the lanes. ``give_friction`` copies the data back. */
static void take_friction(Lanes &s, tr_request **r) {
  TAKE(NETA, arm, s.per_lever) TAKE(ACTIVE + NETA, z, s.z) TAKE(NSLIDERS, smin, s.least) TAKE(NSLIDERS, smax, s.largest)
  for (int i = 0; i < NETA; ++i) s.per_lever[i] = pick(s.per_lever[i].v > 0.0, V(1.0) / s.per_lever[i], V(1.0));
  for (int l = 0; l < WIDTH; ++l) s.watches[l] = r[l]->watch ? -1 : 0, s.independence.v[l] = r[l]->independence;
  s.iterations = tr_bits{};
}

static void give_friction(const Lanes &s, tr_request **r) {
  GIVE_GOOD(NSLIDERS, s.least, smin)
  GIVE_GOOD(NSLIDERS, s.largest, smax)
  for (int l = 0; l < WIDTH; ++l) r[l]->iterations = s.iterations[l], r[l]->independence = s.independence.v[l];
}
#endif

/* For TR_ASK_END: copy back all results of the evaluation, because decisions use them. */
static void leave_behind(Lanes &s, tr_request **r) {
  GIVE_GOOD(NMAPS, s.maps, maps)
#if ACTIVE
  /* The runtime stores the diagonal itself, not its inverse. */
  for (int i = 0; i < ACTIVE; ++i) s.factor[i * (ACTIVE + 1)] = V(1.0) / s.factor[i * (ACTIVE + 1)];
  GIVE_GOOD(ACTIVE * ACTIVE, s.factor, S)
  for (int l = 0; l < WIDTH; ++l)
    for (int i = 0; i < ACTIVE && s.good[l]; ++i) r[l]->perm[i] = (int)s.order[i][l];
#endif
#if NETA
  leave_friction(s, r);
#endif
}

extern "C" void l_serve(int kind, tr_request **r) {
  if (kind == TR_ASK_ROWS) return rows(r);
  Lanes s;
  V t, h, y[MOST_WIDE];
  const int n = r[0]->n;
  s.good = tr_bits{} - 1, s.nworks = r[0]->nworks;
  for (int l = 0; l < WIDTH; ++l) t.v[l] = r[l]->t, h.v[l] = r[l]->h, s.length.v[l] = r[l]->length, s.rate.v[l] = r[l]->rate;
  prepare_units(s);
  TAKE(NX, x, s.x) TAKE(NC, c, s.c) TAKE(ACTIVE, d, s.d) TAKE(n, y, y)
#if NETA
  take_friction(s, r);
#endif
  if (kind == TR_ASK_STEP) step(s, r, METHOD(r[0]->method), n, t, h, y);
  else if (kind == TR_ASK_DENSE) dense(s, r, METHOD(r[0]->method), n, t, h, y);
  else end(s, r, n, t, y);
#if NETA
  give_friction(s, r);
#endif
  if (kind == TR_ASK_END) leave_behind(s, r);
  GIVE_GOOD(ACTIVE + NETA, s.z, z)
  for (int l = 0; l < WIDTH; ++l) r[l]->ok = s.good[l] != 0;
}

extern "C" const tr_lanes trunnion_lanes = {TR_ABI, WIDTH, l_serve};
