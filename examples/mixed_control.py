"""One sand, six tests: what is controlled decides when control is lost.

Any linear combination of stresses and the conjugate one of strains can be driven. Run it with
``python examples/mixed_control.py [FOLDER]``.
"""

import sys

import rendulic as rd


def main(folder: str = ".") -> None:
    sand = rd.ChangHicher.preset("hostun_loose")
    # your own: q is prescribed at constant volume, instead of the axial strain
    by_load = rd.Control.of_strains([[1, 0, 0], [1, 1, 1], [0, 1, -1]], ("stress", "strain", "strain"))
    tests = {
        "drained": rd.paths.drained_triaxial(until_strain=0.05),
        "undrained": rd.paths.constant_volume(until_strain=0.05),
        "constant p": rd.paths.constant_p(until_strain=0.05),
        "proportional, R = 0.8": rd.paths.proportional(ratio=0.8, until_strain=0.05),
        "oedometric": rd.paths.oedometric(until_strain=0.02),
        "undrained, q prescribed": rd.paths.Path("q", by_load, stress=(400e3, None, None)),
    }
    curves = {}
    for name, path in tests.items():
        point = sand.at(pressure=300e3, void_ratio=0.9)
        curves[name] = point.load(path)
        print(
            f"{name:24s} q = {float(curves[name].q[-1]) / 1e3:6.1f} kPa at {100 * float(curves[name].eps_1[-1]):5.2f} %, "
            f"stopped by {curves[name].attrs['stopped_by']}"
        )
    print(*rd.figures.save(rd.figures.element_tests(curves, "Loose Hostun sand"), folder, "mixed_control"))


if __name__ == "__main__":
    main(*sys.argv[1:2])
