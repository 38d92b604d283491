"""The tables and figures of `docs/convergence.md` from the study of convergence.

    rendulic run studies/convergence.toml -o build/convergence
    python studies/convergence.py build/convergence

writes every probe of the study to `studies/convergence.csv.gz`; without a folder the table and the figures are made from that file. Figures
are drawn when every set is there.
"""

from __future__ import annotations

import sys
from pathlib import Path
from shutil import copyfile

import pandas as pd
from matplotlib.figure import Figure

from rendulic.figures.style import COLOURS, INK, NEGATIVE, new_figure, save
from rendulic.study.language.study_file import read_study
from rendulic.study.plan import plan_of
from rendulic.study.results import Results
from rendulic.study.store.store import Store

ROOT = Path(__file__).parents[1]
DATA, PAGE, PICTURES = (
    ROOT / "studies" / "convergence.csv.gz",
    ROOT / "docs" / "convergence.md",
    ROOT / "docs" / "images",
)
START, END = "<!-- tables: made by studies/convergence.py -->", "<!-- end of the tables -->"
KEEP = {
    "w2_normalised": "w2n", "w2_normalised_error": "error", "is_significant": "sure", "is_settled": "settled",
    "is_too_fast": "too_fast", "meets_collapse": "collapse", "settling_steps": "settling_steps",
    "unbalanced_on_way": "on_way", "unbalanced_force": "unbalanced",
}  # fmt: skip
REFERENCE = "eighth"  # the slowest set, read at rest
SETS = {
    "moving_8e-8": (8e-8, "moving"), "moving": (1e-8, "moving"), "rate_8e-8": (8e-8, "at rest"), "rate_4e-8": (4e-8, "at rest"),
    "rate_2e-8": (2e-8, "at rest"), "default": (1e-8, "at rest"), "damping_0_2": (1e-8, "at rest, damping 0.2"),
    "eighth": (1.25e-9, "at rest"),
}  # fmt: skip
KEYS = ["n", "specimen", "seed", "eta", "norm", "alpha"]


def collected(folders: list[Path]) -> pd.DataFrame:
    """Every finished probe of the studies, a row each."""
    rows = []
    for folder in folders:
        study = read_study(ROOT / "studies" / f"{folder.name}.toml")
        plan = plan_of(study)
        results = Results(plan, Store(folder))
        sizes = {one.name: one.n_grains for one in study.specimen}
        for (name, state), probes in results.of("probes").items():
            table = probes[list(KEEP)].to_dataframe().reset_index().rename(columns=KEEP)
            at = {
                "set": name,
                "n": sizes[state.specimen],
                "specimen": state.specimen,
                "seed": int(state.value),
                "eta": state.eta,
            }
            rows.append(table[["norm", "alpha", *KEEP.values()]].assign(**at))
    return pd.concat(rows, ignore_index=True)


def compared(data: pd.DataFrame) -> pd.DataFrame:
    """Each set against the slowest: changes of W2n and of signs, by kind of packing and size of the probes."""
    slowest = data[data["set"] == REFERENCE]
    rows = []
    for (n, specimen, norm), part in data[data["set"].isin(SETS)].groupby(["n", "specimen", "norm"]):
        for name, (rate, how) in SETS.items():
            both = part[part["set"] == name].merge(slowest, on=KEYS, suffixes=("", "_slow"))
            if name == REFERENCE or both.empty:
                continue
            change = (both.w2n - both.w2n_slow).abs()
            turned = both.w2n * both.w2n_slow < 0.0
            rows.append(
                {
                    "grains": n, "packing": specimen, "norm": norm, "rate": rate, "read": how, "probes": len(both),
                    "too fast": both.too_fast.mean(), "at rest": both.settled.mean(),
                    "median change": change.median(), "95 % of changes": change.quantile(0.95), "signs turned": int(turned.sum()),
                    "sure": both.sure.mean(), "sure and turned": int((turned & both.sure & both.sure_slow).sum()),
                    "within the errors": (change <= both.error + both.error_slow).mean(),
                }
            )  # fmt: skip
    return pd.DataFrame(rows)


def table_text(table: pd.DataFrame) -> str:
    """A table for the page."""
    shares = ("too fast", "at rest", "sure", "within the errors")

    def words(name: str, value: object) -> str:
        if name in shares:
            return f"{100 * float(value):.0f} %"
        return f"{value:.2g}" if isinstance(value, float) else str(value)

    lines = ["| " + " | ".join(table.columns) + " |", "|" + "---|" * len(table.columns)]
    lines += ["| " + " | ".join(words(name, row[name]) for name in table.columns) + " |" for _, row in table.iterrows()]
    return "\n".join(lines)


def rate_figure(data: pd.DataFrame) -> Figure:
    """W2n of some directions against the rate, moving and at rest, of one packing; and the changes of all."""
    figure = new_figure(7.2, 3.2)
    one, all_of = figure.subplots(1, 2)
    here = data[
        (data.n == 1000) & (data.specimen == "loose") & (data.seed == 1) & (data.eta == 0.48) & (data.norm == 2e-4)
    ]
    for colour, alpha in zip(COLOURS, (100, 120, 130, 140, 150), strict=False):
        for how, style in (("at rest", "-o"), ("moving", ":s")):
            points = sorted(
                (rate, float(own.w2n.iloc[0]))
                for name, (rate, read) in SETS.items()
                if read == how and len(own := here[(here["set"] == name) & (here.alpha == alpha)])
            )
            if points:
                label = f"{alpha}°" if how == "at rest" else None
                one.plot(*zip(*points, strict=True), style, color=colour, markersize=4, label=label)
    one.axhline(0.0, color=INK, linewidth=0.6)
    one.set(xscale="log", xlabel="strain per step", ylabel="W2n", title="(a) one loose packing, η = 0.48")
    one.legend(title="direction", ncols=2)
    table = compared(data[data.norm == 2e-4])
    for colour, (packing, part) in zip(COLOURS, table.groupby("packing"), strict=False):
        for how, style in (("at rest", "-o"), ("moving", ":s")):
            own = part[(part["read"] == how) & (part.grains == 1000)].sort_values("rate")
            all_of.plot(own.rate, own["95 % of changes"], style, color=colour, markersize=4, label=f"{packing}, {how}")
    all_of.set(
        xscale="log", yscale="log", xlabel="strain per step", ylabel="95 % of changes of W2n",
        title="(b) against 1.25e-9, at rest",
    )  # fmt: skip
    all_of.legend()
    return figure


def start_figure(data: pd.DataFrame) -> Figure:
    """W2n around the circle from states less and less at rest, and against the size of the probes."""
    figure = new_figure(7.2, 3.2)
    rest, size = figure.subplots(1, 2)
    here = data[(data.eta == 0.48) & (data.seed == 1) & (data.norm == 2e-4) & (data.n == 1000)]
    names = {"rest_1e-3": "1e-3", "rest_1e-4": "1e-4", "rest_1e-5": "1e-5", "rest_1e-7": "1e-7"}
    for colour, (name, words) in zip(COLOURS, names.items(), strict=False):
        own = here[(here["set"] == "from_rest") & (here.specimen == name)].sort_values("alpha")
        rest.plot(own.alpha, own.w2n, color=colour, label=words)
    own = here[(here["set"] == "default") & (here.specimen == "loose")].sort_values("alpha")
    rest.plot(own.alpha, own.w2n, color=NEGATIVE, label="1e-6")
    rest.axhline(0.0, color=INK, linewidth=0.6)
    rest.set(xlabel="direction [°]", ylabel="W2n", title="(a) from states at rest to …", xlim=(0, 360))
    rest.legend(title="unbalanced force")
    sizes = data[
        (data["set"] == "sizes") & (data.n == 1000) & (data.specimen == "loose") & (data.eta == 0.48) & (data.seed == 1)
    ]
    for colour, alpha in zip(COLOURS, (100, 120, 140, 160), strict=False):
        own = sizes[sizes.alpha == alpha].sort_values("norm")
        size.errorbar(own.norm, own.w2n, own.error, fmt="-o", color=colour, markersize=4, label=f"{alpha}°", capsize=2)
    size.axhline(0.0, color=INK, linewidth=0.6)
    size.set(
        xscale="log", xlabel="norm of the increment", ylabel="W2n", title="(b) size, with errors", ylim=(-1.1, 1.1)
    )
    size.legend(title="direction")
    return figure


def tables(data: pd.DataFrame) -> str:
    """What stands on the page between the marks."""
    return f"{START}\n\n{table_text(compared(data))}\n\n{END}"


def main(folders: list[str]) -> None:
    """Collect, where folders are given; then write the tables and the figures."""
    if folders:
        collected([Path(folder) for folder in folders]).round(6).to_csv(DATA, index=False)
    data = pd.read_csv(DATA)
    text = PAGE.read_text(encoding="utf-8")
    before, after = text.split(START)[0], text.split(END)[1]
    PAGE.write_text(before + tables(data) + after, encoding="utf-8")
    draw = {"convergence_rate": rate_figure, "convergence_start": start_figure}
    for name, figure in ((name, of(data)) for name, of in draw.items() if set(SETS) <= set(data["set"])):
        png, _ = save(figure, ROOT / "build" / "figures", name)
        copyfile(png, PICTURES / png.name)


if __name__ == "__main__":
    main(sys.argv[1:])
