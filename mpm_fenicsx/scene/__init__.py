"""What a user states: bodies, grids, meshes, supports, loads and interfaces, as frozen data in SI units."""
