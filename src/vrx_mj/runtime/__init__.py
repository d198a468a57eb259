"""Everything that runs: the compiled loop and the Simulation around it."""
