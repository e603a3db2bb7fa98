"""Basis functions of the background cells at the material points."""
