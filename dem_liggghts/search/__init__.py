"""Which spheres touch which spheres and walls: closest points, neighbour lists, contacts with walls. Geometry
only."""
