"""``python -m coupling.crossing``: scenes in which points cross cells, cases/studies/crossing/table.py."""
from .checkout import run_study

if __name__ == "__main__":
    run_study("crossing/table")
