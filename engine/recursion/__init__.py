"""The paper's recursion in its own notation, written once on symbolic expressions (sections 2 to 6).

``symbols``: the inputs · ``kinematics``: §2 · ``loads``: applied forces · ``cuts``: §4 · ``reduction``: §3 and §6, inward and
outward · ``reactions``: (57)–(66), (103) · ``elements``: what the contact forms of §7 are fed with.
"""
