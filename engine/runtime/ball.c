/* A ball at rest or about to start: its friction y and its surface acceleration x from p = y + ρ x, ρ a mass, at a load f (METHOD, "Many pairs").
 *
 * With u = f/F, t what p is across f, and i = t × u: y = A t + B i. It slides where |t|² ≥ c² + μ² (p·u)², c = F μ/√(1 + μ²), and turns about
 * its contact, or not at all, elsewhere. At that edge both are the same, and neither has there the root that friction has as a function of x. */
#include "modes.h"

/* R of a ball under the load f (3) at p (3), ratio mu; A, B: y = A t + B t×u, t = p across f, u = f/F; its derivatives by |t|², p·u and F. */
typedef struct tr_ball_rest {
  double F, u[3], t[3], along, A, B, dA[3], dB[3];
  int flag;
} tr_ball_rest;

/* The ball slides: t = (T + turn μ (p·u) i) e, y = F sinφ e. */
static void tr_ball_slides(tr_ball_rest *b, double mu, double turn, double P) {
  const double c = b->F * mu / sqrt(1.0 + mu * mu), T = sqrt(P - mu * mu * b->along * b->along);
  b->flag = TR_SLIPS;
  b->A = c * T / P, b->B = -turn * mu * c * b->along / P;
  b->dA[0] = 0.5 * c / (T * P) - b->A / P, b->dA[1] = -c * mu * mu * b->along / (T * P), b->dA[2] = b->A / b->F;
  b->dB[0] = -b->B / P, b->dB[1] = -turn * mu * c / P, b->dB[2] = b->B / b->F;
}

/* It turns about its contact, or not at all: w = |x_⊥|²/x_∥² by along² w² + (along² + F² − P) w = P. */
static void tr_ball_spins(tr_ball_rest *b, double turn, double P) {
  const double l = b->along, F = b->F, c = l * l + F * F - P, r = sqrt(c * c + 4.0 * l * l * P);
  const double w = c > 0.0 ? 2.0 * P / (c + r) : (r - c) / (2.0 * l * l), h = turn * l * sqrt(1.0 + w) / F, half = 0.5 * h / (1.0 + w);
  const double dh[3] = {half * (1.0 + w) / r, turn * sqrt(1.0 + w) / F - half * 2.0 * l * w * (1.0 + w) / r, -h / F - half * 2.0 * F * w / r};
  b->flag = TR_CONE;
  b->A = 1.0 / (1.0 + h * h), b->B = -h * b->A;
  for (int q = 0; q < 3; ++q) b->dA[q] = -2.0 * h * b->A * b->A * dh[q], b->dB[q] = (2.0 * h * h * b->A - 1.0) * b->A * dh[q];
}

/* c = a × b. */
static void tr_cross(const double *a, const double *b, double *c) {
  c[0] = a[1] * b[2] - a[2] * b[1], c[1] = a[2] * b[0] - a[0] * b[2], c[2] = a[0] * b[1] - a[1] * b[0];
}

/* R of a ball: y (3). */
static void tr_ball_at_rest(const double *f, const double *p, double mu, double turn, tr_ball_rest *b, double *y) {
  double i[3], P = 0.0;
  memset(b, 0, sizeof *b);
  b->flag = TR_SLIPS;
  memset(y, 0, sizeof(double) * 3);
  b->F = sqrt(tr_dot(f, f, 3));
  if (!(b->F > 0.0) || !(mu > 0.0)) return;
  for (int j = 0; j < 3; ++j) b->u[j] = f[j] / b->F;
  b->along = tr_dot(p, b->u, 3);
  for (int j = 0; j < 3; ++j) b->t[j] = p[j] - b->along * b->u[j], P += b->t[j] * b->t[j];
  if (P >= mu * mu * (b->F * b->F / (1.0 + mu * mu) + b->along * b->along)) tr_ball_slides(b, mu, turn, P);
  else tr_ball_spins(b, turn, P);
  tr_cross(b->t, b->u, i);
  for (int j = 0; j < 3; ++j) y[j] = b->A * b->t[j] + b->B * i[j];
}

/* ∂R/∂f and ∂R/∂p of a ball (3×3, by columns). */
static void tr_ball_slopes(const tr_ball_rest *b, const double *p, double *Df, double *Dp) {
  const double F = b->F > 0.0 ? b->F : 1.0;
  double i[3];
  tr_cross(b->t, b->u, i);
  for (int by = 0; by < 2; ++by)
    for (int j = 0; j < 3; ++j) {
      double e[3] = {-b->u[j] * b->u[0], -b->u[j] * b->u[1], -b->u[j] * b->u[2]}, dt[3], di[3], *D = (by ? Dp : Df) + 3 * j;
      e[j] += 1.0; /* by p: dt itself; by f: F du */
      const double dl = by ? b->u[j] : b->t[j] / F, dP = by ? 2.0 * b->t[j] : -2.0 * b->along * dl, dF = by ? 0.0 : b->u[j];
      const double dA = b->dA[0] * dP + b->dA[1] * dl + b->dA[2] * dF, dB = b->dB[0] * dP + b->dB[1] * dl + b->dB[2] * dF;
      for (int q = 0; q < 3; ++q) dt[q] = by ? e[q] : -dl * b->u[q] - b->along * e[q] / F;
      if (by) tr_cross(e, b->u, di); else tr_cross(p, e, di);
      for (int q = 0; q < 3; ++q) D[q] = dA * b->t[q] + b->A * dt[q] + dB * i[q] + b->B * (by ? di[q] : di[q] / F);
    }
}
