"""Records of a run: signals and modes, results of a kernel's functions, inputs and settings, events and verdicts. All records
except settings and statistics contain only doubles."""

from trunnion.runtime.abi.enumerations import AuditLaw
from trunnion.runtime.abi.record_definition import Record
from trunnion.runtime.integrators import METHODS

EVENT_CONTACTS = 6
"""Largest number of contacts of one pair in an event; the cross of a universal joint has four."""

# -- contents of x: the time of evaluation, a signal for each table, a flag for each stop, a mode for each pair --------------------

MOMENT = Record("tr_moment", "Time of an evaluation.", """
double t : time, s
double inside : a time inside the present step, s; selects the branch of ramps and the interval of tables
""")

SIGNAL = Record("tr_signal", "Signal of a table at the time of evaluation.", """
double value : value
double first : first derivative by time
double second : second derivative
double third : third derivative
""")

MODE = Record("tr_mode", "Mode of a sliding pair, frozen within a step.", """
double flag : TR_STUCK, …
double direction[3] : frozen direction: the rates when it was frozen; for a pair with one rate, the sign
double tilt : prescribed tilt of a ball; 0: the tilt follows from the state
""")

# -- results of a kernel's functions --------------------------------------------------------------------------------------------

SLIDING = Record("tr_sliding", "Sliding of a friction pair at a state.", """
double speed : m/s, negative after a reversal of the frozen direction
double border : sliding speed of the law's kink, m/s
double cone : squared sine of a ball's tilt, negative if the ball spins without sliding; 1 if the pair is not a ball
""")

HOLD = Record("tr_hold", "Capacity and friction of a pair at rest.", """
double capacity : largest friction in the present direction, N at the surface
double size : friction needed for rest, N at the surface
double beyond : part of the needed friction that no friction can carry, N
""")

CONTACT = Record("tr_contact", "A contact force of a pair.", """
double force : normal force, N
double vector[3] : the contact's vector, rotated so that its angle is atan2(vector[1], vector[0])
""")

# -- inputs and settings --------------------------------------------------------------------------------------------------------

KNOTS = Record("tr_knots", "Head of a table. n knot times, values and second derivatives (spline) or slopes (Hermite) follow.", """
double kind : TR_TABLE_LINEAR, TR_TABLE_SPLINE or TR_TABLE_HERMITE
double held : 1: constant beyond the ends; 0: straight lines beyond the ends
double n : number of knots
""")

BREAK = Record("tr_break", "A time at which a step must end because a signal has a corner or jumps. Breaks that occur once come "
               "first, in the order of their times.", """
double time : first occurrence, s
double period : distance of the occurrences, s; 0: the break occurs once
""")

INPUT = Record("tr_input", "An external input since its communication point. A motion that follows the input starts from its "
               "present position, and closes the gap with critical damping.", """
double kind : TR_TABLE_INPUT
double followed : whether a motion follows the input
double t0 : the communication point, s
double u[3] : value and first two derivatives at t0
double gap : distance of the motion from the input at t0
double gap_rate : rate of the gap at t0
double bandwidth : rate at which the gap closes, 1/s
double start : value before `begin`
double begin : time from which the input counts, s
""")

SETTINGS = Record("tr_settings", "Settings of a run.", """
double rtol : relative tolerance
double hmax : longest step, s
double hmin : shortest step, s
double hfixed : fixed steps of this size without error control, s; 0: error control
double length : scale of lengths, m
double rate : scale of rates, 1/s
double energy : scale of works, J; 0: works are not under error control
int method : index in trunnion.runtime.integrators.METHODS
int project : whether loops are closed after each step
int locate : whether events are located
int max_steps : largest number of steps of a run; 0: unlimited
int through_jams : whether a jammed pair is stopped by an impact, after which the run continues
int evaluations : largest number of evaluations of the right-hand side in a bounded step; 0: steps are not bounded
int iterations : largest number of iterations of Newton's method in a bounded step
int events : largest number of events located in a bounded step
int brief : whether rows omit the contraction number and the residuals of the audit, which take as long as the rest of a row
""")

STATS = Record("tr_stats", "Statistics of a run.", f"""
long steps : accepted steps
long rejected : refused trial steps
long refused : solutions that violated a law
long rhs_evaluations : evaluations of the right-hand side
long jacobians : evaluations of the Jacobian
long newton_iterations : iterations on the complement equations
long creeps : iterations of creep minimisations, which predict modes and share loads of many pairs
long newton_most : largest number of iterations of one solution
long events : events
long stopped_at_once : phases of impacts whose friction follows from the rates after them
long projections : corrections of positions
long outputs : output rows
long maps : maps formed outside evaluations
long solutions : solutions computed in mode decisions
long stiff : explicit steps at the limit of stability, of an explicit method that the host chose
long by_impulses : bounded steps completed by an impulse step
long relaxed : bounded steps completed with friction approximated in sweeps
long most_evaluations : largest number of evaluations in a bounded step, including its output row
long most_iterations : largest number of iterations in a bounded step, including its output row
long of_method[{len(METHODS)}] : accepted steps by method
""")

# -- events, columns, verdicts --------------------------------------------------------------------------------------------------

TURN = Record("tr_turn", "Change of a contact's direction at an event.", """
double before : angle before, rad
double after : angle after, rad
double turn : angle between the normals before and after, rad
""")

EVENT = Record("tr_event", "An event of a run.", f"""
double time : s
double kind : TR_EV_…
double index : pair or stop
double margin : change of the deciding quantity that would change the outcome; NaN: unknown
double marginal : 1: the margin is below the run's error, or the time is uncertain
double contacts : number of contacts
tr_turn turned[{EVENT_CONTACTS}] : its contacts
""")

LAST = Record("tr_last", "The last event, for columns.", """
double time : s
double kind : TR_EV_…
double element : joint, counted from 1 among those with friction; 0: none
double contact : contact that turned most, counted from 1; 0: none
double before : angle of that contact before, rad
double after : angle of that contact after, rad
double turn : angle by which its normal turned, rad
double marginal : 1: the margin is below the run's error
""")

EXTRA = Record("tr_extra", "Values that columns take from the runtime. The states of all pairs follow this record.", """
double energy0 : energy.residual at the start, J
double closure : largest residual of loops
double complement : relative residual of the complement equations
double contraction : contraction of the fixed-point iteration of these equations
double events : number of events so far
double step : size of the last step, s
double verdict : verdict of the audit so far, TR_VERDICT_…
double overrun : outcome of the last bounded step, TR_OVERRUN_…
double overruns : bounded steps so far that were not completed within their bounds
tr_last last : the last event
""")

HELD = Record("tr_held", "Static margin of one pair.", """
double slips : whether the pair slips at the start
double share : friction needed to hold, over capacity; NaN: the law has no friction at rest
double capacity : N at the surface
double shared : whether other values of the share are possible, too
""")

CERTIFICATE = Record("tr_certificate", "Certificate of a run.", """
double contraction : largest contraction of the complement equations
double complement : largest relative residual of these equations
double open_time : time of the first decision with several solutions, s; -1: none
double open_pair : pair to which this decision belongs
double stepped : time when method auto first used time stepping, s; -1: never
double dead_centre : time when a driven motion first passes a dead centre, s; -1: never
""")

WORST = Record("tr_worst", "Largest value so far of one figure of the audit (TR_LAW_…).", """
double size : figure in the unit of the law (TR_LAW_…)
double time : time, s; -1: never
double joint : joint, counted from 1 among those with friction; 0: none
""")

JUDGEMENT = Record("tr_judgement", "Verdict of the audit on the run so far.", f"""
double verdict : TR_VERDICT_…
double tolerance : relative tolerance of the run, or the tolerance assumed for a method without error control
double judged : 1: the energy was balanced; 0: works were not integrated
double lost : largest unexplained energy, J; positive: energy gained
double lost_time : time of the largest unexplained energy, s
double jump_time : time of the largest change between two balances, s
double jump_joint : joint of the last event between these balances, counted from 1 among those with friction; 0: none
double turned : energy turned over, J
double share : unexplained energy over the energy turned over
double noted : a law's figure above this value gets a note (in the unit of the figure)
double noted_energy : a share above this value gets a note
tr_worst law[{len(AuditLaw)}] : worst figure of every law
""")
