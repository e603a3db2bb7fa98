"""Figures of curves and pictures of scenes."""
