"""Material points and boundary particles as arrays: where they are, how they move between cells and ranks."""
