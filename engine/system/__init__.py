"""A scene reduced to what the recursion needs: a tree of bodies, cut joints, devices, and a table of run-time numbers.

Nothing here imports the symbolic library: from a scene to the key of its compiled kernel takes milliseconds.
"""
