"""What adds to residual and tangent: bodies, penalties, loads and the ghost penalty."""
