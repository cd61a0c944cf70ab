/* What a method is to the runtime. The tables themselves are generated from engine/integrators (``tr_tables.h``): no C file names a
 * method, and a method's number is its place among them. */
#ifndef TR_METHODS_H
#define TR_METHODS_H
#include "tr_abi.h"
#include "beyond.h"

/* out = h · (a combination of the rows of K); n vectors a row. */
typedef void (*tr_combination)(int n, double h, const tr_vec *restrict K, tr_vec *restrict out);

/* An explicit Runge–Kutta method. Rows of K: its stages, the derivative at the end of the step, the extra stages of the dense output. */
typedef struct tr_explicit {
  int stages, extra;   /* of a step; of the dense output besides */
  int errors;          /* error estimators: 1 or 2 */
  int dense;           /* rows of the dense output beyond the cubic */
  int ends_in_error;   /* an estimator uses the derivative at the end of the step */
  double stiff_at;     /* estimate of h|λ| from which on stability limits the steps */
  const double *c;     /* nodes of all rows */
  const double *lead;  /* stages × stages, by rows: weights of earlier stages in what is solved for at a stage, to begin there */
  void (*argument)(int stage, int n, double h, const tr_vec *restrict y, const tr_vec *restrict K, tr_vec *restrict out);
  void (*solution)(int n, double h, const tr_vec *restrict y, const tr_vec *restrict K, tr_vec *restrict out);
  const tr_combination *error, *dense_row;
} tr_explicit;

/* A Rosenbrock method (form and names: engine/integrators/rosenbrock.py). Rows of K: f at the start, the stages, f at the end. */
typedef struct tr_rosenbrock {
  int stages;
  double gamma;
  const double *A, *C; /* stages × stages, by rows */
  const double *c, *d, *b;
  const double *H;     /* 3 × stages */
} tr_rosenbrock;

/* Time stepping by impulses: the weights by which a step made whole and made in two halves are extrapolated. */
typedef struct tr_impulses {
  double whole, halves;
} tr_impulses;

/* TR_CHOSEN: the runtime chooses among the others (method auto). */
enum { TR_CHOSEN, TR_EXPLICIT, TR_IMPLICIT, TR_IMPULSES };
typedef struct tr_method {
  int kind, order;
  int end; /* row of K with the derivative at the end of the step */
  const tr_explicit *explicit;
  const tr_rosenbrock *rosenbrock;
  const tr_impulses *impulses;
} tr_method;
#endif
