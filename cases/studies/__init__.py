"""Studies of the cases: error against run time, and stability in stiff and extreme conditions."""
