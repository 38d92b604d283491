"""Bad studies: each gives one sentence that names the entry and exit code 2, and leaves the folder as it was."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import pytest

from rendulic.chang_hicher import Parameters
from rendulic.study.language.config import BurstSet, ConeSet, Contact, Figures, Loading, Packing, ProbeSet, Recipe
from rendulic.study.language.element import ElementTest, Model

GOOD = """
[specimen]
n_grains = 100
[[packing]]
name = "loose"
seeds = [1, 2]
eta = [0.1, 0.3]
[[probes]]
name = "circle"
[[cones]]
name = "cones"
[[bursts]]
name = "bursts"
cones = "cones"
[[test]]
name = "drained"
path = "drained"
pressure_pa = 1e5
void_ratio = 0.9
[contact]
[loading]
[material]
[model]
[figures]
"""
SECTIONS = {
    "[specimen]": Recipe, "[[packing]]": Packing, "[[probes]]": ProbeSet, "[[cones]]": ConeSet, "[[bursts]]": BurstSet,
    "[[test]]": ElementTest, "[contact]": Contact, "[loading]": Loading, "[material]": Parameters, "[model]": Model,
    "[figures]": Figures,
}  # fmt: skip


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    """Run `rendulic run study.toml -o out` in this process, in a folder of its own that holds the study."""
    from rendulic.cli import main

    monkeypatch.chdir(tmp_path)

    def do(text):
        data = text if isinstance(text, bytes) else text.encode()
        (tmp_path / "study.toml").write_bytes(data)
        monkeypatch.setattr(sys, "argv", ["rendulic", "run", "study.toml", "-o", "out", "--quiet"])
        with pytest.raises(SystemExit) as left:
            main.run()
        out, err = capsys.readouterr()
        assert [path.name for path in tmp_path.rglob("*")] == ["study.toml"]
        assert (tmp_path / "study.toml").read_bytes() == data
        return SimpleNamespace(returncode=left.value.code, stdout=out, stderr=err)

    return do


def assert_one_sentence(done, words=""):
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("rendulic: ")
    assert len(done.stderr.splitlines()) == 1
    assert "Traceback" not in done.stderr
    assert words in done.stderr


def within(section, line):
    """The good study with a line more, or another, in a section."""
    name = line.split(" = ")[0]
    head, _, tail = GOOD.partition(section + "\n")
    own, bracket, rest = tail.partition("\n[")
    kept = "".join(f"{each}\n" for each in own.splitlines() if each.split(" = ")[0] != name)
    return f"{head}{section}\n{line}\n{kept}{bracket}{rest}"


HAND_WRITTEN = [
    ("", "there is nothing to do: give at least one [[packing]] or one [[test]]"),
    ("title = 'only'", "there is nothing to do"),
    ("[specimen", "study.toml is not a TOML file"),
    ("a = 1\na = 2", "study.toml is not a TOML file"),
    (b"\xff\xfe title", "study.toml is not a TOML file"),
    (b"\x00" * 64, "study.toml is not a TOML file"),
    ("a = " + "[" * 100_000, "study.toml is not a TOML file"),
    ("#" * (2**20 + 1), "larger than 1048576 bytes"),
    ("specimen = 5", "specimen: Input should be a valid dictionary"),
    ("packing = 'loose'", "packing: Input should be a valid tuple"),
    ("[[packing]]\nname = 'a'", "packings need a section [specimen] with at least n_grains"),
    (GOOD.replace("[specimen]\nn_grains = 100", "[specimen]"), "specimen.n_grains: Field required"),
    (GOOD.replace("[[packing]]", "[[packings]]"), "packings: there is no such entry; did you mean 'packing'?"),
    (GOOD.replace("[contact]", "[contacts]"), "contacts: there is no such entry; did you mean 'contact'?"),
    (within("[[packing]]", "sedes = [1]"), "packing.0.sedes: there is no such entry; did you mean 'seeds'?"),
    (within("[[packing]]", "name = '../../etc'"), "packing.0.name: String should match pattern"),
    (within("[[packing]]", "name = '/tmp/x'"), "packing.0.name: String should match pattern"),
    (within("[[packing]]", "name = ''"), "packing.0.name"),
    (within("[[packing]]", "name = '..'"), "packing.0.name"),
    (within("[[packing]]", f"name = '{'a' * 41}'"), "packing.0.name: String should have at most 40 characters"),
    (within("[[test]]", "name = '../drained'"), "test.0.name"),
    (within("[[probes]]", "name = 'a/b'"), "probes.0.name"),
    (within("[[packing]]", "seeds = []"), "packing.0.seeds: there must be at least one seed"),
    (within("[[packing]]", "seeds = [1, 1]"), "values must differ from each other, got 1, 1"),
    (within("[[packing]]", "seeds = [-1]"), "packing.0.seeds.0"),
    (within("[[packing]]", "seeds = [9223372036854775808]"), "packing.0.seeds.0"),
    (within("[[packing]]", "eta = [0.3, 0.1]"), "must increase by at least 0.01"),
    (within("[[packing]]", "eta = [0.3, 0.301]"), "must increase by at least 0.01"),
    (within("[[packing]]", "eta = [3.0]"), "from 0 to below 3"),
    (within("[[packing]]", "eta = [nan]"), "from 0 to below 3"),
    (within("[[packing]]", "eta = [2.4]"), "eta = 2.4 is beyond the strength of any packing of spheres with friction 0.7: the densest lattice carries 2.325"),
    (within("[contact]", "friction = 0.0"), None),
    (within("[contact]", "stiffness_rule = 'harmonc'"), "unknown stiffness_rule 'harmonc': did you mean 'harmonic'?"),
    (within("[specimen]", "pressure_pa = 1e9"), "packing 'loose': a pressure of 1e+09 Pa is unreachable with these contacts"),
    (within("[[packing]]", "pressure_pa = 0.1"), "packing 'loose': a pressure of 0.1 Pa is unreachable"),
    (within("[specimen]", "radius_min_m = 1.0"), "radius_min_m = 1 must not exceed radius_max_m = 0.018"),
    (within("[specimen]", "radius_min_m = 1e-9"), "radius_max_m must not exceed 1000 times radius_min_m"),
    (within("[specimen]", "n_grains = 1000000000"), "specimen.n_grains: Input should be less than or equal to 1000000"),
    (within("[specimen]", "porosity = 0.9"), "specimen.porosity: Input should be less than 0.6"),
    (within("[[probes]]", "step_deg = 7"), "must divide 360 degrees"),
    (within("[[probes]]", "step_deg = 1e-6"), "probes.0.step_deg: Input should be greater than or equal to 0.1"),
    (within("[[probes]]", "norms = [2e-4, 1e-4]"), "norms must be increasing"),
    (within("[[probes]]", "norms = []"), "norms must be increasing"),
    (within("[[probes]]", "norms = [0.01]"), "beyond the margin of 0.0005 m within which neighbours are known: it is a loading, not a probe"),
    (within("[[cones]]", "norm = 0.02"), "cones 'cones': a probe of norm 0.02 moves walls"),
    (within("[[probes]]", "step_deg = 10\nsphere_directions = 100"), "not both"),
    (within("[[probes]]", "sphere_directions = 1000000000"), "less than or equal to 100000"),
    (within("[[probes]]", "packings = ['lose']"), "unknown packing in probes 'circle' 'lose': did you mean 'loose'?"),
    (within("[[probes]]", "seeds = [3]"), "probes 'circle': no packing meant has seed = 3; there are 1, 2"),
    (within("[[probes]]", "eta = [0.2]"), "probes 'circle': no packing meant has eta = 0.2; there are 0.1, 0.3"),
    (within("[[probes]]", "kind = 'stres'"), "probes.0.kind: Input should be 'strain' or 'stress'"),
    (within("[[cones]]", "step_deg = 90"), "cones.0.step_deg: Input should be less than or equal to 60"),
    (within("[[cones]]", "norms = [1e-5, 2e-5]"), "norm = 0.0001 must be one of the norms 1e-05, 2e-05"),
    (within("[[cones]]", "answering = 'cone'"), "unknown set of cones in cones 'cones' 'cone': did you mean 'cones'?"),
    (within("[[cones]]", "answering = 'cones'"), "which are of stress probes themselves"),
    (within("[[bursts]]", "cones = 'kones'"), "unknown set of cones in bursts 'bursts' 'kones': did you mean 'cones'?"),
    (GOOD + "[[packing]]\nname = 'LOOSE'\n", "[[packing]]: each needs a name of its own, got loose, loose"),
    (GOOD + "[[test]]\nname = 'drained'\npath = 'drained'\npressure_pa = 1e5\nvoid_ratio = 0.9\n", "every test needs a name of its own"),
    (within("[figures]", "draw = ['fig1']"), "figures: fig1 needs a [[packing]] that goes to_the_end"),
    (within("[figures]", "draw = ['anatomy']"), "figures: anatomy needs [[probes]] with anatomy = true"),
    (within("[figures]", "draw = ['fig33']"), "unknown figure 'fig33': did you mean 'fig3'?"),
    (within("[figures]", "draw = ['fig3', 'fig3']"), "values must differ from each other"),
    (within("[figures]", "diagram_norm = 1e-3"), "diagram_norm = 0.001 must be one of the norms"),
    (within("[[test]]", "pressure_pa = 1e12"), "study.toml: test 'drained': at 1e+12 Pa the critical void ratio"),
    (within("[[test]]", "path = 'draned'"), "test.0.path: Input should be 'drained'"),
    (within("[[test]]", "ratio = 2.0"), "a path 'drained' has no 'ratio'"),
    (within("[material]", "preset = 'hostun'"), "unknown material 'hostun': did you mean 'hostun_loose'?"),
    (within("[material]", "k_rR = 1e-3"), "k_rR = 0.001 is too small"),
    (within("[model]", "sphere_rule = 'lebedev_4'"), "there is no Lebedev rule of degree 4"),
    (within("[[packing]]", f"seeds = {list(range(10_001))}"), "packing.0.seeds: Tuple should have at most 10000 items"),
    (within("[[packing]]", f"seeds = {list(range(9_000))}").replace('name = "circle"', 'name = "circle"\nsphere_directions = 90000'),
     "the study asks for 231516001 units of work, and 1000000 are allowed: split it"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), [case for case in HAND_WRITTEN if case[1]])
def test_hand_written(run, text, words):
    """The entry, what is wrong with it and what would be right."""
    assert_one_sentence(run(text), words)


def generated():
    """Every entry of every section misspelt, and with values of kinds that it cannot have."""
    for section, model in SECTIONS.items():
        where = section.strip("[]") + (".0" if section.startswith("[[") else "")
        for name in model.model_fields:
            wrong = f"{name}_"
            yield pytest.param(
                within(section, f"{wrong} = 1"),
                f"{where}.{wrong}: there is no such entry; did you mean '{name}'?",
                id=f"{where}.{wrong}",
            )
            for value in ("{ a = 1 }", "1979-05-27", "[[[]]]", "nan"):
                yield pytest.param(
                    within(section, f"{name} = {value}"), f"{where}.{name}", id=f"{where}.{name}={value}"
                )


@pytest.mark.parametrize(("text", "words"), generated())
def test_generated(run, text, words):
    """Misspelt entries name the nearest valid one, values of a wrong kind the entry."""
    assert_one_sentence(run(text), words)


def numbers():
    for section, model in SECTIONS.items():
        for name, about in model.model_fields.items():
            kinds = {str(about.annotation)} | {str(each) for each in getattr(about.annotation, "__args__", ())}
            if name != "answering" and any(
                kind in ("<class 'float'>", "<class 'int'>") or "Annotated[" in kind for kind in kinds
            ):
                yield section, name


@pytest.mark.parametrize("value", ['"1"', "true", "-1", "inf", "1e400"])
@pytest.mark.parametrize(("section", "name"), numbers())
def test_what_is_no_admissible_number(run, section, name, value):
    """Text, truth, negative and infinite numbers are refused where a number is wanted; nothing is converted silently."""
    if (name, value) in {("until_eta", "-1"), ("ratio", "-1")}:
        value = '"-1"'  # these may be negative
    assert_one_sentence(run(within(section, f"{name} = {value}")), name)


def test_enough_of_them():
    """A list of at least sixty, by hand, and several times that generated."""
    assert len([case for case in HAND_WRITTEN if case[1]]) >= 60
    assert len(list(generated())) > 300


def test_the_good_one_is_good(tmp_path):
    """What the bad ones are made from is a study."""
    from rendulic.study.language.study_file import read_study
    from rendulic.study.plan import plan_of

    (tmp_path / "good.toml").write_text(GOOD)
    assert {unit.kind for unit in plan_of(read_study(tmp_path / "good.toml")).units.values()} == {
        "packing", "state", "probes", "cone", "bursts", "element_test"
    }  # fmt: skip
