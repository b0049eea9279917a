"""The tire of section 7.3 on the ground: both solvers, what symmetry saves, what holds and what breaks."""
