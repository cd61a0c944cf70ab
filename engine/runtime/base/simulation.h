/* The data of a simulation.
 *
 * A kernel (one per scene structure) is a constant table of sizes and functions (``tr_abi.h``, generated). A simulation is one
 * relocatable block: the struct ``tr_sim``, then its arrays at offsets. Copying the block copies the simulation. The runtime
 * allocates nothing, prints nothing and never exits.
 *
 * Words of all comments: the current state is the one whose maps were evaluated last. The solution is the multipliers z of its
 * equations in the modes in force. A freedom is the motion of one rate of a pair. ``base/validity.h`` lists the parts of a
 * block that belong to the current state. */
#ifndef TR_SIMULATION_H
#define TR_SIMULATION_H
#include "tr_abi.h"
#include "base/validity.h"

/* Whether an event kind belongs to end stops and latches; the others belong to friction pairs. */
#define TR_IS_OF_STOP(kind) ((kind) == TR_EV_END_STOP_ENGAGED || (kind) == TR_EV_END_STOP_RELEASED || (kind) == TR_EV_LATCH || (kind) == TR_EV_UNLATCH)

/* Time of the run and of its rows. */
typedef struct tr_clock {
  double t;                /* of the state `y`, s */
  double t_start, t_end;   /* of the run, s */
  double every, row_next;  /* spacing of rows and time of the next one, s; every 0: one row a step */
  long row_index;          /* rows written so far */
  int width;               /* numbers of a row, time included */
  int nbreaks, next_break; /* times at which a step must end: number, and the next one */
  int status;              /* TR_OK while the run goes on */
} tr_clock;

/* Maps formed for the current state: none; the kernel's; loads with λ eliminated; also accelerations with λ eliminated. */
enum { TR_MAPS_NONE, TR_MAPS_RAW, TR_MAPS_OF_LOADS, TR_MAPS_HELD };

/* The present step, and its data for the next one. */
typedef struct tr_stepping {
  double h;            /* size of the next trial step, s; 0: still to be found */
  double h_slip;       /* size before a pair entered its proportional zone, resumed after it, s; 0: none */
  double t0, size;     /* start and length of the last accepted step, s */
  double err_old;      /* error of the last accepted step, 1 at the tolerance; 0: none yet */
  double jac_t;        /* time of the Jacobian, s */
  double works;        /* error of columns' works in the last accepted step, 1 at the tolerance */
  double worked;       /* part of that step up to which works are integrated for rows; 0: none */
  int parts;           /* works of that step are integrated in parts (``integrators/quadrature.c``) */
  int method;          /* number of the method in force; never that of method auto */
  int have_k1;         /* the first row of K belongs to the state `y` */
  int missed;          /* the last step was remade up to an event and did not reach it */
  int have_dense;      /* the dense output belongs to the last accepted step */
  int dense_rows;      /* rows of the dense output */
  int have_jac;        /* the Jacobian belongs to jac_t */
  double margin;       /* largest violation (tr_worst_violation) at the state `y`; NaN: unknown */
  double margin_end;   /* largest violation at the end of the last step, or at the last decision */
  int far_known;       /* violations at the start of the step are known (``events/event_margin.c``) */
  int mapped;          /* maps of the current state that are formed: TR_MAPS_… */
  int recursive;       /* the solution was found without maps; `acc` and NN belong to it */
  int loads_known;     /* z holds, behind the multipliers, their loads (tr_stored_loads) */
  int watch;           /* the right-hand side updates the extremes of pairs (tr_update_extremes) */
  int failure;         /* status of the last evaluation or projection that failed */
  int stiff_count, nonstiff_count, kink_count; /* consecutive steps in favour of a change of method (tr_choose_method) */
  double stiffness;    /* h |λ| of the accepted step (tr_is_limited_by_stability); NaN: not yet known */
  double moved_t;      /* time of the last progress, s (tr_is_stalled) */
  long moved;          /* trial steps made up to then */
  int explicit_for_now; /* steps of the stiff method are made explicitly (tr_use_explicit_for_now) */
} tr_stepping;

/* An accepted step waits until its rows are written, then is completed. */
enum { TR_NOTHING, TR_WHOLE_STEP, TR_STEP_TO_EVENT, TR_IMPULSE_STEP };
typedef struct tr_waiting {
  int kind;      /* TR_NOTHING, … */
  int which;     /* pair or stop of the event */
  int captured;  /* the step is the last stretch of the pair's sliding (tr_make_capture_step) */
  int cut;       /* the limit of the call chose its length, not the error control */
  int noted;     /* reversals inside it are recorded */
  double theta;  /* its end, as a fraction of the step made; 1: whole */
  double t;      /* its end, s */
  double h;      /* length of the step made, s */
  double grow;   /* factor for the next step's length */
} tr_waiting;

/* Rank of the loop equations, and distance from singular positions. */
typedef struct tr_loops {
  int rank;            /* largest rank found at accurate states */
  int rank_now;        /* rank of the factor of S */
  int sparse;          /* that factor is sparse (``constraints/loop_solve.c``) */
  int open;            /* directions of open reactions that friction determines (``constraints/internal_forces.c``) */
  double least_pivot;  /* smallest pivot within `rank` when that was found */
  double recursive_pivot; /* root of the smallest pivot of the recursion (``friction/newton_recursive.c``); 0: S was factorised */
  int known;           /* independence at the start of the step is known (``stepping/step_limits.c``) */
  double begin, end;   /* independence at the start and at the end of the step */
  double least, trend; /* least independence at its stages; change in the last step, 1/s */
} tr_loops;

/* Step ends with stored speeds (``events/end_of_sliding.c``); nodes of the quadrature of works; row of K for powers in the
 * middle of a stiff step, whose stage the dense output does not use. */
enum { TR_PAST_ENDS = 4, TR_WORK_NODES = 9, TR_MIDDLE_ROW = 1 };

/* Pairs under set-valued laws. */
typedef struct tr_friction {
  int held;            /* pairs held at rest */
  int shared;          /* some pairs share their load as a group */
  int reserve;         /* large groups share again, with the largest possible reserve */
  int stored;          /* groups of any size store loads (TR_STORES_…), because the rule has no answer */
  int from_anywhere;   /* Newton's method may use all starts, because the run would end otherwise */
  double faint;        /* friction of round-off at the last capacities, N */
  double eased;        /* fraction of friction left out (``friction/newton_restarts.c``) */
  double searched;     /* time at which all starts were tried, s */
  int failed;          /* pair of the event whose decision failed; -1: none */
  double folded;       /* time of the last fold, s */
  int folds;           /* folds in close succession */
  double resumed_t;    /* time of the last failure passed, s */
  int resumed;         /* failures passed at that time */
  int impending_laws;  /* balls of stuck groups share by their friction in the impending motion */
  double pace;         /* frequency of the fastest load, Hz */
  long work;           /* iterations allowed for the present decision about many pairs; 0: unlimited */
  int undecided;       /* the last decision found no answer, which does not prove that there is none */
  int freed;           /* pair without friction (tr_find_obstructing_pair); -1: none */
  int cutting_pair;    /* pair whose turning direction has shortened steps; -1: none */
  int capture;         /* pair whose last stretch is the next step; -1: none */
  double capture_h;    /* length of that step, s */
  double past_t[TR_PAST_ENDS]; /* ends of the last steps, newest first, s; NaN: none, or an event since */
} tr_friction;

/* Impulse steps, and their use by method auto. */
typedef struct tr_moreau {
  double h;            /* length of the step whose impulses are being solved, s; otherwise 0 */
  double decides;      /* steps up to this length may decide all modes again, s */
  int keeps;           /* modes stay unchanged even if they violate laws */
  int frozen;          /* directions of fast sliding of several components are frozen over a step */
  double burst_t;      /* start of the window in which events are counted, s */
  double first_t;      /* first use by method auto, s; -1: none */
  double failed_t;     /* time at which no step was possible, s */
  long burst_events;   /* events before that window */
  int steps, calm;     /* impulse steps since the last change of method; consecutive ones without mode change */
} tr_moreau;

/* Events waiting to be read, and the last one. */
typedef struct tr_events {
  int count, capacity; /* records in the buffer, and its room */
  int chatter;         /* consecutive events at nearly one time */
  double chatter_t;    /* that time, s */
  double margin;       /* margin of the next event (``events/event_margin.c``) */
  int unsure;          /* that margin is below the run's error, or the crossing is too slow for an accurate time */
  tr_last last;
} tr_events;

/* Certificates of the run, and the reason of its failure. */
typedef struct tr_audit {
  double contraction, complement; /* largest so far */
  double open_t;       /* first decision with several answers, s; -1: none */
  int open_pair;       /* its pair */
  int fail_detail;     /* component or constraint row of the failure; -1: none */
  double fail_number;  /* independence of the rows; -1: not the reason */
  double energy0;      /* energy.residual at the start, J */
  int known;           /* works of every step so far are integrated */
  double begin;        /* kinetic + potential energy − works at the start, J; moved by allowed changes */
  double kinetic, potential, taken, given; /* energies and works at the last balance, J */
  double lost, jump;   /* unexplained energy at the last balance, and its largest change between two, J */
  double seen;         /* time of the last balance, s */
  double most, terms;  /* largest kinetic energy; largest sum of all terms, which sets round-off, J */
  double power;        /* largest power of a pair's friction, W */
  double gap;          /* residual of the loops' positions after the last projection, relative */
  double size[TR_LAWS], pair[TR_LAWS]; /* figures of the present step, which may still be refused */
  tr_judgement all;    /* figures of all accepted steps */
} tr_audit;

/* Offsets of the arrays, in doubles behind the struct (tr_lay_out). "A pair each": one number for every friction pair. */
typedef struct tr_places {
  int p, c, co, cj; /* parameters; constants of the kernel, of the outputs, of the Jacobian unit */
  int x;            /* signals: moment, tables, stop flags, modes */
  int y, ynew, yold, ytmp, yout, dy; /* states: at `t`, after and before the step, of a stage, of a row or probe; ẏ evaluated last */
  int event_y;      /* state at an event; directions of open reactions */
  int K, kstep;     /* slopes of the stages; rows of the dense output */
  int power, work;  /* powers evaluated last; works of the step up to a row inside it */
  int part_power, impulse_work; /* powers of the last part of an impulse step; works of all such steps, then with the present one */
  int w, maps;      /* stage 1 of the kernel: values for stage 2; affine maps (``base/affine_maps.h``) */
  int dy_unforced;  /* ẏ without impulses, at the state of the last impulses */
  int z, zold;      /* multipliers, now and at the start of the step (for a refused trial) */
  int zstart, zend; /* multipliers at the start and the end of the last step made; roots inside lie between them */
  int zbeyond;      /* multipliers at the end of that step, on a branch that ended at an event inside */
  int scale;        /* units of the tolerance, one for each state */
  int d, S, perm;   /* S of the loops: row scales, factor, order; then the order of `lu` */
  int T, Np, NN;    /* S⁺Se; reaction components N' = N0' + Ne' η; N */
  int law, dn, sliding; /* results of the laws: η; its derivative by N; one tr_sliding per pair */
  int lu, r;        /* Newton's method on the complement equations: matrix, residual */
  int smin, smax;   /* extremes over the stages of a step, a pair each (tr_update_extremes) */
  int zone;         /* tr_zone a pair each */
  int loop_error;   /* residuals of the loops, then of their rates */
  int ev, breaks, tables; /* event records; break times; tables of signals */
  int open_lambda, gram, open_kappa; /* open reactions: directions of λ, work space, scaled reactions */
  int light_S, light_Z, light_D, light_P; /* rows of light freedoms: S of the other rows, S⁻¹ C, D − Cᵀ S⁻¹ C and its order */
  int openV, openQ, openN, openG; /* open directions where joints on loops rub: λ, the springs' loads Q, N, QᵀQ */
  int open_amounts, openY; /* amount of each open direction; its derivative by η */
  int openF, openP, openB, openE; /* matrix of their equations and its order; Qᵀ ∂δ/∂N; ∂N/∂η with them */
  int more, dmore;  /* δ, change of the springs' loads by friction; its derivative by N */
  int post_memory;  /* tr_memory for each column that is finished afterwards */
  int Q, row_kind, leaders, share; /* q̈ = Q0 + Qe η of the sliding freedoms; TR_ROW_… and tr_leader a multiplier each; shares */
  int pair_class, class_rates; /* class of coupled pairs (int, a pair each; 0: none; else 1 + its multiplier); rates of the class */
  int yeval, dyeval; /* recursion (``friction/newton_recursive.c``): the current state and its ẏ */
  int moves, dlaw, pivots, less, borne, acc; /* recursion: inputs and outputs of the kernel */
  int impending_law, impending_dlaw; /* the law in the impending motion of a group, and its derivative by N */
  int impending;    /* balls of such groups: unit axis of that motion, at the places of their rates */
  int hold, dhold;  /* tr_hold a pair each; derivatives of the capacities by N */
  int past_speeds, stopping; /* speeds of pairs at the ends of the last steps; marks (int, a pair each) of pairs that stop with the captured one */
  int lever, capture_tried; /* levers of the multipliers; speed at which capture last failed, m/s, a pair each */
  int speed_errors; /* errors of the pairs' speeds, m/s, a pair each: of the last trial step, then of all steps */
  int violations;   /* violations of pairs and stops: now, at the start and at the end of the step */
  int contacts, contact_peaks; /* contacts at the last accepted state; largest force of each so far, N, fading */
  int indicators, end_speed, saved_modes; /* model exchange: indicators and counts of events; speeds that end sliding, m/s; modes before an event */
  int jac, jw, jp, W, wperm, choice_jac; /* stiff method: Jacobian, its multiplier part, its point, matrix, order; Jacobian of the choice */
} tr_places;

/* The host's cancellation, asked every few milliseconds of work. */
typedef struct tr_asking {
  int (*host)(void); /* returns 1 to cancel; 0: no host */
  double work;       /* multiplications since the last question */
  int cancelled;     /* the run is cancelled: every search ends without a result */
} tr_asking;

/* Bounds on the statistics of a bounded step (``stepping/realtime_steps.c``). */
typedef struct tr_bounding {
  long evaluations, iterations; /* 0: no bound */
  long index;                   /* bounded steps since the start of the run */
  int overrun;                  /* outcome of the last one: TR_OVERRUN_… */
} tr_bounding;

typedef struct tr_sim {
  size_t bytes; /* of the whole block */
  const tr_kernel *k;
  const tr_outputs *o;  /* 0: no columns */
  const tr_jacobian *j; /* 0: none, or not yet */
  int ny;               /* nq + nv + nb: numbers of the state without integrals */
  int nworks, naudit;   /* integrals: works that columns need; sums of the audit (energy taken, energy given) */
  tr_settings set;
  tr_clock clock;
  tr_stepping step;
  tr_waiting pending;
  tr_loops loops;
  tr_friction friction;
  tr_moreau moreau;
  tr_events events;
  tr_audit audit;
  tr_stats stats;
  tr_asking ask;
  tr_bounding bound;
  tr_lane *lane; /* lane that serves its requests; 0: none */
#ifdef TR_DEBUG
  int valid; /* parts that belong to the current state: TR_HAS_… */
#endif
  tr_places at;
} tr_sim;

/* Bytes before the arrays; each array starts at a multiple of a vector's size if the block does. */
#define TR_HEAD ((sizeof(tr_sim) + 63) / 64 * 64)
/* An array of the block. */
#define TR_A(s, field) ((double *)((char *)(s) + TR_HEAD) + (s)->at.field)
#endif
