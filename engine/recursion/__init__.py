"""The paper's recursion in its own notation, written once on symbolic expressions (METHOD, "Overview").

In the order in which a model is built: ``symbols`` holds the inputs, ``kinematics`` positions and velocities outward (paper §2),
``loads`` masses and applied forces, ``cuts`` the constraints of cut joints (§4), ``reduction`` the inward pass (§3, §6),
``accelerations`` the outward one (§6), ``reactions`` what joints transmit (§5), ``elements`` what the contact forms of §7 are fed
with, and ``redundancy`` the reactions that decide where redundant loops leave a choice. ``vectors`` is the algebra below them.
"""
