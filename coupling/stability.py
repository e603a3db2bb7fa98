"""``python -m coupling.stability``: the matrix of stiff and extreme runs, cases/studies/stability.py."""
from .checkout import run_study

if __name__ == "__main__":
    run_study("stability")
