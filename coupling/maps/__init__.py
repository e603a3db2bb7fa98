"""Maps between the interface of the solid and the wall of the grains."""
