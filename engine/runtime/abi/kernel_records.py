"""Records of a kernel: sizes, tables and functions of one mechanism."""

from trunnion.runtime.abi.record_definition import Record

STATE = "const double *x, const double *y, const double *c"

ELEMENT = Record("tr_element", "A frictional joint: indices of its reaction components, multipliers and rates.", """
int n0 : first reaction component
int needs : number of reaction components that its friction depends on
int eta0 : first multiplier
int neta : number of multipliers
int rate0 : first rate in the maps
int nrates : number of rates
int dn0 : offset of the element's block in the derivative of the laws
int kappa0 : first of the element's scaled reactions that friction changes
int nmore : number of these scaled reactions (0 unless the joint is on a loop, in the redundant variant)
int more0 : offset of these scaled reactions among those of all elements
int dmore0 : offset of the blocks of the derivatives of these scaled reactions, by the components and then by η
""")

PAIR = Record("tr_pair", "A sliding pair of a frictional joint.", """
int element : index of its joint among the elements
int eta0 : first multiplier
int neta : number of multipliers
int rate0 : first rate in the maps
int nrates : number of rates
int kind : TR_KIND_…
int contact0 : first contact
int ncontacts : number of contacts
int v0 : first rate in the state; -1: its rates are not part of the state
int cone : whether the pair can spin without sliding (a ball)
int stores : whether the law of the pair stores and returns energy
""")

UNILATERAL = Record("tr_unilateral", "A joint that only pushes: its contact begins and ends.", """
int stop : index of its flag among the stops; the flag is TR_STOP_PRESSED while the contact is closed
int row : its constraint row
int pair : its friction pair; -1: none
int poisson : whether restitution follows Poisson's law instead of Newton's
int open : whether the contact starts open
int inside : index, among the stops, of the flag that is pressed while the parts can touch; -1: the parts can always touch
""")

PACE = Record("tr_pace", "A parameter that sets the frequency of a harmonic signal or of a prescribed rotation.", """
int parameter : index among the parameters
double hertz : Hz per unit of the parameter
""")

POST = Record("tr_post", "Post-processing of a column.", """
int kind : TR_POST_…
int column : index
int partner : column on which the post-processing depends
""")

PROGRAM = Record("tr_program", "Bytecode of one function of a scene of parts (engine/parts/bytecode/program.py).", """
int length : length of the code
int scratch : doubles of work space
const int *code : calls of primitives
""")

DIRECTIONS = Record(
    "tr_directions",
    "Forward-mode derivatives in a scene of parts (engine/parts/derivatives/forward_mode.py). Each number that a direction can "
    "change has a vector of tangents. Calls use these vectors in groups, the cells.",
    """
int length : length of the code
const int *code : calls of primitives
int vectors : number of vectors, including zero vectors
int cells : number of cells
const int *cell : (cells + 1) first vector of each cell
int directions : number of directions to choose from
const int *order : (directions) indices of directions; directions with equal effects are adjacent
const int *first : (directions + 1) first seed of each direction
const int *seed : three integers for each seed: vector, cell, index in x of the size of the seed (-1: size 1)
int rows : number of differentiated rows
const int *row : (rows) vector of each row (-1: independent of all directions)
""",
)

PROGRAMS = (
    "prepare", "stage1", "stage2", "laws", "laws_alone", "held", "held_alone", "closure", "events", "energy", "qdot", "eval",
    "contacts", "kappa", "pressed", "begin", "narrow", "respond", "answer", "derive", "point", "shift", "shared",
)  # fmt: skip
"""Functions of a scene of parts, in the order of their programs. Some programs execute ranges of ``shared``."""

SCENE = Record("tr_scene", "A scene of parts: its programs, the primitives that they call, and the constants that they read.",
               "\n".join(f"tr_program {name}" for name in PROGRAMS) + """
const tr_directions *directions : derivatives of the functions that have derivatives
int nc : number of constants
const void *beside : another scene, whose constants follow those of this scene (for the columns of a linear unit)
const double *constants
void (**op)(double *const *operands, const int *numbers) : primitives by their number in the code
""")

KERNEL = Record("tr_kernel", "The stepping unit of a mechanism: sizes, tables, functions. State y: q (nq), v (nv), states of "
                "friction laws (nb; friction ratios); the runtime appends integrals of powers. "
                "The unit is independent of the columns.", f"""
int abi : must be TR_ABI
int nq : coordinates
int nv : rates
int nb : states of friction laws
int nx : signals
int np : parameters
int nc : constants
int nw : values that stage 1 passes to stage 2
int nmaps : doubles of the maps
int rows : number of constraint rows
int active : number of constraint rows that are not structurally empty
int neta : multipliers of friction
int nn : reaction components
int nrates : rates in the maps, with states of friction laws
int npowers : powers computed with ẏ, W
int ntaken : number of powers that take energy (friction, dampers); these come first
int nsliders : sliding pairs
int nstops : stops
int nlatches : stops that are hooks of latches; these come last
int nunilateral : joints that only push
int npositions : positions in curves and fields that steps must resolve
int ntables : tables of signals
int nquat : quaternions
int nelements : frictional joints
int npaces : periodic loads
int nlight : active rows of light freedoms, which follow all other rows
int nbodies : bodies
int ndn : entries of the derivative of the laws
int nkappa : scaled reactions (redundant variant)
int nmore : scaled reactions that friction changes
int ndmore : entries of the derivatives of these scaled reactions by the reaction components and by η
int loop_friction : whether a joint on a loop has friction
int coupled : whether inactive rows affect the choice of reactions
int sets : whether some law is set-valued at rest
int nS : doubles of S in the maps
int nfill : structural entries below the diagonal of the factor of S; 0: dense
int c_closure : offset of the constants of closure
int c_laws : offset of the constants of laws
int c_events : offset of the constants of events
int c_held : offset of the constants of held
int c_energy : offset of the constants of energy
int c_pressed : offset of the constants of pressed
const int *active_rows : (active) indices of the active rows
const int *row_kind : (rows) TR_CONSTRAINS_…
const int *qkind : (nq) TR_COORDINATE_…
const int *vkind : (nv) TR_COORDINATE_…
const int *quat : (nquat) offsets of quaternions in q
const int *down : (nlatches) tooth that the latch engages at the start, at any position (0: disengaged)
const int *presses : (nlatches) stop whose depth shows whether the latch is pressed
const int *fill_order : (active) rows of λ in the order of pivots (engine/system/structure/loop_matrix_fill.py)
const int *fill_start : (active + 1) first entry below each pivot
const int *fill_below : (nfill) rows of these entries, in the order of pivots
const int *fill_at : (active + nfill) index in S of the diagonal entry of each pivot, and of these entries; -1: zero
const int *fill_row : (active + 1) first entry of each row of the factor, in the order of pivots
const int *fill_pivot : (nfill) pivots of these entries
const int *fill_entry : (nfill) indices of these entries in fill_below
const tr_element *element : (nelements)
const tr_pair *pair : (nsliders)
const tr_pace *pace : (npaces)
const tr_unilateral *unilateral : (nunilateral)
const void *scene : tr_scene of a kernel of parts, else 0
void (*prepare)(const void *scene, const double *p, double *c) : constants from parameters
void (*stage1)({STATE}, double *w, double *maps, double *dy, double *power) : maps; without multipliers, ẏ and powers, too
void (*stage2)({STATE}, const double *w, const double *z, double *dy, double *power) : ẏ and the powers
void (*laws)(const double *N, const double *r, const double *x, const double *c, double *e, double *dN, double *v) : η = law(N)
void (*laws_alone)(const double *N, const double *r, const double *x, const double *c, double *e, double *v) : laws without dN
void (*held)(const double *N, const double *u, const double *x, const double *c, double *hold, double *dN) : tr_hold of each pair
void (*held_alone)(const double *N, const double *u, const double *x, const double *c, double *hold) : held without dN
void (*pressed)(const double *N, const double *r, const double *u, const double *x, const double *c, double *more, double *dN) : δ
void (*closure)({STATE}, double *h) : residuals of the loops, then of their rates
void (*events)({STATE}, double *g) : depth of every stop, then its distance from release (unilateral: −gap, restitution), positions
void (*qdot)(const double *y, const double *v, const double *c, double *dq) : coordinate rates
void (*energy)({STATE}, double *out) : kinetic and potential energy, J; 0: unknown
void (*begin)({STATE}, double *w, double *maps, double *dy) : motion and rates, for recursive friction; else 0
void (*narrow)(const double *c, double *w, const double *moves, const double *dN, double *pivots) : inertias with dN = ∂law/∂N
void (*respond)(const double *c, double *w, const double *less, double *N, double *borne, double *acc) : less = −e (η = e + dN N)
void (*answer)(const double *c, double *w, const double *less, double *N, double *acc) : less = [−η | λ]; acc: also row residuals
void (*shift)(const double *c, double *w, const double *gap, double *dv) : many loops, after narrow: dv changes the rows by −gap
void (*derive)({STATE}, double *w, const double *z, double *dy, double *power) : after begin: ẏ except rates of coordinates
""")

OUTPUTS = Record("tr_outputs", "The unit of columns. a holds the accelerations of the free rates (nv) at this state.", f"""
int abi : must be TR_ABI
int nout : columns
int ncontacts : contacts
int nc : constants
int nkappa : scaled reactions
int npost : columns with post-processing
int energy : column of energy.residual; -1: none
int works : whether columns need integrals of the powers
int wants : bits TR_WANTS_…
int nloops : cut joints and couplings
const int *loop_rows : (nloops + 1) first constraint row of each loop (engine/system/structure/redundant_loop_groups.py)
const int *loop_group : (nloops) group of each loop; the loops of a group share no joint
const int *share_start : (nloops + 1) first entry of each loop in share_at
const int *share_at : scaled reactions that the multipliers of each loop change
const tr_post *post : (npost)
const void *scene : tr_scene of a unit of parts, else 0
void (*prepare)(const void *scene, const double *p, double *c) : constants from parameters
void (*eval)({STATE}, const double *z, const double *a, const double *extra, double *out) : the columns
void (*contacts)({STATE}, const double *z, const double *a, double *out) : tr_contact of each contact
void (*kappa)({STATE}, const double *z, const double *a, double *out) : the scaled reactions
""")

JACOBIAN = Record("tr_jacobian", "Derivative of [F; R; scaled reactions (nkappa); their change by friction (nmore)] by [y, t, z], "
                  "column-major. F is ẏ, R are the residuals of the multipliers. `eval` gives all columns, `point` and then "
                  "`along` single columns.", f"""
int abi : must be TR_ABI
int nc : constants
int nw : values that `point` stores
const void *scene : tr_scene of a unit of parts, else 0
void (*prepare)(const void *scene, const double *p, double *c) : constants from parameters
void (*eval)({STATE}, const double *z, double *w, double *J) : all columns, with work space of nw; 0: use `point` and `along`
void (*point)({STATE}, const double *z, double *w) : values at a point
void (*along)({STATE}, const double *z, const double *w, const double *seed, double *J) : derivative along a direction
""")

LINEAR = Record("tr_linear", "Directional derivatives. The seed of F = ẏ and of the multiplier residuals R is [inputs (a tr_signal "
                "each), y, z]. The seed of the columns is [inputs, y, z of all rows, accelerations].", f"""
int abi : must be TR_ABI
int nc : constants
int ninputs : external inputs
const void *scene : tr_scene of a unit of parts, else 0
void (*prepare)(const void *scene, const double *p, double *c) : constants from parameters
void (*rates)({STATE}, const double *z, const double *seed, double *out) : derivatives of F and R
void (*columns)({STATE}, const double *z, const double *a, const double *seed, double *out) : derivatives of the columns
""")
