"""Questions besides motion: where a mechanism rests, how it swings about that, what a given motion takes, where joints go."""
