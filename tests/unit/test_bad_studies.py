"""Bad studies: each gives one sentence that names the entry and exit code 2, and leaves the folder as it was."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import pytest

from rendulic.chang_hicher import Parameters
from rendulic.study.language.study import Figures
from rendulic.study.specimens.chang_hicher import SandSpecimen
from rendulic.study.specimens.grains import Contact, GrainsSpecimen, Loading
from rendulic.study.tasks.measurement import measurements

GOOD = """
[[specimen]]
kind = "chang_hicher"
name = "hostun"
pressure_pa = 1e5
void_ratios = [0.9]
[specimen.material]
[[specimen]]
kind = "grains"
n_grains = 100
name = "loose"
seeds = [1, 2]
eta = [0.1, 0.3]
[specimen.contact]
[specimen.loading]
[[probes]]
name = "circle"
[[cones]]
name = "cones"
[[stress_probes]]
name = "stress"
cones = "cones"
[[bursts]]
name = "bursts"
cones = "cones"
[[path]]
name = "drained"
path = "drained"
[[plane_law]]
name = "fig6"
vary = { k_pR = [0.5, 1.0] }
[figures]
"""
GRAINS, SAND = '[[specimen]]\nkind = "grains"', '[[specimen]]\nkind = "chang_hicher"'
# where a section begins, its model, and how it is called in messages
SECTIONS = {
    GRAINS: (GrainsSpecimen, "specimen 'loose', "), SAND: (SandSpecimen, "specimen 'hostun', "),
    "[specimen.material]": (Parameters, "specimen 'hostun', material, "),
    "[specimen.contact]": (Contact, "specimen 'loose', contact, "), "[specimen.loading]": (Loading, "specimen 'loose', loading, "),
    **{f"[[{table}]]": (model, f"{table} ") for table, model in measurements().items()}, "[figures]": (Figures, "figures, "),
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
    ("", "there is nothing to do: give at least one [[specimen]]"),
    ("title = 'only'", "there is nothing to do"),
    ("[specimen", "study.toml is not a TOML file"),
    ("a = 1\na = 2", "study.toml is not a TOML file"),
    (b"\xff\xfe title", "study.toml is not a TOML file"),
    (b"\x00" * 64, "study.toml is not a TOML file"),
    ("a = " + "[" * 100_000, "study.toml is not a TOML file"),
    ("#" * (2**20 + 1), "larger than 1048576 bytes"),
    ("specimen = 5", "specimen: expected tables in double brackets, [[specimen]]"),
    ("specimen = 'loose'", "specimen: expected tables in double brackets, [[specimen]]"),
    ("[[specimen]]\nname = 'a'", "specimen 'a': it needs kind = one of 'grains', 'chang_hicher'"),
    ("[[specimen]]\nname = 'a'\nkind = 'grain'", "specimen 'a': it needs kind = one of 'grains', 'chang_hicher', got 'grain'"),
    (GOOD.replace("n_grains = 100", ""), "specimen 'loose', n_grains: Field required"),
    (GOOD.replace("[[cones]]", "[[cone]]"), "cone: there is no such entry; did you mean 'cones'?"),
    (GOOD.replace("[specimen.contact]", "[specimen.contacts]"), "specimen 'loose', contacts: there is no such entry; did you mean 'contact'?"),
    (within(SAND, "k_pR = 2.0"), "specimen 'hostun': values of the material belong into it: material = { k_pR = ... }"),
    (within("[[plane_law]]", "vary = { k_pr = [1.0] }"), "unknown parameter to vary 'k_pr': did you mean 'k_pR'?"),
    (within("[[stress_probes]]", "norm = 1e-3"), "stress_probes 'stress': norm = 0.001 is not among the sizes of cones 'cones'"),
    (within("[[bursts]]", "cone_norm = 1e-3"), "bursts 'bursts': cone_norm = 0.001 is not among the sizes of cones 'cones'"),
    (within(GRAINS, "sedes = [1]"), "specimen 'loose', sedes: there is no such entry; did you mean 'seeds'?"),
    (within(GRAINS, "name = '../../etc'"), "name: String should match pattern"),
    (within(GRAINS, "name = '/tmp/x'"), "name: String should match pattern"),
    (within(GRAINS, "name = ''"), "name"),
    (within(GRAINS, "name = '..'"), "name"),
    (within(GRAINS, f"name = '{'a' * 41}'"), "name: String should have at most 40 characters"),
    (within("[[path]]", "name = '../drained'"), "name: String should match"),
    (within("[[probes]]", "name = 'a/b'"), "name: String should match"),
    (within(GRAINS, "seeds = []"), "specimen 'loose', seeds: there must be at least one seed"),
    (within(GRAINS, "seeds = [1, 1]"), "values must differ from each other, got 1, 1"),
    (within(GRAINS, "seeds = [-1]"), "specimen 'loose', seeds number 1"),
    (within(GRAINS, "seeds = [9223372036854775808]"), "specimen 'loose', seeds number 1"),
    (within(GRAINS, "eta = [0.3, 0.1]"), "must increase by at least 0.01"),
    (within(GRAINS, "eta = [0.3, 0.301]"), "must increase by at least 0.01"),
    (within(GRAINS, "eta = [3.0]"), "from 0 to below 3"),
    (within(GRAINS, "eta = [nan]"), "from 0 to below 3"),
    (within(GRAINS, "eta = [2.4]"), "eta = 2.4 is beyond the strength of any packing of spheres with friction 0.7: the densest lattice carries 2.325"),
    (within("[specimen.contact]", "friction = 0.0"), None),
    (within("[specimen.contact]", "stiffness_rule = 'harmonc'"), "unknown stiffness_rule 'harmonc': did you mean 'harmonic'?"),
    (within(GRAINS, "pressure_pa = 1e9"), "specimen 'loose': a pressure of 1e+09 Pa is unreachable with these contacts"),
    (within(GRAINS, "pressure_pa = 0.1"), "specimen 'loose': a pressure of 0.1 Pa is unreachable"),
    (within(GRAINS, "radius_min_m = 1.0"), "radius_min_m = 1 must not exceed radius_max_m = 0.018"),
    (within(GRAINS, "radius_min_m = 1e-9"), "radius_max_m must not exceed 1000 times radius_min_m"),
    (within(GRAINS, "n_grains = 1000000000"), "specimen 'loose', n_grains: Input should be less than or equal to 1000000"),
    (within(GRAINS, "porosity = 0.9"), "specimen 'loose', porosity: Input should be less than 0.6"),
    (within("[[probes]]", "step_deg = 7"), "must divide 360 degrees"),
    (within("[[probes]]", "step_deg = 1e-6"), "probes 'circle', step_deg: Input should be greater than or equal to 0.1"),
    (within("[[probes]]", "norms = [2e-4, 1e-4]"), "norms must be increasing"),
    (within("[[probes]]", "norms = []"), "norms must be increasing"),
    (within("[[probes]]", "norms = [0.01]"), "beyond the margin of 0.0005 m within which neighbours are known: it is a loading, not a probe"),
    (within("[[cones]]", "norm = 0.02"), "cones 'cones': a probe of norm 0.02 moves walls"),
    (within("[[probes]]", "step_deg = 10\nsphere_directions = 100"), "not both"),
    (within("[[probes]]", "sphere_directions = 1000000000"), "less than or equal to 100000"),
    (within("[[probes]]", "specimens = ['lose']"), "probes 'circle': unknown specimen 'lose': did you mean 'loose'?"),
    (within("[[probes]]", "seeds = [3]"), "probes 'circle': no specimen that is meant has seed = 3; there are 1, 2"),
    (within("[[probes]]", "void_ratios = [0.8]"), "probes 'circle': no specimen that is meant has void ratio = 0.8; there are 0.9"),
    (within("[[probes]]", "eta = [0.2]"), "probes 'circle': no specimen that is meant has eta = 0.2; there are 0.1, 0.3"),
    (within("[[probes]]", "specimens = ['hostun']"), "probes 'circle': it has no state to start from"),
    (within("[[probes]]", "kind = 'stres'"), "probes 'circle', kind: Input should be 'strain' or 'stress'"),
    (within("[[cones]]", "step_deg = 90"), "cones 'cones', step_deg: Input should be less than or equal to 60"),
    (within("[[cones]]", "norms = [1e-5, 2e-5]"), "norm = 0.0001 must be one of the norms 1e-05, 2e-05"),
    (within("[[bursts]]", "cones = 'kones'"), "bursts 'bursts': unknown set of cones 'kones': did you mean 'cones'?"),
    (GOOD + "[[specimen]]\nname = 'LOOSE'\nkind = 'grains'\nn_grains = 100\n", "[[specimen]]: each needs a name of its own, got hostun, loose, loose"),
    (GOOD + "[[path]]\nname = 'drained'\npath = 'drained'\n", "[[path]]: each needs a name of its own"),
    (within("[figures]", "draw = ['fig1']"), "figures: fig1 needs a [[specimen]]"),
    (within("[figures]", "draw = ['anatomy']"), "figures: anatomy needs [[probes]] with anatomy = true"),
    (within("[figures]", "draw = ['fig33']"), "unknown figure 'fig33': did you mean 'fig3'?"),
    (within("[figures]", "draw = ['fig3', 'fig3']"), "values must differ from each other"),
    (within("[figures]", "diagram_norm = 1e-3"), "diagram_norm = 0.001 must be one of the norms"),
    (within(SAND, "pressure_pa = 1e12"), "study.toml: specimen 'hostun', e = 0.9: at 1e+12 Pa the critical void ratio"),
    (within("[[path]]", "path = 'draned'"), "path 'drained', path: Input should be 'drained'"),
    (within("[[path]]", "ratio = 2.0"), "a path 'drained' has no 'ratio'"),
    (within(SAND, "preset = 'hostun'"), "unknown material 'hostun': did you mean 'hostun_loose'?"),
    (within("[specimen.material]", "k_rR = 1e-3"), "k_rR = 0.001 is too small"),
    (within(SAND, "sphere_rule = 'lebedev_4'"), "there is no Lebedev rule of degree 4"),
    (within(GRAINS, f"seeds = {list(range(10_001))}"), "specimen 'loose', seeds: Tuple should have at most 10000 items"),
    (within(GRAINS, f"seeds = {list(range(9_000))}").replace('name = "circle"', 'name = "circle"\nsphere_directions = 90000'),
     "units of work or more, and 1000000 are allowed: split it"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), [case for case in HAND_WRITTEN if case[1]])
def test_hand_written(run, text, words):
    """The entry, what is wrong with it and what would be right."""
    assert_one_sentence(run(text), words)


def is_inner(section, name):
    """Whether an entry has a table of its own in the good study."""
    return (section, name) in {
        (GRAINS, "contact"),
        (GRAINS, "loading"),
        (SAND, "material"),
        (GRAINS, "kind"),
        (SAND, "kind"),
    }


def generated():
    """Every entry of every section misspelt, and with values of kinds that it cannot have."""
    for section, (model, where) in SECTIONS.items():
        for name in model.model_fields:
            if is_inner(section, name):
                continue
            wrong = f"{name}_"
            yield pytest.param(
                within(section, f"{wrong} = 1"),
                f"{wrong}: there is no such entry; did you mean '{name}'?",
                id=f"{where}{wrong}",
            )
            for value in ("{ a = 1 }", "1979-05-27", "[[[]]]", "nan"):
                yield pytest.param(within(section, f"{name} = {value}"), name, id=f"{where}{name}={value}")


@pytest.mark.long  # a thousand short ones
@pytest.mark.parametrize(("text", "words"), list(generated()))
def test_generated(run, text, words):
    """Misspelt entries name the nearest valid one, values of a wrong kind the entry."""
    assert_one_sentence(run(text), words)


def numbers():
    for section, (model, _) in SECTIONS.items():
        for name, about in model.model_fields.items():
            kinds = {str(about.annotation)} | {str(each) for each in getattr(about.annotation, "__args__", ())}
            if name != "vary" and any(
                kind in ("<class 'float'>", "<class 'int'>") or "Annotated[" in kind for kind in kinds
            ):
                yield section, name


@pytest.mark.long
@pytest.mark.parametrize("value", ['"1"', "true", "-1", "inf", "1e400"])
@pytest.mark.parametrize(("section", "name"), list(numbers()))
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
        "sand", "packing", "state", "probes", "cone", "stress probes", "bursts", "test", "plane law"
    }  # fmt: skip
