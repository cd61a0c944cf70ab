"""Records of a batch, in which one call runs many cases of one structure."""

from __future__ import annotations

from engine.abi import runs
from engine.abi.records import Record

EVENT_KINDS = 16
"""Kinds of events that are counted apart; a power of two above the largest EventKind."""

STRANDS = 24
"""Cases of an ensemble on their way at one time, at most."""

CASE_SETTINGS = Record("tr_case_settings", "The settings that differ from case to case, besides parameters and start values.", """
double rtol
double length
double rate
double until
double every
double energy
""")

CASE = Record("tr_case", "What became of a case; behind it a tr_reduced for every column.", f"""
double status : TR_DONE or why it failed
double time : it reached, s
double rows : output rows
double steps
double detail : of a start that cannot be assembled: its code
{runs.JUDGEMENT.tag} audit : what the audit says of it
double count[{EVENT_KINDS}] : events by kind
double first[{EVENT_KINDS}] : time of the first of each kind, s; not a number without
double margin : the least of its events that decide how it goes on; infinite without
double marginal : how many of these are below the run's own error
""")

REDUCED = Record("tr_reduced", "The reductions of one column over the rows of a case.", """
double max : largest finite value
double min : smallest finite value
double final : last value
double mean : of the finite values (while the case runs: their sum)
double finite : how many values were finite
""")

VARIANT = Record("tr_variant", "The blocks in which a batch runs one variant of a kernel.", """
const struct tr_sim *fresh : as prepared by the host
struct tr_sim *plain : working copy
struct tr_sim *full : working copy with the Jacobian unit; 0 while there is none
const tr_jacobian *j : the unit
size_t full_bytes : size of that copy
""")

BATCH = Record("tr_batch", "A batch: many cases of one structure in one call.", """
tr_variant variant[2] : as generated, and its redundant variant
tr_settings settings : of all cases; those of a case replace its own
long ncases : how many
long at : the present one
long capacity : rows of the buffer
int ntable : numbers in the tables
int width : numbers of a row
int running : whether the present case has been started
int which : its variant
int reported : whether its failure has been reported
const double *p : parameters, np a case
const double *y : start state, nq + nv a case
const double *given : what of it is given, by rate: nv and nv a case
const double *inputs : external inputs a case
const tr_case_settings *set : one a case
double *rows : capacity × width
double *scratch : for the redundancy of loops
double *out : per case tr_case and a tr_reduced a column
struct tr_sim *now : the block of the present case
double last : time of the last row, s
double *kept : every row, its case before it: kept_capacity × (1 + width); 0 where none are kept
long kept_rows : how many are in it; the host takes them out after each call
long kept_capacity : rows of it
struct tr_lane *lane : where its cases ask for their steps; 0: they make them
""")

STRAND = Record("tr_strand", "A case of an ensemble on its way: a stack of its own, on which it goes on where it asked.", """
tr_lane lane
tr_request *request : what it waits for
tr_batch *batch : it goes through, one case at a time
struct tr_ensemble *all
void *here : its stack pointer while it waits
void *back : the one of who called
char *stack : its lowest place
int state : TR_STRAND_…
""")

ENSEMBLE = Record("tr_ensemble", "Cases of a batch that make their steps together.", """
const tr_lanes *lanes
void (*columns)(tr_request **r, const double *x, const double *y, const double *z, const double *a) : of rows; 0: none
tr_strand *strand : those that are on their way
int strands : how many, at most TR_STRANDS
long stack_bytes : of a stack
long ncases : how many cases there are
long next : the first that nobody has begun
int *ended : of each case TR_ENDED_…
long finished : how many have
long calls : of `serve`
long asked : requests that these served
""")
