"""Figures over time, and of error against run time, by matplotlib, which is loaded only when one is asked for."""

STYLES = {"run": dict(linewidth=2), "under": dict(linewidth=6, alpha=0.35),
          "reference": dict(color="black", linewidth=1, linestyle=(0, (4, 3)), zorder=3)}


def draw(path, xlabel, panels):
    """Save a picture with one panel above the other.

    panels: label of the vertical axis → curves (x, y, label, style), arrays of shape (n,). Styles: "run"; "under", a
    broad pale line that stays visible below another run, in the same colours; "reference", thin and black.
    """
    plt = _pyplot()
    figure, axes = plt.subplots(len(panels), 1, sharex=True, figsize=(7, 3 * len(panels)), squeeze=False)
    for axis, (ylabel, curves) in zip(axes[:, 0], panels.items()):
        drawn = dict.fromkeys(STYLES, 0)
        for x, y, label, style in curves:
            axis.plot(x, y, label=label, **{"color": f"C{drawn[style]}", **STYLES[style]})
            drawn[style] += 1
        axis.set_ylabel(ylabel)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3, fontsize="small")
    axes[-1, 0].set_xlabel(xlabel)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def draw_work(path, xlabel, panels):
    """Save a picture of error against run time, both axes logarithmic, one panel beside the other.

    panels: label of the vertical axis → series (label, times [s], errors, notes); times and errors of shape (n,),
    notes: texts at the points, "" for none. A line joins the points of a series that none beats in both.
    """
    plt = _pyplot()
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    figure, axes = plt.subplots(1, len(panels), figsize=(6 * len(panels), 5), squeeze=False)
    for axis, (ylabel, series) in zip(axes[0], panels.items()):
        for number, (label, times, errors, notes) in enumerate(series):
            style, best = {"color": f"C{number}", "marker": "osD^v"[number % 5]}, front(times, errors)
            axis.loglog(times, errors, linestyle="", alpha=0.35, markersize=5, **style)
            axis.loglog([times[i] for i in best], [errors[i] for i in best], label=label, markersize=5, **style)
            for i in best:
                axis.annotate(notes[i], (times[i], errors[i]), textcoords="offset points", xytext=(0, 5), fontsize=6,
                              horizontalalignment="center", clip_on=True)
        axis.set_xlabel(xlabel)
        axis.set_ylabel(ylabel)
        axis.margins(0.15)
        for ticks in (axis.xaxis, axis.yaxis):
            ticks.set_major_locator(LogLocator(subs=(1, 2, 5)))
            ticks.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            ticks.set_minor_formatter(NullFormatter())
        axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
        axis.grid(alpha=0.3, which="both")
        axis.legend(frameon=False, fontsize="small")
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)


def front(times, errors):
    """Pareto front: numbers of the points that no other one beats in run time and error, by rising time."""
    best, order = [], sorted(range(len(times)), key=lambda i: (times[i], errors[i]))
    for i in order:
        if not best or errors[i] < errors[best[-1]]:
            best.append(i)
    return best


def _pyplot():
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    return plt
