"""What a user states: spheres, clusters, walls, materials and the scene of them, as frozen data in SI units;
and the same as arrays."""
