"""When this package was imported: the report's start-up time runs from here. Imported before anything that
takes time."""
from time import perf_counter

IMPORTED = perf_counter()
