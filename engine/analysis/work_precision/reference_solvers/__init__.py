"""Other programs that solve the same scene, where they are installed; each program states which parts of the scene it omits."""
