"""Other programs: how they treat joints, limits and friction. ``comparison_page`` writes ``OTHER_PROGRAMS.md`` from these runs."""
