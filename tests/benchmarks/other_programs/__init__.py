"""Treatment of joints, limits and friction by other programs. ``comparison_page`` writes ``OTHER_PROGRAMS.md`` from these runs."""
