"""Figures over time, drawn with matplotlib, which is loaded only when one is asked for."""

STYLES = {"run": dict(linewidth=2), "under": dict(linewidth=6, alpha=0.35),
          "reference": dict(color="black", linewidth=1, linestyle=(0, (4, 3)), zorder=3)}


def draw(path, xlabel, panels):
    """Save a picture with one panel above the other.

    panels: label of the vertical axis → curves (x, y, label, style), arrays of shape (n,). Styles: "run"; "under", a
    broad pale line that stays visible below another run, in the same colours; "reference", thin and black.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

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
