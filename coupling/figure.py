"""Figures over time, drawn with matplotlib, which is loaded only when one is asked for."""

STYLES = {"run": dict(linewidth=2), "under": dict(linewidth=6, alpha=0.35),
          "reference": dict(color="black", linewidth=1, linestyle=(0, (4, 3)), zorder=3)}


def draw(path, xlabel, panels):
    """Save a picture with one panel above the other.

    panels: label of the vertical axis → curves (x, y, label, style), arrays of shape (n,). Styles: "run"; "under", a
    broad pale line that stays visible below another run; "reference", thin and black.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(panels), 1, sharex=True, figsize=(7, 2.8 * len(panels)), squeeze=False)
    for axis, (ylabel, curves) in zip(axes[:, 0], panels.items()):
        for x, y, label, style in curves:
            axis.plot(x, y, label=label, **STYLES[style])
        axis.set_ylabel(ylabel)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False)
    axes[-1, 0].set_xlabel(xlabel)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)
