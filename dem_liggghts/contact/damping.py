"""The damping ratio of a Hertz contact that meets a coefficient of restitution."""
import math

LEAST = 0.01  # restitution of a contact that does not pull; smaller ones would need dampers of any strength


def damping_ratio(restitution: float, attraction: bool) -> float:
    """Damping ratio [-] with which a damped Hertz contact returns the share ``restitution`` of the speed.

    attraction: whether the damper may pull at the end of the contact. Hertz's contact with a damper that goes
    with the fourth root of the overlap is a linear oscillator in the overlap to the power 5/4 (Antypov and
    Elliott, EPL 94 (2011) 50004), so that the relations of that oscillator hold. With attraction e = exp(-pi
    z / sqrt(1 - z^2)) (Tsuji et al. 1992), and z = 1 for e = 0. Without, the contact ends as soon as the
    force is zero (Schwager and Poeschel, Granular Matter 9 (2007) 465-469; Thornton et al., Powder Technol.
    233 (2013) 30-46): `restitution_without_pull`, inverted by bisection; a restitution below `LEAST` is met
    as that.

    >>> round(damping_ratio(0.5, attraction=True), 4), round(damping_ratio(0.5, attraction=False), 4)
    (0.2155, 0.2618)
    """
    if restitution in (0.0, 1.0) and (attraction or restitution):
        return 1.0 - restitution
    if attraction:
        return -math.log(restitution) / math.sqrt(math.log(restitution) ** 2 + math.pi**2)
    low, high, wanted = 0.0, 10.0, max(restitution, LEAST)
    while True:
        ratio = 0.5 * (low + high)
        if ratio in (low, high):
            return ratio
        low, high = (ratio, high) if restitution_without_pull(ratio) > wanted else (low, ratio)


def restitution_without_pull(ratio: float) -> float:
    """Coefficient of restitution of a contact with this damping ratio that does not pull, exp(-2 z arccos(z)
    / sqrt(1 - z^2)), of which the overdamped branch is the continuation."""
    if ratio == 1.0:
        return math.exp(-2.0)
    root = math.sqrt(abs(1.0 - ratio**2))
    return math.exp(-2.0 * ratio * (math.acos(ratio) if ratio < 1.0 else math.acosh(ratio)) / root)
