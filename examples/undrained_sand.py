"""From parameters to an undrained test to the plane that fails first.

Run it with ``python examples/undrained_sand.py [FOLDER]``, or cell by cell in an editor that knows `# %%`.
"""

# %%
import sys

import rendulic as rd
from rendulic.chang_hicher import closed_form_cone, stability


def main(folder: str = ".") -> None:
    # %% a loose Hostun sand with more dilatancy than the preset, at 300 kPa
    hostun = rd.chang_hicher.material("hostun_loose")
    # the paper's 37 planes have few inclinations, which can be told by name; the default's 295 are more exact
    sand = rd.ChangHicher(rule=rd.tensors.sphere_rules.bazant_oh_37(), **{**hostun, "dilatancy": 1.2})
    point = sand.at(pressure=300e3, void_ratio=0.9)

    # %% undrained compression, and what happened on the way
    curve = point.load(rd.paths.constant_volume(until_strain=0.2))
    print(f"stopped by {curve.attrs['stopped_by']} with q = {float(curve.q[-1]) / 1e3:.1f} kPa, {point!r}")
    seen = set()
    events = (curve.event_kind.values, curve.event_plane.values, curve.event_eps_1.values)
    for kind, plane, strain in zip(*events, strict=True):
        where = "assembly" if plane < 0 else f"planes at {float(curve.inclination[plane]):.1f} deg"
        if (kind, where) not in seen and kind in ("q_peak", "w2_lost", "plane_w2_lost"):
            seen.add((kind, where))
            print(f"  {100 * strain:6.3f} %  {kind:14s} {where}")

    # %% the plane that fails first
    first = int(curve.event_plane[curve.event_kind.values == "plane_w2_lost"][0])
    normal = curve.plane_normal.values[first]
    print(f"first to lose work: plane {first}, normal {normal.round(3)}, {float(curve.inclination[first]):.1f} deg")

    # %% around the peak: in which directions, not only along this path, is the state unstable?
    peak = float(curve.event_eps_1[curve.event_kind.values == "q_peak"][0])
    for share in (0.97, 1.03):
        state = sand.at(pressure=300e3, void_ratio=0.9)
        state.load(rd.paths.constant_volume(until_strain=share * peak))
        cone = rd.instability_cone(state, norm=1e-6, tolerance=0.05)
        print(
            f"at {share:g} of the peak's strain: Hill's smallest eigenvalue "
            f"{stability(state, [1, -0.5, -0.5]).hill / 1e6:+.2f} MPa, unstable sectors "
            f"{[(round(a, 2), round(b, 2)) for a, b in closed_form_cone(state)]} from the tangent, "
            f"{[(round(a, 2), round(b, 2)) for a, b in cone.sectors]} by probing; "
            f"smallest W2n {cone.smallest_w2n:+.3f} at {cone.smallest_alpha:.1f} deg"
        )

    # %% pictures
    print(*rd.figures.save(rd.figures.element_tests({"D = 1.2": curve}), folder, "undrained_sand"))
    rd.figures.save(rd.figures.plane_work(curve), folder, "undrained_sand_planes")


if __name__ == "__main__":
    main(*sys.argv[1:2])
