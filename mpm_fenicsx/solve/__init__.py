"""One implicit step: Newton's method by PETSc, linear solvers, tangents, what is tried when it fails."""
