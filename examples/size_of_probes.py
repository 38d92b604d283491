"""How large must a probe be? W2n of one state against the size of the increment.

A packing at rest answers elastically until a probe reaches its yield surface again. Run it with
``python examples/size_of_probes.py [FOLDER]``.
"""

import sys

import rendulic as rd


def main(folder: str = ".", n_grains: int = 400) -> None:
    sample = rd.dem.pack(n_grains, radius=(4e-3, 12e-3), pressure=200e3, seed=2)
    sample.load(rd.paths.drained_triaxial(until_eta=0.4))
    rest = rd.dem.bring_to_rest(sample, "stress")
    print(rest.equilibrium)

    table = rd.cones_by_amplitude(sample, [1e-5, 3e-5, 1e-4, 3e-4], rd.directions.rendulic(20), tolerance=2)
    for norm in table.norm.values:
        one = table.sel(norm=norm)
        print(
            f"norm {norm:g}: smallest W2n {float(one.smallest_w2n):+.3f} at {float(one.smallest_alpha):.0f} degrees, "
            f"unstable over {float(one.opening):.1f} degrees"
        )
    print(f"a range of sizes that does not matter: {table.attrs['plateau_verdict']}")
    print(*rd.figures.save(rd.figures.amplitude({"eta = 0.4": table}), folder, "size_of_probes"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
