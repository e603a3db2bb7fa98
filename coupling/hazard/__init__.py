"""What hazard studies need of a flow over a terrain: rasters of maxima, gauges, paths of rocks, a map."""
