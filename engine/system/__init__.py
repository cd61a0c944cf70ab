"""A scene reduced to the data that the recursion needs: a tree of bodies, cut joints, devices, and a table of run-time parameters.

The modules of this folder do not import the symbolic library, so that the key of a scene's compiled kernel is found within
milliseconds."""
