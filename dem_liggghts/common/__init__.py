"""What both back ends share: checks, energies, outflow, states, a change of the moving wall."""
