"""Fields of points as plain arrays, as files have them: a state with several variables is several of them."""
import numpy as np


def columns(points):
    """Copies of the fields of ``points`` as name → array; of a structured one "field.part"."""
    found = {}
    for name in points.names:
        values = getattr(points, name)
        for part in values.dtype.names or ("",):
            found[f"{name}.{part}" if part else name] = (values[part] if part else values).copy()
    return found


def from_columns(points, found):
    """Fields of the kind that ``points`` have from what ``columns`` gave. ValueError for one that is missing
    or has another shape."""
    fields, n = {}, len(found["gid"])
    for name in points.names:
        like = getattr(points, name)
        values = np.empty((n, *like.shape[1:]), like.dtype)
        for part in like.dtype.names or ("",):
            key = f"{name}.{part}" if part else name
            into = values[part] if part else values
            if key not in found or found[key].shape != into.shape:
                raise ValueError(f"the checkpoint has no {key} of shape {into.shape[1:]} for each point: "
                                 "give one of this scene")
            into[...] = found[key]
        fields[name] = values
    return fields
