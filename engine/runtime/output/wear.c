/* Wear over the rows of a run (theory, "Rest, swings and efforts"). Integrals cover smooth spans between events. The wear around a
 * pin is distributed over its circumference. */
#include "output/output.h"

#define WORN_POINTS 6    /* number of rows per polynomial; integrals then have sixth order in the spacing */
#define WORN_EVEN 1e-9   /* relative to a spacing: smaller differences between spacings are round-off of times */

/* Weights w of k nodes. w[j] is the integral from lo to hi of the polynomial that is 1 at node j and 0 at the other nodes. Three
 * Gauss points integrate these polynomials exactly. */
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

/* Whether the k nodes are equidistant. lo, hi: the two middle nodes. */
static int tr_are_nodes_even(int k, const double *node, double lo, double hi) {
  if (k < WORN_POINTS || node[k / 2] != hi || node[k / 2 - 1] != lo) return 0;
  for (int i = 1; i < k; ++i)
    if (fabs(node[i] - node[i - 1] - (hi - lo)) > WORN_EVEN * (hi - lo)) return 0;
  return 1;
}

void tr_integrate_rows(int rows, const double *time, int columns, const double *values, int count, const double *ends, double *total, double *out) {
  double even[WORN_POINTS], w[WORN_POINTS], grid[WORN_POINTS];
  for (int j = 0; j < WORN_POINTS; ++j) grid[j] = j;
  tr_node_weights(WORN_POINTS, grid, WORN_POINTS / 2 - 1, WORN_POINTS / 2, even);
  for (int e = 0, first = 0, last; e + 1 < count; ++e) {
    /* rows at the time of an event get the integral up to this event */
    for (; first < rows && e > 0 && time[first] <= ends[e]; ++first)
      for (int c = 0; c < columns; ++c) out[(size_t)c * rows + first] = total[c];
    for (last = first; last < rows && (e + 2 == count || time[last] < ends[e + 1]);) ++last;
    const int some = last - first, k = some < 1 ? 1 : some < WORN_POINTS ? some : WORN_POINTS;
    double lo = ends[e];
    for (int i = first; i <= last; ++i) {
      const double hi = i < last ? time[i] : ends[e + 1];
      int start = i - k / 2 < first ? first : i - k / 2;
      if (start > last - k) start = last - k < 0 ? 0 : last - k;
      const int on_grid = tr_are_nodes_even(k, time + start, lo, hi);
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

/* Distribute the volume `worn` evenly over an arc that starts at `place` and has the length `step`, both in bin widths. */
static void tr_spread_over_bins(int bins, double *on, double place, double step, double worn) {
  const double way = fabs(step), turns = way < bins ? 0.0 : floor(way / bins);
  place -= bins * floor(place / bins);
  if (floor(place) == floor(place + step) && place < bins) { /* usual case: the arc lies in a single bin */
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

void tr_bin_around(int rows, long stride, const double *angle, const double *turned, double sense, const double *volume, int bins, double *on) {
  const double circle = 2.0 * acos(-1.0), per = bins / circle;
  for (int i = 0; i + 1 < rows; ++i) {
    const double worn = volume[i + 1] - volume[i], from = angle[i * stride] + sense * turned[i * stride];
    const double way = angle[(i + 1) * stride] - angle[i * stride], turn = sense * (turned[(i + 1) * stride] - turned[i * stride]);
    const double step = way - circle * floor(way / circle + 0.5) + turn;
    if (worn != 0.0 && isfinite(from) && isfinite(step)) tr_spread_over_bins(bins, on, (from + 0.5 * circle) * per, step * per, worn);
  }
}
