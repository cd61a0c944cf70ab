/* Trunnion runtime: what a simulation is.
 *
 * A kernel (one per scene structure) is a constant table of sizes and functions (``tr_abi.h``, generated). A simulation is one
 * relocatable block: the struct ``tr_sim`` followed by its arrays, which are found by offset; copying the block copies the state.
 * Nothing here allocates, prints or exits.
 */
#ifndef TR_H
#define TR_H
#include "tr_abi.h"

/* Whether events of a kind are of stops and latches, not of sliding pairs. */
#define TR_IS_OF_STOP(kind) ((kind) == TR_EV_STOP_ON || (kind) == TR_EV_STOP_OFF || (kind) == TR_EV_LATCH || (kind) == TR_EV_UNLATCH)

/* Where the run is and what it writes. */
typedef struct tr_clock {
  double t;                /* time of the state in `y`, s */
  double start, stop;      /* of the run, s */
  double every, row_next;  /* spacing of the output rows and time of the next one, s; every 0: a row a step */
  long row_index;          /* rows written so far */
  int width;               /* numbers of a row, time included */
  int nbreaks, next_break; /* times at which a step has to end: how many, and the first that is still ahead */
  int status;              /* TR_OK while the run goes on */
} tr_clock;

/* Maps of a state: none yet (``recursive.c``); those of the kernel; from these those of loads, and of what may be held, without loops. */
enum { TR_MAPS_NONE, TR_MAPS_RAW, TR_MAPS_OF_LOADS, TR_MAPS_HELD };

/* The step that is being made, and what steps remember from one to the next. */
typedef struct tr_stepping {
  double h;            /* size the next trial step is to have, s; 0: to be found */
  double h_slip;       /* size before a pair entered its proportional zone, taken up again behind it; 0: none */
  double t0, size;     /* begin and length of the last accepted step, s */
  double err_old;      /* error of the last accepted step, 1 at the tolerance; 0: none yet */
  double jac_t;        /* time the Jacobian in place belongs to, s */
  double works;        /* error of the works of columns in the last accepted step, 1 at the tolerance, */
  double worked;       /* part of it up to which they are integrated for rows; 0: none */
  int parts;           /* they are integrated in parts (``works.c``) */
  int method;          /* in force: its number; never that of method auto */
  int have_k1;         /* the first row of K belongs to the state in `y` */
  int missed;          /* the last step was made anew up to an event that it then did not reach */
  int have_dense;      /* the rows of the dense output belong to the last accepted step */
  int dense_rows;      /* how many of them there are */
  int have_jac;        /* the Jacobian in place may be used at jac_t */
  double margin;       /* of the state in `y`: how far the worst pair or stop is beyond its mode (``tr_beyond``); not a number: not known */
  double margin_end;   /* the same at the end of the last step that was made, or where modes were last decided */
  int far_known;       /* how far pairs are beyond their modes is known at the start of the step (``margin.c``) */
  int mapped;          /* which maps of the state that was evaluated last are in place: TR_MAPS_… */
  int along;           /* the multipliers in z were found without them, and `acc` and NN belong to them */
  int loaded;          /* behind the multipliers in z are the loads that they cause (``tr_loads``) */
  int watch;           /* the right-hand side notes how near pairs come to the end of their modes */
  int trouble;         /* why the last evaluation or projection failed: a status */
  int stiff_count, nonstiff_count, kink_count; /* steps in a row that speak for one method or the other (``tr_choose``) */
  double moved_t;      /* time up to which the run has got on, s (``tr_stalls``), and how many trial steps it had made then */
  long moved;
  int aside;           /* steps that the stiff method should make are made explicitly for now (``tr_step_aside``) */
} tr_stepping;

/* An accepted step that waits to be completed: rows inside it are written first. */
enum { TR_NOTHING, TR_WHOLE_STEP, TR_STEP_TO_EVENT, TR_IMPULSE_STEP };
typedef struct tr_waiting {
  int kind;      /* one of the above */
  int which;     /* at an event: the pair or stop it is about */
  int captured;  /* at an event: it is the last stretch of that pair's sliding (``tr_step_capture``) */
  int cut;       /* its length was cut by the limit of the call, not chosen by the error control */
  int noted;     /* reversals inside it have been noted */
  double theta;  /* where it ends, as part of the step that was made: 1 whole */
  double t;      /* where it ends, s */
  double h;      /* length of the step that was made, s */
  double grow;   /* factor by which the next step is to be longer */
} tr_waiting;

/* Rank of the loops' equations. */
typedef struct tr_loops {
  int rank;            /* at accurate states: the largest found */
  int rank_now;        /* of the factor in place, */
  int sparse;          /* and whether that is one by structure (``sparse.c``) */
  int open;            /* directions of reactions that friction decides on (``pressed.c``) */
  double least_pivot;  /* smallest pivot within the rank when that was found */
  double apart;        /* root of the smallest pivot of the factor that was made along the recursion (``recursive.c``); 0: by maps */
  int known;           /* how far from singular (``singular.c``) the loops are at the start of the step: */
  double begin, end;   /* there and at its end */
  double least, trend; /* the least at its stages; change in the last step, 1/s */
} tr_loops;

#define PAST 4 /* ends of steps at which speeds are kept (``capture.c``) */

/* Pairs under set-valued laws. */
typedef struct tr_friction {
  int still;           /* pairs held at rest */
  int shares;          /* whether some of them share their load as a group */
  int sparing;         /* loads of large groups are shared anew, so that no pair is asked for more than it must be */
  int kept;            /* loads of groups of any size are kept: shared by the rule they have no answer */
  int anywhere;        /* friction is sought from all starts there are: else the run would end */
  double eased;        /* part of friction that is left out for the moment (``starts.c``) */
  double searched;     /* time at which all has been tried, s */
  int failed;          /* the pair at whose event a decision has failed; -1: none */
  double folded;       /* time at which a fold was last passed, s, */
  int folds;           /* and how many soon after each other */
  double resumed_t;    /* time at which a failure was last passed, s, */
  int resumed;         /* and how often there */
  int by_law;          /* balls of stuck groups share by the friction of the motion that impends */
  double pace;         /* frequency of the fastest load that comes and goes, Hz */
  long work;           /* iterations up to which the decision about many pairs that is being made may go; 0: no bound */
  int undecided;       /* the last decision found no answer and did not exclude one */
  int freed;           /* pair whose friction is left out for the moment (``tr_stumbling_pair``); -1: none */
  int missed;          /* pair whose turning, or the error of whose direction, has cut the steps; -1: none */
  int capture;         /* pair about to come to rest, in a step of its own; -1: none */
  double capture_h;    /* length of that step, s */
  double past_t[PAST]; /* ends of the last steps, the newest first, s; not a number: there was none, or an event since */
} tr_friction;

/* Time stepping by impulses, and when to hand over to it. */
typedef struct tr_moreau {
  double h;            /* step of impulses while they are solved, s; 0 otherwise */
  double decides;      /* steps up to this length decide anew where the modes in force lead to none that fit, s */
  int keeps;           /* modes are those in force, whether they fit or not */
  int frozen;          /* directions of fast sliding of several components are frozen over a step */
  double burst_t;      /* begin of the window in which events are counted, s */
  double first_t;      /* first hand-over, s; -1: none */
  double failed_t;     /* where no step could be made, s */
  long burst_events;   /* events before that window */
  int steps, calm;     /* impulse steps since the hand-over, and those of them in a row that changed no mode */
} tr_moreau;

/* Events that wait to be read, and the last one. */
typedef struct tr_events {
  int count, capacity; /* records in the buffer, and room there */
  int chatter;         /* events in a row at (nearly) the same time */
  double chatter_t;    /* that time, s */
  double margin;       /* of what is told next (``margin.c``), */
  int unsure;          /* whether that is below the run's own error, or what decides it crosses so slowly that its time is not known */
  tr_last last;
} tr_events;

/* What certifies the run, and why it failed. */
typedef struct tr_audit {
  double contraction, complement; /* largest so far */
  double open_t;       /* first decision with several answers, s; -1: none */
  int open_pair;       /* the pair it was about */
  int fail_detail;     /* component or constraint row the failure is about; -1: none */
  double fail_number;  /* how independent the rows still were; -1: not the reason */
  double energy0;      /* energy.residual at the start, J */
  int known;           /* the works of every step so far are integrated */
  double begin;        /* kinetic + potential energy − works at the start, J; moved where the energy changes with reason */
  double kinetic, potential, taken, given; /* energies and works at the last look, J */
  double lost, jump;   /* unaccounted for at the last look, and its largest change between two looks, J */
  double seen;         /* time of that look, s */
  double most, terms;  /* largest kinetic energy; largest sum of all terms: its round-off is no loss, J */
  double power;        /* largest power of friction of a pair, W */
  double gap;          /* of the loops' positions after the last projection, relative */
  double size[TR_LAWS], pair[TR_LAWS]; /* figures of the step just made, which may still be refused */
  tr_judgement all;    /* of all accepted steps */
} tr_audit;

/* Where the arrays begin, in doubles behind the struct (``tr_layout``). */
typedef struct tr_places {
  int p, c, co, cj; /* parameters; constants of the kernel, the outputs and the Jacobian unit */
  int x;            /* signals: moment, tables, stop flags, modes */
  int y, ynew, yold, ytmp, yout, dy; /* states: at `t`, after the step, before it, of a stage, of an output or a probe; ẏ of the last evaluation */
  int cand;         /* state at an event; directions of open reactions */
  int K, kstep;     /* slopes of the stages; rows of the dense output */
  int power, work;  /* powers of the last evaluation; works of the step up to a row inside it */
  int parted, impulsed; /* powers of the last part of a step of impulses; works of all such steps, and with the one at hand (``impulses.c``) */
  int w, maps;      /* stage 1: what it keeps, what it says about the multipliers; */
  int unmoved;      /* ẏ of the state at which impulses were last given, without them */
  int z, zold;      /* multipliers, now and where a step that is refused begins anew */
  int zstart, zend; /* those at the start and at the end of the last step that was made: between them roots are followed inside it */
  int zbeyond;      /* those at its end, beyond an event up to which a branch was followed that ends there */
  int scale;        /* units of the tolerance, a state each */
  int d, S, perm;   /* S of the loops: row scales, factor, order (and behind it that of `lu`) */
  int T, Np, NN;    /* S⁺Se; reaction components N' = N0' + Ne' η; N */
  int law, dn, sliding; /* of the laws: η, its derivative, tr_sliding a pair */
  int lu, r;        /* Newton on the complement equations: matrix, residual */
  int smin, smax;   /* extremes over the stages of a step, a pair each */
  int zone;         /* tr_zone a pair */
  int h_res;        /* residuals of the loops and their rates */
  int ev, breaks, tables; /* event records; break times; tables of signals */
  int nul, gram, kap; /* open reactions: directions, least squares, their scaled reactions */
  int openV, openQ, openN, openG; /* open directions where joints on loops rub: λ, the springs' loads Q, N; QᵀQ */
  int amounts, openY;  /* how much of each; its derivative by η */
  int openF, openP, openB, openE; /* matrix of their equations and its order; Qᵀ ∂δ/∂N; ∂N/∂η with them */
  int more, dmore;     /* δ, what friction changes in the springs' loads; its derivative */
  int wrap;         /* tr_memory of each column treated afterwards */
  int Q, rowk, lead, share; /* freedoms at rest: q̈ = Q0 + Qe η; how each is found (int); tr_leader each; shares */
  int bound, line;  /* int a pair: its class (``bound.c``), the multiplier it is named by and 1; 0: none; rates of the class */
  int yeval, dyeval; /* friction along the recursion (``recursive.c``): the state evaluated last; */
  int moves, dlaw, pivots, less, borne, acc; /* what of it the kernel is handed and hands back */
  int limit, dlimit; /* the law in that motion, and its derivative */
  int impend;       /* balls of such groups: unit axis of their turning in that motion, in the places of their rates */
  int hold, dhold;  /* what is held: tr_hold a pair, derivative of the capacity */
  int past, ends;   /* speeds of pairs at the ends of the last steps; int a pair: it stops with the one whose last stretch is made (``capture.c``) */
  int arm, vmin;    /* levers of the multipliers; speed at which capture was last tried in vain */
  int stray;        /* errors of pairs' speeds, m/s, as steps estimate them: of the last trial step, and of all of them (``margin.c``) */
  int far;          /* how far pairs and stops are beyond their modes: now, at the start and at the end of the step */
  int con;          /* contacts at the last accepted state */
  int told, slow, modes; /* of an importer's steps (``told.c``): what tells when modes end, how often they did; speeds that end sliding, m/s; modes as they were */
  int jac, jw, jp, W, wperm, jch; /* the stiff method: Jacobian, multiplier part, its point, matrix and order; of the choice of reactions */
} tr_places;

/* A host that wants to be asked, every few milliseconds of work, whether what is going on is to be given up. */
typedef struct tr_asking {
  int (*host)(void); /* 1: give it up; 0: nobody is asked */
  double work;       /* multiplications since it was last asked */
  int stop;          /* it has said so: nothing is sought any more */
} tr_asking;

/* A bounded step (``bounded.c``): counts of the statistics at which the work at hand ends. */
typedef struct tr_bounding {
  long evaluations, iterations; /* 0: no bound */
  long index;                   /* bounded steps since the start of the run */
  int overrun;                  /* how the last one was made, TR_OVERRUN_… */
} tr_bounding;

typedef struct tr_sim {
  size_t bytes; /* of the whole block */
  const tr_kernel *k;
  const tr_outputs *o;  /* 0: no columns */
  const tr_jacobian *j; /* 0: none, or not yet */
  int ny;               /* nq + nv + nb: the state without its integrals, */
  int nworks, naudit;   /* those that columns ask for, and those that the audit looks at: what takes energy, what gives it */
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
  tr_lane *lane; /* where it asks for its steps; 0: it makes them */
  tr_places at;
} tr_sim;

/* Where the arrays begin, bytes: all of them at a multiple of a vector's size, if the block is. */
#define TR_HEAD ((sizeof(tr_sim) + 63) / 64 * 64)
/* An array of the block. */
#define TR_A(s, field) ((double *)((char *)(s) + TR_HEAD) + (s)->at.field)

int tr_reach_bounded(tr_sim *s, double t, double *row);
size_t tr_size(const tr_kernel *k, const tr_outputs *o, const tr_jacobian *j, int nbreaks, int ntable_doubles, int event_capacity);
#endif
