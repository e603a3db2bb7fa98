"""``python -m coupling.work_precision``: error against run time, cases/studies/work_precision.py."""
from .checkout import run_study

if __name__ == "__main__":
    run_study("work_precision")
