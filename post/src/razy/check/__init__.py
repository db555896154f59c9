"""Proofs of motions in ball arithmetic, from the input alone; in the order of reading.

- `places`, `machine`: the input becomes mass, damping and stiffness, loads and contacts, in exact rational numbers.
- `dual`, `motion`: these become linear pieces X' = G X with guards, impacts and friction, in balls.
- `exponential`: exp(G s), and the Taylor polynomials of guards, with bounds.
- `proof`: the sequence of events, Krawczyk's operator, what keeps off its bounds, multipliers.
- `special`, `touch`: points on a curve of motions at which a test function changes its sign; motions that touch.
- `verdict`, `start`, `cli`: what a file of razy-follow says, and one of razy-run; the command.
"""
