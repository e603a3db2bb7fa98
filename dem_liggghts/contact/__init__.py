"""The contact law of Hertz and Mindlin, with damping and adhesion; the steps and windows that it allows."""
