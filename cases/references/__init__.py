"""What the cases are compared with: theory, experiments, other programs."""
