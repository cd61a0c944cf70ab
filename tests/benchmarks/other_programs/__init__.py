"""Other programs: how they treat joints, limits and friction. ``comparison_page`` writes ``NEIGHBOURS.md`` from these runs."""
