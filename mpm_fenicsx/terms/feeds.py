"""All inflows of a scene: their points are shared out over the ranks and booked."""
import re

import numpy as np

from ..collective import total
from ..points.passed import Passed
from .feed import Feed, mean_half_widths


def key_of(name):
    """A ``name`` as part of that of a column."""
    return re.sub(r"\W+", "_", name).strip("_")


class Feeds:
    """``Feed`` of each of the ``inflows`` of a scene, into its ``bodies``, terms at the start.

    make: see ``Feed``; cell: size of one [m], shape (D,); gravity: [m/s^2], shape (D,). ``entered``: sums of
    what has come, the same on every rank. ``books``: whose ``enter`` is told of a body and its new points,
    those who book and the contacts.
    Collective."""

    def __init__(self, inflows, bodies, make, cell, gravity, comm):  # noqa: PLR0913 - once, by the model
        self.first = sum(body.total for body in bodies)  # number of the first new point
        half = {one.body: mean_half_widths(bodies[one.body], comm) for one in inflows}
        self._feeds = [Feed(one, bodies[one.body], make, (cell, half[one.body]), gravity) for one in inflows]
        self._gravity, self._comm, self.books = gravity, comm, ()
        self._passed = Passed(gravity, comm)

    def __len__(self):
        return len(self._feeds)

    def __iter__(self):
        return iter(self._feeds)

    @property
    def count(self):
        """Points that have come."""
        return self._passed.count

    @property
    def entered(self):
        """See ``Passed.by_name``."""
        return self._passed.by_name()

    def places(self):
        """Of the columns, (n, D) each: no cell of one is without a place [m]."""
        return [feed.places() for feed in self._feeds]

    def supports(self):
        """What holds the columns."""
        return tuple(feed.support() for feed in self._feeds)

    def __call__(self, background, time):
        """Make all points for which there is room at ``time`` [s]; returns whether there were any."""
        before = self.count
        for feed in self._feeds:
            for number in feed.due(time):
                layer = feed.layer(number, time, self.first + self.count)
                feed.made = number + 1
                if layer is not None:
                    self._add(feed.term, layer, background)
        return self.count > before

    def _add(self, body, layer, background):
        """Those of the ``layer`` in this rank's cells become points of the ``body``."""
        there = len(body.points)
        rank, number = background.search.assign(layer.x, body.field)
        mine = rank == background.comm.rank
        layer.take(mine)
        layer.cell[:] = background.search.local(number[mine])
        body.points.append(layer)
        chosen = np.arange(there, len(body.points))
        self._passed.add(body, chosen)
        for book in self.books:
            book.enter(body, chosen, self._gravity)

    def volume(self, feed):
        """What has come through the plane of the ``feed`` since the start [m^3]."""
        made = feed.flow.discharged(feed.flow.when(min(feed.made * feed.spacings[0], feed.flow.travel[-1])))
        return made - float(total(self._comm, feed.upstream(self.first)))

    def columns(self):
        """For the history, see ``MPM.columns``."""
        return {f"volume_{key_of(feed.inflow.name)}": (
                    "m^3", f"volume that has come in through {feed.inflow.name} since the start",
                    lambda feed=feed: self.volume(feed)) for feed in self._feeds}

    def get_state(self):
        """As name → array copy."""
        made = [feed.made for feed in self._feeds]
        return {"entered": np.concatenate([made, self._passed.values])} if made else {}

    def set_state(self, state):
        """Go back to what ``get_state`` gave."""
        if self._feeds:
            made, self._passed.values = np.split(np.array(state["entered"]), [len(self._feeds)])
            for feed, number in zip(self._feeds, made):
                feed.made = int(number)
