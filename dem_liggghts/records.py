"""Arrays that LIGGGHTS and its shim understand: records of particles, rows of bodies."""
import ctypes

import numpy as np

from . import quaternion

ALWAYS = 16  # numbers of a body that never change, before those that do (shim/bodies.h)
CHANGING = 22  # x, v, omega, angular momentum (3 each), quaternion (4), force, torque (3 each)


def starts(records):
    """Where the records of the particles begin, and the end of the last one; each starts with its length."""
    numbers, first = memoryview(records), [0]  # reads one number several times faster than an array does
    while first[-1] < len(numbers):
        first.append(first[-1] + int(numbers[first[-1]]))
    return np.array(first)


def copied(address, count):
    """``count`` numbers that begin at an address of the shim, as an array of its own."""
    out = np.empty(count)
    ctypes.memmove(out.ctypes.data, address, out.nbytes)
    return out


def gathered(comm, mine):
    """The rows or numbers of all ranks, one after the other, on every rank."""
    return mine if comm.size == 1 else np.concatenate(comm.allgather(mine))


def by_tag(records, out):
    """The records in the order of their second number, the tag from 1 on, without those that are ``out``, (n,) bool."""
    first = starts(records)
    tag = records[first[:-1] + 1].astype(int)
    order = np.argsort(tag, kind="stable")
    order = order[~out[tag[order] - 1]]
    lengths = np.diff(first)[order]
    shift = first[order] - np.concatenate([[0], np.cumsum(lengths)[:-1]])  # where a record comes from and goes to
    return records[np.repeat(shift, lengths) + np.arange(lengths.sum())]


def always(rigid, grains):
    """What never changes of the bodies (shim/bodies.h), shape (bodies, ALWAYS)."""
    out = np.zeros((len(rigid.mass), ALWAYS))
    for b, (start, stop) in enumerate(zip(rigid.first[:-1], rigid.first[1:])):
        arm = grains.arm[start:stop]
        middle = arm.mean(axis=0)
        bound = (np.sqrt(((arm - middle) ** 2).sum(axis=1)) + grains.radius[start:stop]).max()
        out[b] = b + 1, rigid.mass[b], stop - start, *rigid.inertia[b], *rigid.free[b], bound, *middle
    return out


def at_start(rigid):
    """What changes of the bodies, as it is at the start, shape (bodies, CHANGING)."""
    spin = np.empty((len(rigid.mass), 3))
    for b, axes in enumerate(map(quaternion.matrix, rigid.q)):
        spin[b] = axes @ (rigid.inertia[b] * (axes.T @ rigid.omega[b]))
    return np.column_stack([rigid.x, rigid.v, rigid.omega, spin, rigid.q, np.zeros((len(spin), 6))])
