"""Records that lie in a block while it runs: signals and modes, what a kernel's functions write about pairs, what the runtime
is told, and what it notes. All but the settings and the statistics are made of doubles only."""

from __future__ import annotations

from engine.abi.choices import Law
from engine.abi.records import Record
from engine.integrators import METHODS

EVENT_CONTACTS = 6
"""Contacts of one pair that an event can note (a universal joint's cross has four)."""

# -- what lies in x: moment, a signal a table, a flag a stop, a mode a pair -------------------------------------------------------

MOMENT = Record("tr_moment", "The moment at which functions are evaluated.", """
double t : time, s
double inside : a time inside the present step, which alone decides on which branch of a ramp or table it is
""")

SIGNAL = Record("tr_signal", "The signal of a table at the moment of evaluation.", """
double value : its value
double first : and its derivatives
double second
double third
""")

MODE = Record("tr_mode", "Mode of a sliding pair, frozen within a step.", """
double flag : TR_STUCK, …
double direction[3] : its rates when the direction was frozen (of one component: its sign)
double tilt : of a ball: its tilt where that is not to follow from the state, else 0
""")

# -- what the functions of a kernel write ---------------------------------------------------------------------------------------

SLIDING = Record("tr_sliding", "How a sliding pair slides at this state.", """
double speed : m/s, negative once past a reversal of the frozen direction
double border : sliding speed of the law's kink, m/s
double cone : of a ball (sine of its tilt)²: negative where it turns without sliding; else 1
""")

HOLD = Record("tr_hold", "What a pair at rest can hold, and what it is asked to hold.", """
double capacity : friction it can carry in the direction asked for, N at the surface
double size : friction asked for, N at the surface
double beyond : part of it no friction carries, N
""")

CONTACT = Record("tr_contact", "A contact force of a pair.", """
double force : normal force, N
double vector[3] : the contact's vector, turned so that its angle is atan2 of the second by the first
""")

# -- what the runtime is told ---------------------------------------------------------------------------------------------------

KNOTS = Record("tr_knots", "Head of a table; behind it n times, n values, n second derivatives (spline) or slopes (Hermite).", """
double kind : TR_TABLE_LINEAR, TR_TABLE_SPLINE or TR_TABLE_HERMITE
double held : whether it keeps its end values beyond its ends (else it goes straight on)
double n : knots
""")

INPUT = Record("tr_input", "An external input from its communication point on. A motion that follows it starts where it was and "
               "closes the gap critically damped.", """
double kind : TR_TABLE_INPUT
double followed : whether a motion follows it
double t0 : the communication point, s
double u[3] : value and two derivatives there
double gap : of the motion from it, there
double gap_rate : its rate
double bandwidth : 1/s: how fast the gap closes
""")

SETTINGS = Record("tr_settings", "How a run steps.", """
double rtol : relative tolerance
double hmax : longest step, s
double hmin : shortest step, s
double hfixed : fixed steps of this size without error control, s; 0: error control
double length : scale of lengths, m
double rate : scale of rates, 1/s
double energy : what works asked for are compared with, J; 0: they are not under error control
int method : its number among engine.integrators.METHODS
int project : whether loops are closed after each step
int locate : whether events are located
int max_steps : give up after so many; 0: never
int through_jams : whether a jammed pair stops by an impact and the run goes on
int evaluations : of a bounded step: most evaluations of the right-hand side; 0: steps have no bound
int iterations : most iterations of Newton's method
int events : most events that are located in it
""")

STATS = Record("tr_stats", "What a run has cost so far.", f"""
long steps : accepted steps
long rejected : refused trial steps
long refused : answers that broke a law, so that others were sought
long rhs_evaluations : evaluations of the right-hand side
long jacobians : of the Jacobian
long newton_iterations : of the complement equations
long creeps : iterations in which the modes of many pairs are foreseen, and their loads shared
long newton_most : most iterations one solution took
long events : events
long projections : corrections of positions
long outputs : output rows
long maps : maps formed beside evaluations
long solutions : solutions of decisions
long by_impulses : bounded steps whose rest was one step of impulses
long relaxed : whose rest was one with friction by sweeps
long most_evaluations : most evaluations a bounded step took, its output row included
long most_iterations : most iterations
long of_method[{len(METHODS)}] : accepted steps by method
""")

# -- what the runtime writes ----------------------------------------------------------------------------------------------------

TURN = Record("tr_turn", "By how much a contact turned at an event.", """
double before : its angle before, rad
double after : its angle after, rad
double turn : angle between its normals before and after, rad
""")

EVENT = Record("tr_event", "An event: something that happened at an instant of a run.", f"""
double time : s
double kind : TR_EV_…
double index : which pair or stop
double margin : by how much what decides it would have to be otherwise for something else to happen; not a number: not known
double marginal : 1: by less than the run's own error, or its time is not known
double contacts : how many follow
tr_turn turned[{EVENT_CONTACTS}] : its contacts
""")

LAST = Record("tr_last", "The last event, as columns show it.", """
double time : s
double kind : TR_EV_…
double element : its joint among those with friction, from 1; 0 none
double contact : its contact that turned most, from 1; 0 none
double before : that contact's angle before, rad
double after : its angle after, rad
double turn : by how much its normal turned, rad
double marginal : 1: its margin is below the run's own error
""")

EXTRA = Record("tr_extra", "What only the runtime knows, for the columns; behind it a number for the state of every pair.", """
double energy0 : energy.residual at the start, J
double closure : largest residual of the loops
double complement : relative residual of the complement equations
double contraction : of their fixed-point iteration
double events : how many so far
double step : size of the last step, s
double verdict : what the audit says so far, TR_VERDICT_…
double overrun : how the last bounded step ended, TR_OVERRUN_…
double overruns : bounded steps so far that ended otherwise than they should
tr_last last : the last event
""")

HELD = Record("tr_held", "The answer to the static question for one pair.", """
double slips : whether it slips at the start
double share : of its capacity needed to hold; not a number where its law holds nothing
double capacity : N at the surface
double shared : whether the share is one of several possible
""")

CERTIFICATE = Record("tr_certificate", "Numbers that certify a run.", """
double contraction : largest contraction of the complement equations
double complement : their largest relative residual
double open_time : first decision that several sets of modes satisfied, s; -1 none
double open_pair : the pair it was about
double stepped : first hand-over to time stepping, s; -1 none
""")

WORST = Record("tr_worst", "The worst figure of a law so far.", """
double size : in the unit of that law (TR_LAW_…)
double time : when, s; -1: never
double joint : its joint among those with friction, from 1; 0 none
""")

JUDGEMENT = Record("tr_judgement", "What the audit says of the run so far.", f"""
double verdict : TR_VERDICT_…
double tolerance : what the run is measured by: its relative tolerance, or what is honest of a method without one
double judged : whether the energy was looked at (0: this kernel does not integrate works, or the method at work does not)
double lost : largest energy that is unaccounted for, J; positive: gained
double lost_time : when, s
double jump_time : when most of it came at once, s
double jump_joint : joint of an event just before, among those with friction, from 1; 0 none
double turned : energy turned over, J, by which it is measured
double share : of it
double noted : figures of laws above this are worth a note, in their units
double noted_energy : and this share of the energy turned over
tr_worst law[{len(Law)}] : the worst of every law
""")
