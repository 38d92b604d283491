"""Through which contacts does a packing lose second-order work?

Two snapshots are enough, of any engine: here a packing before and after a probe. Run it with
``python examples/two_states.py [FOLDER]``.
"""

import sys

import rendulic as rd
from rendulic.tensors.rendulic_plane import increment_along


def main(folder: str = ".", n_grains: int = 400) -> None:
    sample = rd.dem.pack(n_grains, radius=(4e-3, 12e-3), pressure=200e3, seed=2)
    sample.load(rd.paths.drained_triaxial(until_eta=0.4))
    rd.dem.bring_to_rest(sample, "stress")

    # one probe by hand: a copy takes the increment, and stands still before and after it for a picture
    probed = sample.clone()
    probed.probe(increment_along(130.0, 2e-4), n_steps=4000)
    before, after = sample.snapshot(), probed.snapshot()

    work = rd.second_order_work(before, after)
    print(f"at the walls     {work.boundary:+.4e} J/m3")
    print(f"at the contacts  {work.contacts:+.4e}, of grains out of balance {work.grains:+.4e}")
    print(f"their difference {work.identity_residual:.0e} of the largest term; W2n = {work.normalised:+.3f}")
    print(f"without contacts that opened or were created: {work.paper:+.4e}")
    for name, value in work.by_class.items():
        print(f"  {name:8s} {value:+.3e}")

    found = rd.anatomy(before, after)
    print(f"{100 * float(found.negative_contacts):.0f} % of the contacts have negative work;")
    print(f"{100 * float(found.carriers):.1f} % of them all carry half of it")
    print(*rd.figures.save(rd.figures.anatomy(found, "A probe at 130 degrees"), folder, "two_states"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
