"""The background mesh, its partition over the ranks, and the cells that take part in a step."""
