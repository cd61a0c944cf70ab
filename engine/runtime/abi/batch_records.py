"""Records of a batch, in which one call runs many cases of one structure."""

from __future__ import annotations

from trunnion.runtime.abi import run_records
from trunnion.runtime.abi.record_definition import Record

EVENT_KINDS = 16
"""Number of event counters: a power of two above the largest EventKind."""

STRANDS = 24
"""Most cases of an ensemble in progress."""

CASE_SETTINGS = Record("tr_case_settings", "Settings that differ between cases, besides parameters and start values.", """
double rtol
double length
double rate
double until
double every
double energy
""")

CASE = Record("tr_case", "Result of a case; a tr_reduced for every column follows.", f"""
double status : TR_DONE or the reason of failure
double time : time reached, s
double rows : output rows
double steps
double detail : result of tr_assemble, if it failed
{run_records.JUDGEMENT.tag} audit : verdict of the audit
double count[{EVENT_KINDS}] : events by kind
double first[{EVENT_KINDS}] : time of the first of each kind, s; NaN: none
double margin : least margin of its events; INFINITY: none
double marginal : number of margins below the run's error
""")

REDUCED = Record("tr_reduced", "Reductions of one column over the rows of a case.", """
double max : largest finite value
double min : smallest finite value
double final : last value
double mean : mean of the finite values (while the case runs: their sum)
double finite : number of finite values
""")

VARIANT = Record("tr_variant", "Blocks of one variant of a kernel in a batch.", """
const struct tr_sim *fresh : block as prepared by the host
struct tr_sim *plain : working copy
struct tr_sim *full : working copy that has the Jacobian unit; 0: none yet
const tr_jacobian *j : the Jacobian unit
size_t full_bytes : bytes of `full`
""")

BATCH = Record("tr_batch", "A batch: many cases of one structure in one call.", """
tr_variant variant[2] : the kernel, and its redundant variant
tr_settings settings : settings of all cases, partly replaced by tr_case_settings
long ncases : number of cases
long at : the present case
long capacity : rows of the buffer
int ntable : numbers in the tables
int width : numbers of a row
int running : whether the present case has been started
int which : variant of the present case
int reported : whether its failure has been reported
const double *p : parameters, np for each case
const double *y : start state, nq + nv for each case
const double *given : 1 for given start values, else 0: nv positions and nv rates for each case
const double *inputs : values of external inputs for each case
const tr_case_settings *set : settings of each case
double *rows : capacity × width
double *scratch : work space of tr_redundancy
double *out : for each case a tr_case, and a tr_reduced for each column
struct tr_sim *now : the block of the present case
double last : time of the last row, s
double *kept : all rows, each after its case: kept_capacity × (1 + width); 0: rows are not stored
long kept_rows : rows stored; the host removes them after each call
long kept_capacity : capacity of `kept`
struct tr_lane *lane : lane that serves requests of its cases; 0: none
""")

STRAND = Record("tr_strand", "A stack of an ensemble, on which one case after another runs; it waits where it requests.", """
tr_lane lane
tr_request *request : request for which it waits
tr_batch *batch : its batch, one case at a time
struct tr_ensemble *all
void *here : its stack pointer while it waits
void *back : stack pointer of the caller
char *stack : lowest address of its stack
int state : TR_STRAND_…
""")

ENSEMBLE = Record("tr_ensemble", "Cases of a batch that step together.", """
const tr_lanes *lanes
void (*columns)(tr_request **r, const double *x, const double *y, const double *z, const double *a) : columns of rows; 0: none
tr_strand *strand : strands
int strands : number of strands, at most TR_STRANDS
long stack_bytes : bytes of a stack
long ncases : number of cases
long next : first case not started
int *ended : for each case TR_ENDED_…
long finished : cases ended
long calls : calls of `serve`
long asked : requests served
""")
