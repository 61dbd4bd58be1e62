"""The pictures of the reports."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stages.core.artifact import written_atomically
from stages.core.images import read_image


def frontier(path: Path, rows: Sequence[Any], title: str) -> None:
    """Error over seconds a view: a line for each environment on the left, for each light map on the right."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    swept = [row for row in rows if row.setting in ("draft", "standard", "high") or row.setting.endswith("x standard")]
    figure, panels = pyplot.subplots(1, 2, figsize=(10, 4), layout="constrained", sharex=True, sharey=True)
    for axes, key in zip(panels, ("environment", "map"), strict=True):
        for name in dict.fromkeys(getattr(row, key) for row in swept):
            own = [row for row in swept if getattr(row, key) == name]
            axes.loglog(*worst_by_setting(own), "o-", markersize=3, label=name)
        standard = next(row.seconds for row in swept if row.setting == "standard")
        axes.axvline(standard, color="0.6", linewidth=1)
        axes.annotate("standard", (standard, 0.02), xycoords=("data", "axes fraction"), fontsize=8, rotation=90)
        axes.set(xlabel="seconds a view, all environments, two cores")
        axes.grid(True, which="both", alpha=0.3)
        axes.legend(fontsize=7, title=f"by {key}", title_fontsize=7)
    panels[0].set(ylabel="tone-mapped RMSE, %, the worst of the others")
    figure.suptitle(title, fontsize=10)
    with written_atomically(path) as temporary:
        figure.savefig(temporary, dpi=120)
    pyplot.close(figure)


def bounces(path: Path, rows: Sequence[Any], title: str) -> None:
    """Error over seconds a view, the mean of the environments: a line for each material, broken of direct light alone."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 4), layout="constrained")
    for number, name in enumerate(dict.fromkeys(row.map for row in rows)):
        for direct in (True, False):
            settings: dict[str, list[Any]] = {}
            for row in rows:
                if row.map == name and row.seconds and row.setting.endswith("no bounces") == direct:
                    settings.setdefault(row.setting, []).append(row)
            errors = [np.sqrt(np.mean([row.rmse_percent**2 for row in own])) for own in settings.values()]
            style = {"linestyle": "--" if direct else "-", "color": f"C{number}", "marker": "o", "markersize": 3}
            axes.loglog([own[0].seconds for own in settings.values()], errors, **style, label=None if direct else name)
    axes.set(xlabel="seconds a view, all environments", ylabel="tone-mapped RMSE, %; broken: direct light alone")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=7)
    figure.suptitle(title, fontsize=10)
    with written_atomically(path) as temporary:
        figure.savefig(temporary, dpi=120)
    pyplot.close(figure)


def worst_by_setting(rows: Iterable[Any]) -> tuple[list[float], list[float]]:
    """Seconds and the largest error of each setting, without exact maps (a mirror's)."""
    worst: dict[str, tuple[float, float]] = {}
    for row in rows:
        _, before = worst.get(row.setting, (0.0, 0.0))
        worst[row.setting] = (row.seconds, max(before, row.rmse_percent))
    kept = [pair for pair in worst.values() if pair[1] > 1e-3]
    return [seconds for seconds, _ in kept], [error for _, error in kept]


def contact_sheet(path: Path, pictures: Sequence[tuple[str, Path]], size: int, columns: int = 9) -> None:
    """The first view, `size` pixels wide, of each of some previews, under its prompt."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = -(-len(pictures) // columns)
    figure, panels = pyplot.subplots(rows, columns, figsize=(1.6 * columns, 1.8 * rows), layout="constrained", squeeze=False)
    for axes in panels.flat:
        axes.axis("off")
    for axes, (text, preview) in zip(panels.flat, pictures, strict=False):
        axes.imshow(np.clip(read_image(preview)[:size, :size, :3], 0, 1))
        axes.set_title(text, fontsize=6)
    with written_atomically(path) as temporary:
        figure.savefig(temporary, dpi=110)
    pyplot.close(figure)
