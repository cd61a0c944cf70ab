"""Records of a batch, in which one call runs many cases of one structure."""

from trunnion.runtime.abi import run_records
from trunnion.runtime.abi.record_definition import Record

EVENT_KINDS = 16
"""Number of event counters: a power of two above the largest EventKind."""

STRANDS = 24
"""Largest number of cases that an ensemble processes at once."""

CASE_SETTINGS = Record("tr_case_settings", "Settings of one case. They replace those of the batch.", """
double rtol
double length
double rate
double until : end of the case, s
double every : spacing of output rows, s; 0: one row a step
double energy
double light : 1: the host examines the inertia after assembly
""")

CASE = Record("tr_case", "Result of a case. One tr_reduced for each column follows it.", f"""
double status : TR_DONE or the reason of failure
double time : time reached, s
double rows : number of output rows
double steps
double detail : result of tr_assemble, if the assembly failed
{run_records.JUDGEMENT.tag} audit : verdict of the audit
double count[{EVENT_KINDS}] : number of events of each kind
double first[{EVENT_KINDS}] : time of the first event of each kind, s; NaN if there is none
double margin : smallest margin of the case's events; INFINITY if there is no event
double marginal : number of events whose margin is below the run's error
""")

REDUCED = Record("tr_reduced", "Reductions of one column over the rows of a case.", """
double max : largest finite value
double min : smallest finite value
double final : last value
double mean : mean of the finite values; while the case runs, their sum
double finite : number of finite values
""")

VARIANT = Record("tr_variant", "Blocks of one variant of a kernel in a batch.", """
const struct tr_sim *fresh : block as prepared by the host
struct tr_sim *plain : working copy
struct tr_sim *full : working copy with the Jacobian unit; 0 until it is made
const tr_jacobian *j : the Jacobian unit
size_t full_bytes : size of `full`, bytes
""")

BATCH = Record("tr_batch", "A batch: many cases of one structure in one call.", """
tr_variant variant[2] : the kernel, then its redundant variant
tr_settings settings : settings of all cases; tr_case_settings replaces some of them
long ncases : number of cases
long at : index of the present case
long examined : 1 + index of the last case whose inertia the host has examined
long capacity : number of rows that `rows` can hold
int ntable : doubles in the tables
int width : doubles in a row
int running : whether the present case has been started
int which : index of the present case's variant
int reported : whether the failure of the present case has been reported
const double *p : parameters, np for each case
const double *y : start state, nq + nv for each case
const double *given : for each case nv flags of positions, then nv flags of rates: 1 if the start value is given
const double *inputs : values of external inputs for each case
const tr_case_settings *set : settings of each case
double *rows : capacity × width
double *out : for each case a tr_case, and a tr_reduced for each column
struct tr_sim *now : the block of the present case
double last : time of the last row, s
double *kept : kept_capacity × (1 + width): index of a case, then its row; 0: rows are not stored
long kept_rows : number of stored rows; the host empties `kept` after each call
long kept_capacity : number of rows that `kept` can hold
struct tr_lane *lane : lane that serves the requests of the batch's cases; 0: no lane
""")

STRAND = Record("tr_strand", "One strand of an ensemble. It steps one case, and takes the next one when this case ends.", """
tr_lane lane
tr_batch *batch : batch of this strand
int running : whether the strand has a case
int state : TR_STRAND_…
""")

ENSEMBLE = Record("tr_ensemble", "Cases of a batch that step together.", """
const tr_lanes *lanes
void (*columns)(tr_request **r, const double *x, const double *y, const double *z, const double *a) : columns in lanes; 0: none
tr_strand *strand : strands
int strands : number of strands, at most TR_STRANDS
long ncases : number of cases
long next : index of the first case that has not started
int *ended : TR_ENDED_… for each case
long finished : number of cases that have ended
long calls : number of calls of `serve`
long asked : number of served requests
""")
