"""Figures over time, drawn with matplotlib, which is loaded only when one is asked for."""


def draw(path, xlabel, panels):
    """Save a picture with one panel above the other.

    panels: label of the vertical axis → curves (x, y, label), arrays of shape (n,). Curves from the run are drawn in
    colour; a curve whose label is None, and the one after it if it is the last, is the reference: thin and black.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(panels), 1, sharex=True, figsize=(7, 2.8 * len(panels)), squeeze=False)
    for axis, (ylabel, curves) in zip(axes[:, 0], panels.items()):
        reference = False
        for x, y, label in curves:
            reference = reference or label is None
            style = dict(color="black", linewidth=1, linestyle=(0, (4, 3)), zorder=3) if reference else dict(linewidth=2)
            axis.plot(x, y, label=label, **style)
        axis.set_ylabel(ylabel)
        axis.grid(alpha=0.3)
        if any(label for _, _, label in curves):
            axis.legend(frameon=False)
    axes[-1, 0].set_xlabel(xlabel)
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    plt.close(figure)
