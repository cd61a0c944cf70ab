/* The runtime as one translation unit. This file includes all files, stage by stage; each file follows all files that it calls.
 * Code between TR_RARE and TR_OFTEN is compiled for size (``base/compiler.h``). */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

#include "base/least_squares.c"
TR_RARE
#include "base/block_layout.c"
TR_OFTEN
#include "base/signals.c"
#include "base/debug_validity_checks.c"
#include "base/unilateral_contact_rows.c"
#include "base/kernel_calls.c"

#include "constraints/internal_forces.c"
#include "constraints/loop_solve.c"
#include "constraints/unloaded_contacts.c"
#include "constraints/internal_forces_derivative.c"

#include "friction/pair_motion.c"
#include "friction/law_evaluation.c"
#include "friction/freedom_response.c"
#include "friction/mode_violation.c"
#include "friction/load_sharing_rows.c"
#include "friction/newton.c"
#include "friction/ball_near_cone.c"
#include "friction/newton_restarts.c"
#include "friction/creep_minimisation.c"
#include "friction/load_sharing.c"
#include "friction/newton_recursive.c"
#include "friction/multiplier_solve.c"

#include "evaluate/rhs.c"
#include "evaluate/lane_requests.c"
TR_RARE
#include "evaluate/stopping_impulses.c"
TR_OFTEN
#include "evaluate/projection.c"
TR_RARE
#include "evaluate/initial_assembly.c"

TR_OFTEN
#include "integrators/error_norm.c"
#include "integrators/runge_kutta.c"
#include "integrators/jacobian.c"
#include "integrators/rosenbrock.c"
#include "integrators/dense_output.c"
#include "integrators/work_quadrature.c"
#include "integrators/method_choice.c"
#include "integrators/step_size.c"

#include "checks/solution_check.c"
TR_RARE
#include "checks/uniqueness_certificate.c"
TR_OFTEN
#include "checks/audit.c"

#include "output/rows.c"
TR_RARE
#include "output/wear.c"

TR_OFTEN
#include "modes/coupled_pairs.c"
TR_RARE
#include "modes/pairs_at_rest.c"
#include "modes/frozen_sliding_directions.c"
#include "modes/mode_corrections.c"
#include "modes/slip_onset.c"
#include "modes/cone_equations_ball.c"
#include "modes/cone_equations.c"
#include "modes/cone_homotopy.c"
#include "modes/mode_decision_by_cones.c"
#include "modes/active_set_prediction.c"
#include "modes/load_resharing_minmax.c"
#include "modes/load_resharing.c"
#include "modes/active_set.c"

TR_OFTEN
#include "events/end_stop_event_detection.c"
#include "events/sliding_direction_turns.c"
#include "events/event_outcome_margin.c"
#include "events/violation_maxima_in_step.c"
#include "events/capacity_dips_in_step.c"
#include "events/unilateral_event_location.c"
#include "events/event_location.c"
TR_RARE
#include "events/event_location_projected.c"
TR_OFTEN
#include "events/event_log.c"
#include "events/kink_and_stop_event_handling.c"
#include "events/contact_side_change.c"
#include "events/follower_pulls.c"
#include "events/end_stop_and_hook_release.c"
TR_RARE
#include "events/event_handling.c"
TR_OFTEN
#include "events/initial_modes.c"
TR_RARE
#include "events/capture_at_end_of_sliding.c"
TR_OFTEN
#include "events/pre_event_state.c"
#include "events/curve_positions.c"

TR_RARE
#include "diagnosis/jam.c"
#include "diagnosis/continuation_past_fold.c"
#include "diagnosis/end_of_reach.c"

#include "time_stepping/moreau.c"
#include "time_stepping/moreau_event_location.c"
#include "time_stepping/moreau_error_control.c"

TR_OFTEN
#include "stepping/singular_step_limits.c"
TR_RARE
#include "stepping/unilateral_impulses.c"
#include "stepping/unilateral_impact_parts.c"
#include "stepping/unilateral_impact.c"
#include "stepping/unilateral_contacts.c"
TR_OFTEN
#include "stepping/step_completion.c"
#include "stepping/trial_step.c"
#include "stepping/realtime_steps.c"
#include "stepping/step_loop.c"

TR_RARE
#include "hosts/api.c"
#include "hosts/static_friction_ratios.c"
#include "hosts/linearization.c"
#include "hosts/step_record.c"
#include "hosts/tangent_evaluation.c"
#include "hosts/tangent_integration.c"
#include "hosts/model_exchange.c"
#include "hosts/model_exchange_derivatives.c"
#include "hosts/model_exchange_events.c"
TR_OFTEN
#include "hosts/batch.c"
#include "hosts/lane_batch.c"
#include "hosts/cosimulation.c"
