"""The background mesh, its distribution over the ranks, and the cells that take part in a step."""
