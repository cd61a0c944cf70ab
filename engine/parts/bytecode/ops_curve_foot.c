/* Builtin op for the foot of a point on a curve (theory, "Points on curves"). */
#include <math.h>

#include "interpreter.h"

/* Position, first derivative and second derivative (2 each) at parameter u of a piece. A piece consists of start, end, arc length
 * to the start, and coefficients. */
static void at_piece(const double *piece, double u, double *at) {
  for (int k = 0; k < 2; ++k) {
    const double x = u - piece[0], *c = piece + 3 + 4 * k;
    at[k] = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
    at[2 + k] = c[1] + x * (2 * c[2] + 3 * x * c[3]);
    at[4 + k] = 2 * c[2] + 6 * x * c[3];
  }
}

/* Find the foot by Newton's method. The point is first projected on the chord of every piece; the search starts at the nearest of
 * these feet. */
void tr_op_curve_foot(double *const *a, const int *how) {
  enum { ROW = 11, ROUNDS = 50 };
  const double *p = a[0], around = a[1][0], *rows = a[1] + 1, *of = rows;
  double u = 0, nearest = INFINITY, at[6];
  for (int k = 0; k < how[0]; ++k) {
    const double *r = rows + ROW * k, *c = r + 3, low = k || around > 0 ? r[0] : -1e300, h = r[1] < 1e300 ? r[1] - r[0] : 0;
    const double x = c[1] + h * (c[2] + h * c[3]), y = c[5] + h * (c[6] + h * c[7]);
    const double v = fmin(fmax(r[0] + ((p[0] - c[0]) * x + (p[1] - c[4]) * y) / (x * x + y * y), low), r[1]);
    at_piece(r, v, at);
    const double gap = (p[0] - at[0]) * (p[0] - at[0]) + (p[1] - at[1]) * (p[1] - at[1]);
    if (gap < nearest) nearest = gap, u = v, of = r;
  }
  for (int n = 0; n < ROUNDS; ++n) {
    at_piece(of, u, at);
    const double x = p[0] - at[0], y = p[1] - at[1], square = at[2] * at[2] + at[3] * at[3], slope = square - x * at[4] - y * at[5];
    const double step = (x * at[2] + y * at[3]) / (slope > 0.1 * square ? slope : square);
    u += step;
    if (around > 0) u -= around * floor(u / around);
    int low = 0, high = how[0] - 1;
    while (low < high) {
      const int middle = (low + high + 1) / 2;
      if (u >= rows[ROW * middle]) low = middle;
      else high = middle - 1;
    }
    of = rows + ROW * low;
    if (!(fabs(step) > 1e-15 * (fabs(u) + 1e-300))) break;
  }
  a[2][0] = of[0];
  memcpy(a[2] + 1, of + 2, sizeof(double) * 9);
  a[2][10] = u;
}
