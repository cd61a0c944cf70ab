"""The paper's recursion in its own notation, as symbolic expressions (theory, "Overview").

Modules in the order in which a model is built:

  symbolic_inputs           time, state, parameters, signals
  body_kinematics           positions and velocities outward (paper §2)
  masses_and_forces         masses and applied forces
  cut_joint_constraints     constraints of cut joints (§4)
  inward_reduction          inward pass (§3, §6)
  outward_accelerations     outward pass (§6)
  joint_reactions           transmitted wrenches (§5)
  complement_equation_terms inputs of the contact forms (§7)
  redundant_loop_reactions  scaled reactions, whose least norm selects the reactions of redundant loops

All modules use ``vector_algebra``."""
