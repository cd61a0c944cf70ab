/* Friction y of a ball at rest or about to slide, from p = y + ρ x at a load f (theory, "Many pairs").
 *
 * Let F = |f|, u = f/F, t the part of p perpendicular to f, and i = t × u. Then y = A t + B i. The ball slides where |t|² ≥ c² + μ²
 * (p·u)², with c = F μ/√(1 + μ²). Otherwise it spins about its contact, or rests. Both branches give the same y at the border, and
 * both are smooth there. */
#include "modes/modes.h"

/* Coefficients A and B of y = A t + B i, and their derivatives with respect to |t|², p·u (`along`) and F. */
typedef struct tr_ball_equation {
  double F, u[3], t[3], along, A, B, dA[3], dB[3];
  int flag;
} tr_ball_equation;

/* Sliding branch: y = c e. The unit vector e satisfies t = T e + turn μ (p·u) e × u. P = |t|². */
static void tr_ball_sliding_branch(tr_ball_equation *b, double mu, double turn, double P) {
  const double c = b->F * mu / sqrt(1.0 + mu * mu), T = sqrt(P - mu * mu * b->along * b->along);
  b->flag = TR_SLIPS;
  b->A = c * T / P, b->B = -turn * mu * c * b->along / P;
  b->dA[0] = 0.5 * c / (T * P) - b->A / P, b->dA[1] = -c * mu * mu * b->along / (T * P), b->dA[2] = b->A / b->F;
  b->dB[0] = -b->B / P, b->dB[1] = -turn * mu * c / P, b->dB[2] = b->B / b->F;
}

/* Spinning branch, or rest. Let x_⊥ and x_∥ be the parts of x perpendicular and parallel to f, and P = |t|². The unknown
 * w = |x_⊥|²/x_∥² solves along² w² + (along² + F² − P) w = P. */
static void tr_ball_spinning_branch(tr_ball_equation *b, double turn, double P) {
  const double l = b->along, F = b->F, c = l * l + F * F - P, r = sqrt(c * c + 4.0 * l * l * P);
  const double w = c > 0.0 ? 2.0 * P / (c + r) : (r - c) / (2.0 * l * l), h = turn * l * sqrt(1.0 + w) / F, half = 0.5 * h / (1.0 + w);
  const double dh[3] = {half * (1.0 + w) / r, turn * sqrt(1.0 + w) / F - half * 2.0 * l * w * (1.0 + w) / r, -h / F - half * 2.0 * F * w / r};
  b->flag = TR_CONE;
  b->A = 1.0 / (1.0 + h * h), b->B = -h * b->A;
  for (int q = 0; q < 3; ++q) b->dA[q] = -2.0 * h * b->A * b->A * dh[q], b->dB[q] = (2.0 * h * h * b->A - 1.0) * b->A * dh[q];
}

/* y (3) of a ball with load f (3) at p (3) and friction ratio mu. turn: ±1, orientation of the frame. If load or friction is zero,
 * y is zero. */
static void tr_ball_friction(const double *f, const double *p, double mu, double turn, tr_ball_equation *b, double *y) {
  double i[3], P = 0.0;
  memset(b, 0, sizeof *b);
  b->flag = TR_SLIPS;
  memset(y, 0, sizeof(double) * 3);
  b->F = sqrt(tr_dot(f, f, 3));
  if (!(b->F > 0.0) || !(mu > 0.0)) return;
  for (int j = 0; j < 3; ++j) b->u[j] = f[j] / b->F;
  b->along = tr_dot(p, b->u, 3);
  for (int j = 0; j < 3; ++j) b->t[j] = p[j] - b->along * b->u[j], P += b->t[j] * b->t[j];
  if (P >= mu * mu * (b->F * b->F / (1.0 + mu * mu) + b->along * b->along)) tr_ball_sliding_branch(b, mu, turn, P);
  else tr_ball_spinning_branch(b, turn, P);
  tr_cross(b->t, b->u, i);
  for (int j = 0; j < 3; ++j) y[j] = b->A * b->t[j] + b->B * i[j];
}

/* Derivatives Df = ∂y/∂f and Dp = ∂y/∂p (3×3, column-major). Call after tr_ball_friction. */
static void tr_ball_friction_slopes(const tr_ball_equation *b, const double *p, double *Df, double *Dp) {
  const double F = b->F > 0.0 ? b->F : 1.0;
  double i[3];
  tr_cross(b->t, b->u, i);
  for (int by = 0; by < 2; ++by)
    for (int j = 0; j < 3; ++j) {
      double e[3] = {-b->u[j] * b->u[0], -b->u[j] * b->u[1], -b->u[j] * b->u[2]}, dt[3], di[3], *D = (by ? Dp : Df) + 3 * j;
      e[j] += 1.0; /* dt: derivative of t with respect to p_j (`by` 1) or f_j */
      const double dl = by ? b->u[j] : b->t[j] / F, dP = by ? 2.0 * b->t[j] : -2.0 * b->along * dl, dF = by ? 0.0 : b->u[j];
      const double dA = b->dA[0] * dP + b->dA[1] * dl + b->dA[2] * dF, dB = b->dB[0] * dP + b->dB[1] * dl + b->dB[2] * dF;
      for (int q = 0; q < 3; ++q) dt[q] = by ? e[q] : -dl * b->u[q] - b->along * e[q] / F;
      if (by) tr_cross(e, b->u, di); else tr_cross(p, e, di);
      for (int q = 0; q < 3; ++q) D[q] = dA * b->t[q] + b->A * dt[q] + dB * i[q] + b->B * (by ? di[q] : di[q] / F);
    }
}
