/* Tables of the methods, generated from engine/runtime/integrators (``tr_tables.h``). No C file names a method. The number of a
 * method is its index in the table. */
#ifndef TR_METHODS_H
#define TR_METHODS_H
#include "tr_abi.h"
#include "base/compiler.h"

/* out = h · (linear combination of the rows of K). A row has n SIMD vectors. */
typedef void (*tr_combination)(int n, double h, const tr_vec *restrict K, tr_vec *restrict out);

/* An explicit Runge–Kutta method. Rows of K: the stages, the derivative at the end of the step, the extra stages of the dense
 * output. */
typedef struct tr_explicit {
  int stages, extra;   /* stages of a step; extra stages of the dense output */
  int errors;          /* error estimators: 1 or 2 */
  int dense;           /* rows of the dense output beyond those of the cubic through both ends */
  int ends_in_error;   /* whether an error estimator uses the derivative at the end of the step */
  double stiff_at;     /* h|λ| (λ: eigenvalue of the Jacobian) above which stability limits the step size */
  const double *c;     /* nodes of all rows */
  const double *lead;  /* stages × stages, by rows: weights of earlier stages; the weighted sum is the start of Newton's method */
  void (*argument)(int stage, int n, double h, const tr_vec *restrict y, const tr_vec *restrict K, tr_vec *restrict out);
  void (*solution)(int n, double h, const tr_vec *restrict y, const tr_vec *restrict K, tr_vec *restrict out);
  const tr_combination *error, *dense_row;
} tr_explicit;

/* A Rosenbrock method; engine/runtime/integrators/rosenbrock_coefficients.py explains form and names. Rows of K: f at the start,
 * the stages, f at the end. */
typedef struct tr_rosenbrock {
  int stages;
  double gamma;
  const double *A, *C; /* stages × stages, by rows */
  const double *c, *d, *b;
  const double *H;     /* 3 × stages */
} tr_rosenbrock;

/* Impulse steps: weights of the Richardson extrapolation, for the whole step and for its two halves. */
typedef struct tr_impulses {
  double whole, halves;
} tr_impulses;

/* TR_CHOSEN is method auto, which selects among the other methods. */
enum { TR_CHOSEN, TR_EXPLICIT, TR_IMPLICIT, TR_IMPULSES };
typedef struct tr_method {
  int kind, order;
  int end; /* row of K with the derivative at the end of the step */
  const tr_explicit *explicit;
  const tr_rosenbrock *rosenbrock;
  const tr_impulses *impulses;
} tr_method;
#endif
