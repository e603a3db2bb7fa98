"""Scenes in which material points cross cells, each against a reference: a module per scene, one table."""
