/* Wear of a run's rows (METHOD, "Rest, swings and efforts"): integrals over what is smooth between events alone, and where around a pin they fall. */
#include <math.h>

#define WORN_POINTS 6    /* rows through which a polynomial goes: integrals are right to the sixth power of their spacing */
#define WORN_EVEN 1e-9   /* of a spacing: so near to each other spacings are one; those of a grid differ by the round-off of its times */

/* ∫ from lo to hi of the polynomial that is 1 at one of k nodes and 0 at the others, for each of them, by three points of Gauss, which are
 * exact for it. */
static void tr_node_weights(int k, const double *node, double lo, double hi, double *w) {
  const double half = 0.5 * (hi - lo), middle = 0.5 * (hi + lo), away = sqrt(3.0 / 5.0);
  for (int j = 0; j < k; ++j) {
    double product[3] = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0}, below = 1.0;
    for (int i = 0; i < k; ++i)
      if (i != j) {
        below *= node[j] - node[i];
        for (int g = 0; g < 3; ++g) product[g] *= middle + half * away * (g - 1) - node[i];
      }
    w[j] = half * (product[0] + product[1] + product[2]) / below;
  }
}

/* Whether k nodes, of which the second half begins at hi, are as far from each other as lo is from hi. */
static int tr_nodes_even(int k, const double *node, double lo, double hi) {
  if (k < WORN_POINTS || node[k / 2] != hi || node[k / 2 - 1] != lo) return 0;
  for (int i = 1; i < k; ++i)
    if (fabs(node[i] - node[i - 1] - (hi - lo)) > WORN_EVEN * (hi - lo)) return 0;
  return 1;
}

/* ∫ values dt up to each row, values and out: columns × rows. By polynomials through the rows nearest by, of those alone that lie between two
 * of the `count` ends, which begin with the first row's time and end with the last's, carried on to these; a span without rows takes the row
 * before it. total: columns zeros. */
void tr_integral(int rows, const double *time, int columns, const double *values, int count, const double *ends, double *total, double *out) {
  double even[WORN_POINTS], w[WORN_POINTS], grid[WORN_POINTS];
  for (int j = 0; j < WORN_POINTS; ++j) grid[j] = j;
  tr_node_weights(WORN_POINTS, grid, WORN_POINTS / 2 - 1, WORN_POINTS / 2, even);
  for (int e = 0, first = 0, last; e + 1 < count; ++e) {
    for (; first < rows && e > 0 && time[first] <= ends[e]; ++first) /* rows at the event itself */
      for (int c = 0; c < columns; ++c) out[(size_t)c * rows + first] = total[c];
    for (last = first; last < rows && (e + 2 == count || time[last] < ends[e + 1]);) ++last;
    const int some = last - first, k = some < 1 ? 1 : some < WORN_POINTS ? some : WORN_POINTS;
    double lo = ends[e];
    for (int i = first; i <= last; ++i) {
      const double hi = i < last ? time[i] : ends[e + 1];
      int start = i - k / 2 < first ? first : i - k / 2;
      if (start > last - k) start = last - k < 0 ? 0 : last - k;
      const int on_grid = tr_nodes_even(k, time + start, lo, hi);
      if (!on_grid) tr_node_weights(k, time + start, lo, hi, w);
      for (int c = 0; c < columns; ++c) {
        const double *v = values + (size_t)c * rows + start;
        double sum = 0.0;
        if (on_grid)
          for (int j = 0; j < WORN_POINTS; ++j) sum += (hi - lo) * even[j] * v[j];
        else
          for (int j = 0; j < k; ++j) sum += w[j] * v[j];
        total[c] += sum;
        if (i < last) out[(size_t)c * rows + i] = total[c];
      }
      lo = hi;
    }
    first = last;
  }
}

/* What goes evenly over `step` directions, from `place` on, both in widths of one of the bins, falls into each. */
static void tr_spread(int bins, double *on, double place, double step, double worn) {
  const double way = fabs(step), turns = way < bins ? 0.0 : floor(way / bins);
  place -= bins * floor(place / bins);
  if (floor(place) == floor(place + step) && place < bins) { /* which most do */
    on[(int)place] += worn;
    return;
  }
  for (int b = 0; b < bins && turns > 0.0; ++b) on[b] += worn * turns / way;
  for (double left = way - turns * bins, here; left > 0.0; left -= here) {
    const double bin = step < 0.0 ? ceil(place) - 1.0 : floor(place), room = step < 0.0 ? place - bin : bin + 1.0 - place;
    here = left < room ? left : room;
    on[((int)bin + bins) % bins] += worn * here / way;
    place = step < 0.0 ? bin : bin + 1.0;
  }
}

/* Of what has come off up to each row, how much in each of the bins around a circle from −π on, where the contact is at
 * angle + sense × turned, rad, and goes the nearer way from one angle to the next. stride: doubles from row to row of both. */
void tr_around(int rows, long stride, const double *angle, const double *turned, double sense, const double *volume, int bins, double *on) {
  const double circle = 2.0 * acos(-1.0), per = bins / circle;
  for (int i = 0; i + 1 < rows; ++i) {
    const double worn = volume[i + 1] - volume[i], from = angle[i * stride] + sense * turned[i * stride];
    const double way = angle[(i + 1) * stride] - angle[i * stride], turn = sense * (turned[(i + 1) * stride] - turned[i * stride]);
    const double step = way - circle * floor(way / circle + 0.5) + turn;
    if (worn != 0.0 && isfinite(from) && isfinite(step)) tr_spread(bins, on, (from + 0.5 * circle) * per, step * per, worn);
  }
}
