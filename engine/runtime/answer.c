/* What follows from the multipliers in place by the maps alone, for the check of answers (``verify.c``): reaction components, friction as
 * the laws ask for it, accelerations. Sizes, by which what is left of an equation is measured, take twice the time: they are summed where
 * it is not already small beside a part of them. */
#include "modes.h"

/* The answer as it follows from the maps alone. */
typedef struct tr_answer {
  double *acc, *acc_size; /* accelerations of the frictional freedoms and the sum of the sizes of what makes them up (neta); behind them, where
                             no maps were asked, what is left of the loops' rows, and what of them without multipliers (active) */
  double *N, *N_size;     /* reaction components, likewise (nn) */
  double *law, *dn;       /* η that the laws ask for, and its derivative */
  tr_sliding *sliding;
  int sized;              /* N_size and dn are known: they are needed only where a law is not met as exactly as it usually is */
} tr_answer;

/* out (m) += A x, and in size the sum of the sizes of what is added; A m×n. */
static inline void tr_sum_up(int m, int n, const double *A, const double *x, double *out, double *size) {
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < m; ++i) {
      double part = A[i + (size_t)j * m] * x[j];
      out[i] += part, size[i] += fabs(part);
    }
}

/* out = first, and in size what it is made of. */
static inline void tr_begin_sum(int m, const double *first, double *out, double *size) {
  for (int i = 0; i < m; ++i) out[i] = first[i], size[i] = fabs(first[i]);
}

/* Adds the sizes of what the laws' answers are made of, once. */
static void tr_size_laws(tr_sim *s, tr_answer *it) {
  const tr_kernel *k = s->k;
  const double *maps = TR_A(s, maps), *z = TR_A(s, z);
  if (it->sized) return;
  tr_form_maps(s);
  tr_begin_sum(k->nn, map_N0(k, maps), it->N, it->N_size);
  tr_sum_up(k->nn, k->active, map_Nl(k, maps), z, it->N, it->N_size);
  tr_sum_up(k->nn, k->neta, map_Ne(k, maps), z + k->active, it->N, it->N_size);
  k->laws(it->N, map_rates(k, maps), TR_A(s, x), TR_A(s, c) + k->c_laws, it->law, it->dn, (double *)it->sliding);
  it->sized = 1;
}

/* Rates at the end of a step of impulses, over its length, in the place of accelerations. */
static void tr_end_rates(const tr_sim *s, const tr_answer *it) {
  const double *rates = map_rates(s->k, TR_A(s, maps));
  for (int i = 0; i < s->k->nsliders; ++i) {
    const tr_pair *pair = tr_pair_of(s, i);
    for (int j = 0; j < pair->nrates; ++j) {
      double now = rates[pair->rate0 + j] / s->moreau.h;
      it->acc[pair->eta0 + j] += now, it->acc_size[pair->eta0 + j] += fabs(now);
    }
  }
}

/* The same of an answer that was found without maps: by the recursion with these frictions as forces. What accelerations are made of is
 * known from those without any friction. */
static void tr_form_answer_along(const tr_sim *s, tr_answer *it, int accelerates) {
  const tr_kernel *k = s->k;
  const double *eta = TR_A(s, z) + k->active;
  double less[k->neta + k->active];
  it->sized = 0;
  if (accelerates || k->active) {
    memset(less, 0, sizeof less);
    k->answer(TR_A(s, c), TR_A(s, w), less, it->N, it->acc_size);
  }
  for (int i = 0; i < k->neta; ++i) less[i] = -eta[i];
  memcpy(less + k->neta, TR_A(s, z), sizeof(double) * k->active);
  k->answer(TR_A(s, c), TR_A(s, w), less, it->N, it->acc);
  k->laws_alone(it->N, map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, it->law, (double *)it->sliding);
  for (int i = 0; i < k->neta && accelerates; ++i) it->acc_size[i] = fabs(it->acc_size[i]) + fabs(it->acc[i] - it->acc_size[i]);
}

/* η that the laws ask for at the loads of a solution that was found without maps, by another pass. */
static void tr_laws_along(const tr_sim *s, double *law) {
  const tr_kernel *k = s->k;
  const double *z = TR_A(s, z);
  double less[k->neta + k->active], acc[k->neta + k->active], N[k->nn];
  tr_sliding sliding[k->nsliders + 1];
  for (int i = 0; i < k->neta; ++i) less[i] = -z[k->active + i];
  memcpy(less + k->neta, z, sizeof(double) * k->active);
  k->answer(TR_A(s, c), TR_A(s, w), less, N, acc);
  k->laws_alone(N, map_rates(k, TR_A(s, maps)), TR_A(s, x), TR_A(s, c) + k->c_laws, law, (double *)sliding);
}

/* Fills the answer. `accelerates`: its accelerations are asked for, of pairs that rest or are about to start. */
static void tr_form_answer(const tr_sim *s, tr_answer *it, int accelerates) {
  const tr_kernel *k = s->k;
  const double *maps = TR_A(s, maps), *z = TR_A(s, z), *eta = z + k->active;
  int a = k->active, e = k->neta, m = k->nn;
  memcpy(it->N, map_N0(k, maps), sizeof(double) * m);
  tr_add_columns(m, a, map_Nl(k, maps), z, 1.0, it->N);
  tr_add_columns(m, e, map_Ne(k, maps), eta, 1.0, it->N);
  k->laws_alone(it->N, map_rates(k, maps), TR_A(s, x), TR_A(s, c) + k->c_laws, it->law, (double *)it->sliding);
  if (!k->sets || !accelerates) return;
  tr_begin_sum(e, map_Q0(k, maps), it->acc, it->acc_size);
  tr_sum_up(e, a, map_Ql(k, maps), z, it->acc, it->acc_size);
  tr_sum_up(e, e, map_Qe(k, maps), eta, it->acc, it->acc_size);
  if (s->moreau.h > 0.0) tr_end_rates(s, it);
}
