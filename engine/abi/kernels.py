"""What a kernel says about a mechanism: its sizes, its tables and its functions."""

from __future__ import annotations

from engine.abi.records import Record

STATE = "const double *x, const double *y, const double *c"

ELEMENT = Record("tr_element", "A frictional joint: where its reaction components, multipliers and rates lie.", """
int n0 : its first reaction component
int needs : how many its forms use
int eta0 : its first multiplier
int neta : how many
int rate0 : its first rate in the maps
int nrates : how many
int dn0 : where its block of the law's derivative begins
int kappa0 : the first of its scaled reactions that friction changes
int nmore : how many (0 unless it sits on a loop, in the redundant variant)
int more0 : where they begin among all that friction changes
int dmore0 : where their derivative's block begins
""")

PAIR = Record("tr_pair", "A sliding pair of a frictional joint.", """
int element : its joint's place among the elements
int eta0 : its first multiplier
int neta : how many
int rate0 : its first rate in the maps
int nrates : how many
int kind : TR_KIND_…
int contact0 : its first contact
int ncontacts : how many
int v0 : its first rate among those of the state, -1 where it has none there
int cone : whether it can turn without sliding (a ball)
int stores : whether its law stores energy, which it gives back
""")

PACE = Record("tr_pace", "A parameter that says how fast a load comes and goes.", """
int parameter : its place among the parameters
double hertz : Hz per unit of it
""")

POST = Record("tr_post", "What is done with a column after its value is known.", """
int kind : TR_POST_…
int column : which
int partner : the column it depends on
""")

TAPE = Record("tr_tape", "What one function of a scene of parts does (engine/parts/tape.py).", """
int length : of the code
int scratch : doubles it works with
const int *code : calls
""")

DIRECTIONS = Record("tr_directions", "How directions are followed in a scene of parts (engine/parts/directions.py): vectors beside "
                    "numbers, in cells that calls use together.", """
int length : of the code
const int *code : calls
int vectors : how many, those that stay zero among them
int cells : how many
const int *cell : cells + 1: where each begins
int directions : how many there are to choose from
const int *order : directions: those that change alike behind each other
const int *first : directions + 1: where what each changes begins
const int *seed : three numbers each: vector, cell, where in x its size is (-1: one)
int rows : of what is derived
const int *row : rows: their vectors (-1: no direction reaches it)
""")

SCENE = Record("tr_scene", "A scene of parts: its tapes, the functions they call, the constants they read.", """
tr_tape prepare
tr_tape stage1
tr_tape stage2
tr_tape laws
tr_tape laws_alone
tr_tape held
tr_tape held_alone
tr_tape closure
tr_tape events
tr_tape energy
tr_tape qdot
tr_tape eval
tr_tape contacts
tr_tape kappa
tr_tape pressed
tr_tape begin
tr_tape narrow
tr_tape respond
tr_tape answer
tr_tape derive
tr_tape point
tr_tape shift
const tr_directions *directions : of what has derivatives
int nc : constants
const void *beside : another scene, whose constants lie behind (of the columns of a linear unit)
const double *constants
void (**part)(double *const *places, const int *numbers) : functions by their number in the code
""")

KERNEL = Record("tr_kernel", "The stepping unit of a mechanism: sizes, tables, functions. State y: q (nq), v (nv), states of "
                "friction laws (nb; friction ratios); behind it the runtime carries integrals of the powers. "
                "The same whatever columns are asked for.", f"""
int abi : must be TR_ABI
int nq : coordinates
int nv : rates
int nb : states of friction laws
int nx : signals
int np : parameters
int nc : constants
int nw : values stage 1 keeps for stage 2
int nmaps : numbers of the maps
int rows : constraint rows
int active : those that are not structurally empty
int neta : multipliers of friction
int nn : reaction components
int nrates : rates in the maps, states of friction laws included
int npowers : powers beside the derivative, W
int ntaken : how many of them take energy (friction, dampers): the first ones
int nsliders : sliding pairs
int nstops : stops
int nlatches : how many of them say whether a latch is down: the last ones
int ntables : tables of signals
int nquat : quaternions
int nelements : frictional joints
int npaces : loads that come and go
int nbodies : bodies
int ndn : numbers of the law's derivative
int nkappa : scaled reactions (redundant variant)
int nmore : how many of them friction changes
int ndmore : numbers of their derivative by the reaction components
int loop_friction : whether friction sits on a loop
int coupled : whether inactive rows matter to the choice of reactions
int sets : whether some law is set-valued at rest
int nfill : entries below the diagonal of the factor of S by structure; 0: it is dense
int c_closure : where the constants of closure begin
int c_laws : of the laws
int c_events : of the events
int c_held : of what is held
int c_energy : of the energies
int c_pressed : of what friction changes in the scaled reactions
const int *active_rows : active: indices of the rows
const int *row_kind : rows: TR_CONSTRAINS_…
const int *qkind : nq: TR_COORDINATE_…
const int *vkind : nv: TR_COORDINATE_…
const int *quat : nquat: offsets in q of quaternions
const int *down : nlatches: on which tooth a latch begins down, wherever it is (0: up)
const int *presses : nlatches: which stop says whether it is pressed
const int *fill_order : active: rows of λ in the order of their pivots (engine/system/coupling.py)
const int *fill_start : active + 1: where the entries below each pivot begin
const int *fill_below : nfill: their places in that order
const tr_element *element : nelements
const tr_pair *pair : nsliders
const tr_pace *pace : npaces
const void *scene : of a kernel that is made of parts, else 0
void (*prepare)(const void *scene, const double *p, double *c) : constants from parameters
void (*stage1)({STATE}, double *w, double *maps, double *dy, double *power) : maps; without multipliers what stage 2 writes
void (*stage2)({STATE}, const double *w, const double *z, double *dy, double *power) : ẏ, and the powers
void (*laws)(const double *N, const double *r, const double *x, const double *c, double *e, double *dN, double *v) : η = law(N)
void (*laws_alone)(const double *N, const double *r, const double *x, const double *c, double *e, double *v) : without derivative
void (*held)(const double *N, const double *u, const double *x, const double *c, double *hold, double *dN) : what rest can hold
void (*held_alone)(const double *N, const double *u, const double *x, const double *c, double *hold) : without derivative
void (*pressed)(const double *N, const double *r, const double *x, const double *c, double *more, double *dN) : δ of friction
void (*closure)({STATE}, double *h) : residuals of the loops, then their rates
void (*events)({STATE}, double *g) : depth of every stop
void (*qdot)(const double *y, const double *v, const double *c, double *dq) : coordinate rates
void (*energy)({STATE}, double *out) : kinetic and potential energy, J; 0: not known
void (*begin)({STATE}, double *w, double *maps, double *dy) : of parts that rub (a tree, many loops): motion, rates; else 0
void (*narrow)(const double *c, double *w, const double *moves, const double *dN, double *pivots) : inertias with ∂law/∂N
void (*respond)(const double *c, double *w, const double *less, double *N, double *borne, double *acc) : with −e; λ behind borne
void (*answer)(const double *c, double *w, const double *less, double *N, double *acc) : [−η | λ] given; rows' gaps last
void (*shift)(const double *c, double *w, const double *gap, double *dv) : many loops, after narrow: rows change by −gap
void (*derive)({STATE}, double *w, const double *z, double *dy, double *power) : ẏ behind the coordinates' rates, after it
""")

OUTPUTS = Record("tr_outputs", "The unit of columns. a: accelerations of the free rates (nv) at this state.", f"""
int abi : must be TR_ABI
int nout : columns
int ncontacts : contacts
int nc : constants
int nkappa : scaled reactions
int npost : columns that are treated afterwards
int energy : column of energy.residual, -1 without
int works : whether columns ask for integrals of the powers
int wants : bits TR_WANTS_…
const tr_post *post : npost
const void *scene : of a unit that is made of parts, else 0
void (*prepare)(const void *scene, const double *p, double *c) : constants from parameters
void (*eval)({STATE}, const double *z, const double *a, const double *extra, double *out) : the columns
void (*contacts)({STATE}, const double *z, const double *a, double *out) : tr_contact of each
void (*kappa)({STATE}, const double *z, const double *a, double *out) : the scaled reactions
""")

JACOBIAN = Record("tr_jacobian", "[F; R; scaled reactions (nkappa); what friction changes in them (nmore)] by [y, t, z], "
                  "column-major: all at once, or the point and then columns one by one.", f"""
int abi : must be TR_ABI
int nc : constants
int nw : values the point keeps
const void *scene : of a unit that is made of parts, else 0
void (*prepare)(const void *scene, const double *p, double *c) : constants from parameters
void (*eval)({STATE}, const double *z, double *w, double *J) : all columns, with room for the point (0: one by one)
void (*point)({STATE}, const double *z, double *w) : the point
void (*along)({STATE}, const double *z, const double *w, const double *seed, double *J) : a direction
""")

LINEAR = Record("tr_linear", "Directional derivatives: of F = ẏ and the multiplier residuals R along a seed of [inputs "
                "(a tr_signal each), y, z], and of the columns along a seed of [inputs, y, z of all rows, accelerations].", f"""
int abi : must be TR_ABI
int nc : constants
int ninputs : external inputs
const void *scene : of a unit that is made of parts, else 0
void (*prepare)(const void *scene, const double *p, double *c) : constants from parameters
void (*rates)({STATE}, const double *z, const double *seed, double *out) : of F and R
void (*columns)({STATE}, const double *z, const double *a, const double *seed, double *out) : of the columns
""")
