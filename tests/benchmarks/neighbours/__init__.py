"""What other programs make of joints, limits and friction: the page of neighbours is made from runs of these scripts."""
