"""Momentum and energy exchanged at the interface, and what leaves the scene."""
