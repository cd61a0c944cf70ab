"""Other programs that solve the same scene, if they are installed. Each program states which parts of the scene it omits."""
