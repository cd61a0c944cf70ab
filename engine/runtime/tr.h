/* Trunnion runtime: interface between generated kernels, the stepping code and its hosts.
 *
 * A kernel (one per scene structure) is a constant table of sizes and functions. A simulation is one relocatable block: this
 * struct followed by its arrays, which are found by offset; copying the block copies the state. Nothing here allocates, prints
 * or exits.
 */
#ifndef TR_H
#define TR_H
#include <stddef.h>

#define TR_ABI 9
#define TR_TABLE 4      /* numbers per table in x: value and three derivatives */
#define TR_MODE 5       /* numbers per slider in x: flag, frozen direction, given tilt of a ball */
#define TR_STAGES 17    /* most stages of a method, dense output included */
#define TR_BREAKS 4096
#define TR_EVENT 24     /* doubles of one event record */

/* State y: q (nq), v (nv), states of friction laws (nb; friction ratios), integrals (nquad). */
typedef struct tr_kernel {
  int abi, nq, nv, nb, nx, np, nc, nw, nmaps;
  int rows, active, neta, nn, nrates, nquad, nsliders, nstops, ntables, nquat, nelements, ndn;
  int nkappa, loop_friction, coupled, sets; /* redundant variant; friction on a loop; inactive rows matter to the
                                             choice of reactions; some law is set-valued at rest */
  int c_closure, c_laws, c_events, c_held;
  const int *active_rows; /* active: indices of constraint rows that are not structurally empty */
  const int *row_kind;    /* rows: 0 travel (force), 1 turn (torque) */
  const int *qkind;       /* nq: 0 angle, 1 length, 2 quaternion */
  const int *vkind;       /* nv: 0 angle, 1 length */
  const int *quat;        /* nquat: offsets in q of quaternions */
  const int *element;     /* 7 per element: n0, needs, eta0, neta, rate0, nrates, dn0 */
  const int *slider;      /* 10 per slider: element, eta0, neta, rate0, nrates, kind (0 smooth, 1 kinks, 2 set-valued, 3 kink at rest), contact0,
                             ncontacts, v0 (index among the rates of the state, -1: none), cone (turns without sliding: ball) */
  void (*prepare)(const double *p, double *c);
  void (*stage1)(const double *x, const double *y, const double *c, double *w, double *maps, double *dy);
  void (*stage2)(const double *x, const double *y, const double *c, const double *w, const double *z, double *dy);
  void (*laws)(const double *N, const double *r, const double *x, const double *c, double *eta, double *dN, double *speed);
  void (*held)(const double *N, const double *u, const double *x, const double *c, double *hold, double *dN);
  void (*closure)(const double *x, const double *y, const double *c, double *h);
  void (*events)(const double *x, const double *y, const double *c, double *g);
  void (*qdot)(const double *y, const double *v, double *dq);
} tr_kernel;

/* Optional units: outputs, redundancy metric, Jacobian. */
typedef struct tr_outputs {
  int abi, nout, ncontacts, nc, nkappa, npost;
  int energy; /* column of energy.residual, -1 without */
  int wants;  /* 1: the contraction number, 2: contacts or events, so that contacts are watched while stepping */
  const int *post; /* 3 per entry: kind, column, partner (see output.c) */
  void (*prepare)(const double *p, double *c);
  /* a: accelerations of the free rates (nv) at this state */
  void (*eval)(const double *x, const double *y, const double *c, const double *z, const double *a, const double *extra, double *out);
  void (*contacts)(const double *x, const double *y, const double *c, const double *z, const double *a, double *out);
  void (*kappa)(const double *x, const double *y, const double *c, const double *z, const double *a, double *out);
} tr_outputs;

typedef struct tr_jacobian {
  int abi, nc, nw;
  void (*prepare)(const double *p, double *c);
  /* [F; R; scaled reactions (nkappa)] by [y, t, z], column-major: all at once, or the point and then columns one by one */
  void (*eval)(const double *x, const double *y, const double *c, const double *z, double *J);
  void (*point)(const double *x, const double *y, const double *c, const double *z, double *w);
  void (*along)(const double *x, const double *y, const double *c, const double *z, const double *w, const double *seed, double *J);
} tr_jacobian;

/* Directional derivatives: of F = [ẏ; powers] and the multiplier residuals R along a seed of [inputs (4 each), y, z], and of the
 * columns along a seed of [inputs, y, z of all rows, accelerations of the free rates]. */
typedef struct tr_linear {
  int abi, nc, ninputs;
  void (*prepare)(const double *p, double *c);
  void (*rates)(const double *x, const double *y, const double *c, const double *z, const double *seed, double *out);
  void (*columns)(const double *x, const double *y, const double *c, const double *z, const double *a, const double *seed, double *out);
} tr_linear;

enum tr_status {
  TR_OK = 0,
  TR_MORE = 1,          /* step budget used up: call again */
  TR_ROWS_FULL = 2,     /* output buffer full: drain and call again */
  TR_EVENTS_FULL = 3,   /* event buffer full: drain and call again */
  TR_NEED_JACOBIAN = 4, /* the method asks for the Jacobian unit: attach it and call again */
  TR_DONE = 5,
  TR_NEED_REDUNDANT = 6, /* friction depends on reactions that redundant loops leave open: use the redundant variant */
  TR_FAIL_NOT_FINITE = 10,
  TR_FAIL_STEP = 11,      /* step size underflow */
  TR_FAIL_MULTIPLIERS = 12, /* complement equations have no reachable root */
  TR_FAIL_CLOSURE = 13,   /* loops cannot be closed */
  TR_FAIL_MAX_STEPS = 14,
  TR_FAIL_GIMBAL = 15,    /* the turning axes of a loop lie in one plane, and it cannot turn on */
  TR_FAIL_MODES = 16      /* no set of sticking and slipping pairs satisfies the friction laws */
};

enum tr_method { TR_AUTO = 0, TR_RK5 = 1, TR_RK8 = 2, TR_ROSENBROCK = 3, TR_MOREAU = 4 };

enum tr_event_kind { TR_EV_REVERSAL = 1, TR_EV_STOP = 2, TR_EV_SLIP = 3, TR_EV_SEPARATION = 4, TR_EV_TURN = 5, TR_EV_STOP_ON = 6, TR_EV_STOP_OFF = 7, TR_EV_SWITCH = 8, TR_EV_IMPACT = 9 };

typedef struct tr_stats {
  long steps, rejected, rhs, jacobians, newton, newton_max, events, projections, outputs, rk5, rk8, stiff, moreau;
} tr_stats;

typedef struct tr_sim {
  size_t bytes;
  const tr_kernel *k;
  const tr_outputs *o;
  const tr_jacobian *j;
  /* settings */
  double rtol, hmax, hmin, hfixed, length, rate, t_start, t_stop, every;
  int method, want, project, locate, max_steps_total;
  /* time */
  double t, h, h_slip, told, step_t0, step_h, row_next;
  long row_index;
  int have_k1, have_dense, method_now, method_dense, nbreaks, next_break, rank, rank_now, status, fail_detail, watch, trouble;
  int nev, ev_capacity, chatter, pending, p_which, p_cut, p_noted;
  double least_pivot, fail_number, chatter_t, p_theta, p_h, p_t, p_grow, err_old, stiff_h, energy0, energy_unit, eta_scale, solve_error;
  double jac_t;
  int have_jac, stiff_count, nonstiff_count, kink_count, newton_guard, event_slider, probe;
  double capture_h, capture_dec, contraction, complement, open_t; /* largest so far; first decision with several answers */
  double impulse_h, burst_t, moreau_t; /* step of impulses while they are solved; window of events; first hand-over (−1: none) */
  long burst_events;
  int moreau_steps, calm;
  double last[7]; /* the last event: time, kind, element, contact (from 1, 0 none), angle before, after, turn */
  int still, shares, capture, aside, missed, freed, through, open_pair; /* pairs held at rest; whether some of them share their load as a group; pair about to
                                 come to rest; pair that has turned too fast for a step (-1: none) */
  tr_stats stats;
  /* offsets (in doubles) of the arrays behind this struct */
  int p, c, co, cj, x, y, ynew, yold, ytmp, yout, dy, K, w, maps, z, zold, scale, d, S, perm, T, Np, NN, law, dn, speed, lu, r, smin,
      smax, h_res, ev, breaks, tables, wrap, jac, jw, jp, W, wperm, jch, lin0, kap, nul, gram, cand, kstep, Q, rowk, lead, share, hold, dhold,
      arm, vmin, con;
  int ny, nz, nrows;
} tr_sim;

#define TR_A(s, field) ((double *)((char *)(s) + sizeof(tr_sim)) + (s)->field)

size_t tr_size(const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable_doubles, int event_capacity);
#endif
