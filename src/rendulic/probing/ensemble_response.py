"""What many specimens of one kind answer together: the mean response, and how sure it is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rendulic.foundation.checks import whole_number
from rendulic.foundation.errors import InvalidInput
from rendulic.probing.bootstrap import bounds_of_mean, wilson
from rendulic.probing.edges import largest_gap
from rendulic.probing.mean_cone import mean_cone
from rendulic.probing.second_order_work import normalised

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FEW", "QUANTILES", "ensemble_response"]

FEW = 8  # specimens: with fewer no sign is called sure, as intervals then miss more often than they say
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
MOST_TOO_FAST = 0.25  # of the probes in a direction: with more, the mean is that of fast probes, and no sign is sure
WIDEST = 60.0  # degrees between directions that go all around
ALIKE = 1e-9  # relative difference of norms and directions that are the same
# errors that differ from specimen to specimen without a common cause; the second, how much W2 changes with a little more strain, is
# nothing but the specimen's chance, which resampling specimens sees
OF_CHANCE = ("error_imbalance", "error_size")
MOST_NAMED = 4  # specimens in one sentence

Given = Mapping[Any, Any] | Sequence[Any]


def ensemble_response(probes: Given, *, confidence: float = 0.95, n_resamples: int = 4000, seed: int = 0) -> xr.Dataset:
    """The mean response of several specimens of one kind at one stress ratio, and how sure its second-order work is.

    One packing shows the avalanche that it happens to be before. What the material does is the mean response: the
    increment that is imposed is the same for all specimens, and the increment that answers is averaged.

    Parameters
    ----------
    probes : sequence or mapping of label to xarray.Dataset
        From `rd.probe`, of each specimen, any engine; the same directions and norms. A specimen that has no probes stands as
        None, or as the words why not (a string): it is counted and named.
    confidence : float
        Of all intervals.
    n_resamples, seed : int
        Of the bootstrap over specimens.

    Returns
    -------
    xarray.Dataset
        Dimensions as of `rd.probe`, and `specimen`, `quantile`, `sector`, `sure_sector`, `possible_sector`. Work in J/m3, directions in
        degrees. At every direction (and norm):

        - `d_sigma`, `d_eps` of the mean response, `w2_macro` and `w2_normalised` of it, each with `..._lower` and
          `..._upper`; `w2_error`, the part of the interval that comes from within the specimens. `is_significant`
          where the interval has zero outside, there are eight specimens at least, and at most a quarter were too fast.
        - `negative_share` of specimens with W2 < 0 with its bounds (Wilson); `w2_normalised_quantiles` of the specimens,
          and `w2_normalised_of` each.
        - How much one specimen rules the mean: `largest_share` is the largest |W2| of one specimen over the sum of all
          (1 / n if all are alike), `without_one_lower` and `..._upper` the W2n of the mean without one of them, `is_ruled_by_one`
          whether that changes the sign; `skewness` of W2.
        - `n_specimens` that count; of these `n_unsettled`, `n_too_fast`, `n_not_reached`, `n_not_significant`.

        At every norm the cone: of the mean `sector_from`, `sector_to` with intervals `..._lower`, `..._upper` (NaN: none on that
        side) and `sector_share`, the share of resamples that have the sector; the `sure_from`, `sure_to` in which
        the upper bound is negative, and `possible_from`, `possible_to` in which the lower is; `opening`, `sure_opening`, `possible_opening` (lower bound negative). And
        `negative_somewhere_share`, of specimens with W2 < 0 in any direction, with its bounds.

        `told` says for each specimen what is wrong with it, the attribute `told_of_all` what to know of all, one thing a line.

    Raises
    ------
    InvalidInput
        If no specimen has probes, or they are of different kinds.

    Notes
    -----
    Intervals are those of the studentised bootstrap (`rendulic.probing.bootstrap`), direction by direction: of 20 directions at which
    W2 is zero, one is called sure by chance. What none of n specimens does may still be done by up to
    `unseen_share` (attribute) of all, and rare collapses can turn the sign of a mean. Edges are linear between directions.

    Examples
    --------
    >>> import rendulic as rd
    >>> sands = (rd.ChangHicher().at(pressure=p, void_ratio=0.9) for p in (299e3, 300e3, 301e3))
    >>> found = rd.ensemble_response([rd.probe(sand, rd.directions.rendulic(30), 1e-6) for sand in sands])
    >>> found.sizes["specimen"], bool(found.is_significant.any())
    (3, False)
    """
    import xarray as xr

    if not 0.5 <= confidence < 1.0:
        raise InvalidInput(f"the confidence of intervals must be from 0.5 to below 1, got {confidence!r}")
    n_resamples, seed = whole_number("n_resamples", n_resamples, 200), whole_number("seed", seed, 0)
    own = _together(probes)
    one, n = own.template, len(own.labels)
    is_strain = one.attrs["kind"] == "strain"
    imposed_name, answer_name = ("d_eps", "d_sigma") if is_strain else ("d_sigma", "d_eps")
    shape, dims = own.work.shape[1:], own.dims
    flat = {name: own.of[name].reshape(n, -1, 3) for name in ("d_sigma", "d_eps")}
    there = np.isfinite(flat["d_sigma"]).all(axis=-1) & np.isfinite(flat["d_eps"]).all(axis=-1)
    count = there.sum(axis=0)
    mean = {name: _mean(np.where(there[..., None], values, np.nan)) for name, values in flat.items()}
    error = _mean(np.where(there, own.error.reshape(n, -1), np.nan))
    chance = np.where(there, own.chance.reshape(n, -1), 0.0)
    error = error + np.divide(np.sqrt((chance**2).sum(axis=0)), count, out=np.zeros(count.shape), where=count > 0)
    present = there.any(axis=1)
    bounds = bounds_of_mean(
        mean[imposed_name], np.where(there[..., None], flat[answer_name], np.nan)[present], error, confidence, n_resamples, seed
    )  # fmt: skip
    work, w2n = (mean["d_sigma"] * mean["d_eps"]).sum(axis=-1), normalised(mean["d_sigma"], mean["d_eps"])
    each = np.where(there, own.work.reshape(n, -1), np.nan)
    each_w2n = np.where(there, own.w2n.reshape(n, -1), np.nan)
    numbers = {name: (flags.reshape(n, -1) & there).sum(axis=0) for name, flags in own.flags.items()}
    can_be_sure = (count >= FEW) & (numbers["n_too_fast"] <= MOST_TOO_FAST * count)
    values = {
        "w2_macro": work, "w2_macro_lower": bounds.work[0], "w2_macro_upper": bounds.work[1], "w2_error": error,
        "w2_normalised": w2n, "w2_normalised_lower": bounds.work_normalised[0], "w2_normalised_upper": bounds.work_normalised[1],
        "is_significant": ((bounds.work[0] > 0.0) | (bounds.work[1] < 0.0)) & can_be_sure,
        "n_specimens": count, **_shares("negative", (each < 0.0).sum(axis=0), count, confidence),
        **_tails(each, flat[answer_name], there, mean[imposed_name], w2n),
        **numbers,
    }  # fmt: skip
    variables: dict[str, Any] = {
        name: (dims, value.reshape(shape), _about(name, confidence)) for name, value in values.items()
    }
    for name, value in mean.items():
        variables[name] = ((*dims, "component"), value.reshape(*shape, 3), one[name].attrs)
    quantiles = _quantiles(each_w2n)
    variables["w2_normalised_quantiles"] = (
        ("quantile", *dims), quantiles.reshape(-1, *shape), {"long_name": "quantiles of W2n of the specimens", "units": "1"},
    )  # fmt: skip
    about = {"long_name": "W2n of each specimen", "units": "1"}
    variables["w2_normalised_of"] = (("specimen", *dims), each_w2n.reshape(n, *shape), about)
    somewhere = _somewhere(each.reshape(n, *shape), each_w2n.reshape(n, *shape), confidence)
    variables |= {name: (dims[:-1], value, _about(name, confidence)) for name, value in somewhere.items()}
    variables["told"] = ("specimen", np.array(own.told, dtype=object), {"long_name": "what is wrong with a specimen"})
    coords = {
        name: coordinate for name, coordinate in one.coords.items() if set(coordinate.dims) <= {*dims, "component"}
    }
    result = xr.Dataset(
        variables, {**coords, "specimen": own.labels, "quantile": list(QUANTILES)},
        {
            "kind": one.attrs["kind"], "confidence": confidence, "n_specimens": int(present.sum()),
            "unseen_share": 1.0 - (1.0 - confidence) ** (1.0 / max(int(present.sum()), 1)), "sign": "compression positive",
        },
    )  # fmt: skip
    cones = _cones(result, bounds.negative, can_be_sure, shape)
    if cones is not None:
        result = result.merge(cones)
    result.attrs["told_of_all"] = "\n".join(_told(result, own, cones is not None))
    return result


# -- specimens as one table ----------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Together:
    """Probes of all specimens on one set of directions and norms; NaN where a specimen has none."""

    labels: list[str]
    told: list[str]
    template: xr.Dataset
    dims: tuple[str, ...]
    of: dict[str, np.ndarray]
    work: np.ndarray
    w2n: np.ndarray
    error: np.ndarray
    chance: np.ndarray
    flags: dict[str, np.ndarray]
    error_is_drift: bool


def _together(probes: Given) -> _Together:
    pairs = list(probes.items()) if isinstance(probes, Mapping) else list(enumerate(probes))
    labels = [str(label) for label, _ in pairs]
    given = {str(label): data for label, data in pairs if hasattr(data, "data_vars")}
    told = {
        str(label): data if isinstance(data, str) else "missing" for label, data in pairs if str(label) not in given
    }
    if not given:
        raise InvalidInput(
            "an ensemble needs probes of one specimen at least (datasets of rd.probe), "
            f"got {len(pairs)} specimens without any" + (f": {'; '.join(told.values())}" if told else "")
        )
    for label, data in given.items():
        _check(label, data)
    kinds = {str(data.attrs.get("kind", "strain")) for data in given.values()}
    if len(kinds) > 1:
        raise InvalidInput("specimens of an ensemble must all have strain probes or all stress probes, got both")
    common = Counter(map(_grid, given.values())).most_common(1)[0][0]
    template = next(data for data in given.values() if _grid(data) == common).assign_attrs(kind=kinds.pop())
    dims = tuple(map(str, template.w2_macro.dims))
    if "alpha" in dims:
        template = template.sortby("alpha")
    rows = {}
    for label, data in given.items():
        rows[label], note = _on(template, dims, data)
        if not note and not np.isfinite(rows[label].w2_macro.values).any():
            note = "none of its probes has a number"
        if note:
            told[label] = note
    empty = template.where(False)
    every = [rows.get(label, empty) for label in labels]

    def stack(pick) -> np.ndarray:
        return np.stack([np.asarray(pick(data), dtype=float) for data in every])

    def flags(name: str, wrong: bool) -> np.ndarray:
        """Where a flag is what it should not be; nowhere, if specimens do not have it."""
        return (
            stack(lambda data: data[name] == float(wrong) if name in data else np.zeros(template.w2_macro.shape)) > 0.5
        )

    has_error = all("w2_error" in data for data in given.values())
    has_parts = has_error and all(set(OF_CHANCE) <= set(data.data_vars) for data in given.values())
    name = "w2_error" if has_error else "w2_drift"
    chance = [np.abs(stack(lambda data, part=part: data[part])) if has_parts else np.zeros(1) for part in OF_CHANCE]
    return _Together(
        labels=labels,
        told=[told.get(label, "") for label in labels],
        template=template,
        dims=dims,
        of={name: stack(lambda data, n=name: data[n].transpose(*dims, "component")) for name in ("d_sigma", "d_eps")},
        work=stack(lambda data: data.w2_macro),
        w2n=stack(lambda data: data.w2_normalised),
        error=np.maximum(np.abs(stack(lambda data: data[name])) - sum(chance), 0.0),
        chance=np.broadcast_to(chance[0], (len(labels), *template.w2_macro.shape)),
        flags={
            "n_unsettled": flags("is_settled", False), "n_too_fast": flags("is_too_fast", True),
            "n_not_reached": flags("is_reached", False), "n_not_significant": flags("is_significant", False),
        },
        error_is_drift=not has_error,
    )  # fmt: skip


def _check(label: str, data: xr.Dataset) -> None:
    needed = ("d_sigma", "d_eps", "w2_macro", "w2_normalised", "w2_drift")
    if missing := [name for name in needed if name not in data]:
        raise InvalidInput(f"an ensemble needs datasets of rd.probe; that of {label!r} has no {', '.join(missing)}")
    if not {"alpha", "direction"} & set(map(str, data.w2_macro.dims)):
        raise InvalidInput(f"the probes of {label!r} have no directions, dimensions are {tuple(data.w2_macro.dims)}")


def _norms(data: xr.Dataset) -> np.ndarray:
    return np.atleast_1d(data.norm.values) if "norm" in data.coords else np.array([np.nan])


def _rounded(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(f"{value:.9g}") for value in np.ravel(values))


def _grid(data: xr.Dataset) -> tuple:
    """Directions and norms, for telling whether they are the same."""
    if "alpha" in data.dims:
        around: tuple = tuple(sorted(_rounded(data.alpha.values)))
    else:
        around = _rounded(np.stack([data[f"along_{k}"].values for k in (1, 2, 3)]))
    return tuple(map(str, data.w2_macro.dims)), around, _rounded(_norms(data))


def _on(template: xr.Dataset, dims: tuple[str, ...], data: xr.Dataset) -> tuple[xr.Dataset, str]:
    """Probes of one specimen at the directions and norms of the template, and what they lack of these."""
    if _grid(data) == _grid(template):
        data = data.sortby("alpha") if "alpha" in dims else data
        same = {name: template[name] for name in dims}
        return data.transpose(*dims, ...).assign_coords(same), ""
    empty = template.where(False)
    if set(map(str, data.w2_macro.dims)) != set(dims):
        return (
            empty,
            f"left out: its dimensions are {', '.join(map(str, data.w2_macro.dims))}, of most {', '.join(dims)}",
        )
    if "alpha" not in dims:
        return empty, "left out: its directions on the sphere are others than those of most"
    indexers = {name: template[name].values for name in dims}
    if "norm" not in dims and not np.allclose(_norms(data), _norms(template), rtol=ALIKE, equal_nan=True):
        return empty, f"left out: its norm is {_norms(data)[0]:g}, that of most {_norms(template)[0]:g}"
    found = data.drop_duplicates("alpha").astype(float, copy=False)
    for name in dims:
        found = found.reindex({name: indexers[name]}, method="nearest", tolerance=ALIKE * np.abs(indexers[name]).max())
    lacks = int(found.w2_macro.isnull().sum())
    extra = data.w2_macro.size - (found.w2_macro.size - lacks)
    return found.transpose(*dims, ...), (
        f"its directions or norms are others than those of most: it lacks {lacks} of {found.w2_macro.size} probes"
        + (f", and {extra} of its own are not used" if extra > 0 else "")
    )


# -- statistics ----------------------------------------------------------------------------------


def _mean(values: np.ndarray) -> np.ndarray:
    """Over specimens; NaN where there is none."""
    count = np.isfinite(values).sum(axis=0)
    return np.divide(np.nansum(values, axis=0), count, out=np.full(values.shape[1:], np.nan), where=count > 0)


def _shares(name: str, count: np.ndarray, total: np.ndarray, confidence: float) -> dict[str, np.ndarray]:
    low, high = wilson(count, total, confidence)
    share = np.divide(count, total, out=np.full(np.shape(total), np.nan), where=total > 0)
    return {f"{name}_share": share, f"{name}_share_lower": low, f"{name}_share_upper": high}


def _quantiles(each: np.ndarray) -> np.ndarray:
    found = np.full((len(QUANTILES), each.shape[1]), np.nan)
    some = np.isfinite(each).any(axis=0)
    found[:, some] = np.nanquantile(each[:, some], QUANTILES, axis=0)
    return found


def _somewhere(each: np.ndarray, w2n: np.ndarray, confidence: float) -> dict[str, np.ndarray]:
    """Of the specimens that have all directions."""
    whole = np.isfinite(w2n).all(axis=-1)
    negative = whole & (np.where(np.isfinite(each), each, 1.0) < 0.0).any(axis=-1)
    return _shares("negative_somewhere", negative.sum(axis=0), whole.sum(axis=0), confidence)


def _tails(
    each: np.ndarray, answers: np.ndarray, there: np.ndarray, imposed: np.ndarray, w2n: np.ndarray
) -> dict[str, np.ndarray]:
    """How much one specimen rules the mean."""
    from scipy.stats import skew

    known = np.where(there, each, 0.0)
    size = np.abs(known)
    total, count = size.sum(axis=0), there.sum(axis=0)
    largest = np.divide(size.max(axis=0), total, out=np.full(total.shape, np.nan), where=total > 0.0)
    several = count >= 3
    lop = np.full(total.shape, np.nan)
    alike = np.ptp(known, axis=0) <= 1e-12 * size.max(axis=0)
    lop[several & ~alike] = skew(each[:, several & ~alike], axis=0, bias=False, nan_policy="omit")
    kept = np.where(there[..., None], answers, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        without = (kept.sum(axis=0) - kept) / (count - 1.0)[:, None]
    rest = np.where(there & (count > 1), normalised(without, np.broadcast_to(imposed, without.shape)), np.nan)
    some = np.isfinite(rest).any(axis=0)
    low, high = np.full(total.shape, np.nan), np.full(total.shape, np.nan)
    low[some], high[some] = np.nanmin(rest[:, some], axis=0), np.nanmax(rest[:, some], axis=0)
    return {
        "largest_share": largest, "skewness": lop, "without_one_lower": low, "without_one_upper": high,
        "is_ruled_by_one": np.where(w2n < 0.0, high >= 0.0, low < 0.0) & some,
    }  # fmt: skip


def _cones(
    result: xr.Dataset, negative: np.ndarray, can_be_sure: np.ndarray, shape: tuple[int, ...]
) -> xr.Dataset | None:
    """The cone at every norm; None if the directions do not go all around the Rendulic plane."""
    import xarray as xr

    if "alpha" not in result.dims or largest_gap(result.alpha.values) > WIDEST:
        return None
    names = ("w2_macro", "w2_macro_lower", "w2_macro_upper")
    value, lower, upper = (result[name].values.reshape(-1, shape[-1]) for name in names)
    # what is not sure at all has no bounds
    known = can_be_sure.reshape(value.shape)
    lower, upper = np.where(known, lower, -np.inf), np.where(known, upper, np.inf)
    of = negative.reshape(len(negative), *value.shape)
    cones = [mean_cone(result.alpha.values, value[k], lower[k], upper[k], of[:, k]) for k in range(len(value))]
    outer = shape[:-1]
    dims = ("norm",) if outer else ()

    def table(rows: list[list[float]]) -> np.ndarray:
        width = max([1, *map(len, rows)])
        return np.array([row + [np.nan] * (width - len(row)) for row in rows]).reshape(*outer, width)

    def about(words: str, units: str = "degree") -> dict[str, str]:
        return {"long_name": words, "units": units}

    def of_sectors(pick) -> np.ndarray:
        return table([[pick(one) for one in cone.sectors] for cone in cones])

    sector, sure, possible = (*dims, "sector"), (*dims, "sure_sector"), (*dims, "possible_sector")
    openings = np.array([cone.openings for cone in cones]).T.reshape(3, *outer)
    return xr.Dataset({
        "sector_from": (sector, of_sectors(lambda one: one.first), about("first direction of negative mean W2")),
        "sector_from_lower": (sector, of_sectors(lambda one: one.first_interval[0]), about("its interval, outer end")),
        "sector_from_upper": (sector, of_sectors(lambda one: one.first_interval[1]), about("its interval, inner end")),
        "sector_to": (sector, of_sectors(lambda one: one.last), about("last direction of negative mean W2")),
        "sector_to_lower": (sector, of_sectors(lambda one: one.last_interval[0]), about("its interval, inner end")),
        "sector_to_upper": (sector, of_sectors(lambda one: one.last_interval[1]), about("its interval, outer end")),
        "sector_share": (sector, of_sectors(lambda one: one.share), about("share of resamples with this sector", "1")),
        "sure_from": (sure, table([[span[0] for span in cone.sure] for cone in cones]), about("first sure direction")),
        "sure_to": (sure, table([[span[1] for span in cone.sure] for cone in cones]), about("last sure direction")),
        "possible_from": (possible, table([[span[0] for span in cone.possible] for cone in cones]), about("first possible direction")),
        "possible_to": (possible, table([[span[1] for span in cone.possible] for cone in cones]), about("last possible direction")),
        "opening": (dims, openings[0], about("angle of all directions of negative mean W2")),
        "sure_opening": (dims, openings[1], about("angle of those that are sure")),
        "possible_opening": (dims, openings[2], about("angle of those that may be negative")),
    })  # fmt: skip


# -- words ---------------------------------------------------------------------------------------


def _about(name: str, confidence: float) -> dict[str, str]:
    stem, _, end = name.rpartition("_")
    if end in ("lower", "upper") and stem in LABELS:
        label, units = LABELS[stem]
        own = "" if stem == "without_one" else f", {end} bound at {100 * confidence:g} %"
        return {"long_name": f"{label}{own or f', {end}most'}", "units": units}
    label, units = LABELS[name]
    return {"long_name": label, "units": units}


LABELS = {
    "w2_macro": ("second-order work of the mean response", "J/m3"),
    "w2_normalised": ("normalised second-order work of the mean response", "1"),
    "w2_error": ("error of the mean work from within the specimens", "J/m3"),
    "is_significant": ("the interval of the mean work has zero outside", "1"),
    "n_specimens": ("specimens that count", "1"),
    "negative_share": ("share of specimens with negative work", "1"),
    "negative_somewhere_share": ("share of specimens with negative work in any direction", "1"),
    "largest_share": ("largest |work| of one specimen over the sum of all", "1"),
    "skewness": ("skewness of the specimens' work", "1"),
    "without_one": ("W2n of the mean without one of the specimens", "1"),
    "is_ruled_by_one": ("without one of the specimens the mean has the other sign", "1"),
    "n_unsettled": ("specimens whose probe did not come to rest", "1"),
    "n_too_fast": ("specimens whose probe was too fast", "1"),
    "n_not_reached": ("specimens that did not reach the increment", "1"),
    "n_not_significant": ("specimens whose own sign is not sure", "1"),
}


def _named(labels: Sequence[str]) -> str:
    if len(labels) <= MOST_NAMED + 1:
        return ", ".join(labels)
    return f"{', '.join(labels[:MOST_NAMED])} and {len(labels) - MOST_NAMED} more"


def _told(result: xr.Dataset, own: _Together, has_cone: bool) -> list[str]:
    """What to know before one believes the numbers, a sentence each."""
    n, told = result.attrs["n_specimens"], []
    probes = int(result.n_specimens.sum())
    if n == 1:
        told.append("One specimen shows chance: nothing is known of the mean.")
    elif n < FEW:
        told.append(f"With {n} specimens (fewer than {FEW}) no sign is called sure: intervals then miss too often.")
    reasons: dict[str, list[str]] = {}
    for label, words in zip(own.labels, own.told, strict=True):
        if words:
            reasons.setdefault(words, []).append(label)
    told += [f"{_named(labels)}: {words}." for words, labels in reasons.items()]
    if int(result.n_specimens.min()) < n:
        told.append(f"Some directions have {int(result.n_specimens.min())} of {n} specimens.")
    for name, words in (
        ("n_unsettled", "did not come to rest"), ("n_too_fast", "were too fast"),
        ("n_not_reached", "did not reach their increment"),
    ):  # fmt: skip
        if count := int(result[name].sum()):
            told.append(f"{count} of {probes} probes {words}; they are in the mean.")
    if bool((result.n_too_fast > MOST_TOO_FAST * result.n_specimens).any()):
        told.append(
            f"Where more than {MOST_TOO_FAST:.0%} of the probes were too fast no sign is called sure: probe more slowly."
        )
    if twins := _twins(own):
        told.append(f"{_named(twins)} give the same response in all directions: is one specimen there twice?")
    if ruled := int(result.is_ruled_by_one.sum()):
        told.append(
            f"In {ruled} of {result.is_ruled_by_one.size} directions the mean changes its sign without one of the specimens."
        )
    if n > 1:
        told.append(
            f"What none of {n} specimens does may still be done by up to {100 * result.attrs['unseen_share']:.0f} % of all."
        )
    if own.error_is_drift:
        told.append("Of the errors within a specimen only the drift of its null probe is known.")
    if not has_cone and "alpha" in result.dims:
        told.append(f"The directions do not go all around (gaps of more than {WIDEST:g} degrees): there are no edges.")
    return told


def _twins(own: _Together) -> list[str]:
    """Labels of specimens with the same response to the last bit."""
    seen: dict[bytes, str] = {}
    found = []
    for label, response in zip(own.labels, own.of["d_sigma"], strict=True):
        if np.isfinite(response).any():
            key = response.tobytes()
            found += [seen[key], label] if key in seen else []
            seen.setdefault(key, label)
    return list(dict.fromkeys(found))
