"""Constitutive laws, one per file; ``law`` says what a law is and how to write one."""
from typing import Callable, Dict

from .cam_clay import cam_clay
from .checking import LawReport, check_law
from .drucker_prager import drucker_prager
from .energy import from_energy
from .herschel_bulkley import herschel_bulkley
from .law import ELASTIC_STATE, SHOWN, Law, bound, check_declared, check_together, kernels, lame
from .linear import linear
from .mohr_coulomb import mohr_coulomb
from .mu_i import mu_i
from .neo_hooke import neo_hooke
from .softened import softened
from .von_mises import von_mises

__all__ = ["ELASTIC_STATE", "LAWS", "Law", "LawReport", "SHOWN", "bound", "cam_clay", "check_declared",
           "check_law", "check_together", "drucker_prager", "from_energy", "herschel_bulkley", "kernels",
           "lame", "linear", "mohr_coulomb", "mu_i", "neo_hooke", "softened", "von_mises"]

LAWS: Dict[str, Callable[..., Law]] = {
    "linear": linear, "neo_hooke": neo_hooke, "mohr_coulomb": mohr_coulomb, "drucker_prager": drucker_prager,
    "von_mises": von_mises, "mu_i": mu_i, "herschel_bulkley": herschel_bulkley,
    "cam_clay": cam_clay}
