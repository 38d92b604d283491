"""The one scheme of compiling: what kernels are made of, what they lack, and how they are told apart."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import rendulic as rd
from rendulic.dem.kernels import contacts, mechanics
from rendulic.dem.kernels.compiled import kernels_for, lane_kernels_for
from rendulic.foundation import compiling
from rendulic.foundation.compiling import Kernel, UnboundKernel, bind, kernel, sources_of, unbound

PACKAGE = Path(rd.__file__).parent
KERNELS = {
    f"{thing.plain.__module__}.{name}": thing
    for folder in ("dem", "chang_hicher")
    for file in sorted((PACKAGE / folder / "kernels").glob("*.py"))
    for name, thing in vars(import_module(f"rendulic.{folder}.kernels.{file.stem}")).items()
    if isinstance(thing, Kernel)
}


def test_no_law_no_forces():
    """A kernel that misses its law says so before it has touched anything, and says where to get one that has it."""
    with pytest.raises(UnboundKernel, match=r"'contact_forces' lacks 'law_.*kernels_for"):
        contacts.contact_forces(None, None, 0.0, (), None)
    with pytest.raises(UnboundKernel, match=r"lacks 'WIDTH'.*lane_kernels_for"):
        bind((import_module("rendulic.dem.kernels.lanes"),), {})


def test_no_law_no_forces_without_the_compiler():
    """The same where kernels are plain Python: nothing stands in for the law."""
    code = (
        "import numpy as np\n"
        "from rendulic.dem.kernels import sums\n"
        "from rendulic.dem.kernels.mechanics import pair_force\n"
        "from rendulic.foundation.compiling import UnboundKernel\n"
        "PAIR = ((1.0, 0.0, 0.0), *[1.0] * 5, *[(0.0, 0.0, 0.0)] * 4, 1e-6, (1.0,))\n"
        "for call in (lambda: pair_force(*PAIR), lambda: pair_force.plain(*PAIR),\n"
        "             lambda: sums.stored_energy(None, None, None, ())):\n"
        "    try:\n"
        "        call()\n"
        "    except UnboundKernel as error:\n"
        "        assert 'kernels_for(law)' in str(error)\n"
        "    else:\n"
        "        raise SystemExit('it ran')\n"
    )
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr


def test_no_kernel_has_a_contact_law_of_its_own():
    """No file of kernels imports a law: what is not bound is missing."""
    for file in (PACKAGE / "dem" / "kernels").glob("*.py"):
        imported = file.read_text(encoding="utf-8").count("from rendulic.dem.laws")
        assert imported == (1 if file.name == "compiled.py" else 0), file.name  # there, the protocol


@pytest.mark.parametrize("name", KERNELS)
def test_arguments_can_be_read(name):
    """At most 12 arguments, and the flags of all."""
    assert len(inspect.signature(KERNELS[name].plain).parameters) <= 12
    assert set(KERNELS[name].inlining) <= {"forceinline", "inline"}


def test_kernels_are_there():
    """The test above looks at those of grains and of the model."""
    assert {"rendulic.dem.kernels.step.advance", "rendulic.chang_hicher.kernels.integrate.follow"} <= set(KERNELS)
    assert len(KERNELS) > 60


def made(**functions) -> ModuleType:
    """A module with these names."""
    module = ModuleType("made")
    vars(module).update(functions)
    return module


scale = unbound("give it to `bind`")
factor = 3.0


@kernel
def scaled(values):
    """Kernels below call it."""
    total = 0.0
    for value in values:
        total += scale(value)
    return total


@kernel
def scaled_twice(values):
    """Needs what `scaled` needs."""
    return 2.0 * scaled(values)


@kernel
def counted(values):
    """Needs nothing."""
    return values.shape[0]


def double(value):
    return 2.0 * value


def by_factor(value):
    return factor * value


def test_what_is_called_is_bound_too():
    """A kernel gets the meaning of names that only a kernel below it uses."""
    values = np.array([1.0, 2.0])
    own = bind((made(top=scaled_twice),), {"scale": double})
    assert set(vars(own)) == {"scaled", "scaled_twice"}
    assert own.scaled_twice(values) == 12.0
    assert bind((made(top=scaled_twice),), {"scale": by_factor}).scaled_twice(values) == 18.0
    with pytest.raises(UnboundKernel, match="'scaled_twice' lacks 'scale': give it"):
        scaled_twice(values)


def test_a_kernel_is_compiled_once_for_what_it_needs():
    """The same function, or one that is alike, gives the same kernel; what does not need it is not made anew."""
    everything = made(top=scaled_twice, other=counted)

    def fresh(number):
        def multiplied(value):
            return number * value

        return multiplied

    one, two, other = (bind((everything,), {"scale": fresh(number)}) for number in (2.0, 2.0, 4.0))
    assert one.scaled is two.scaled
    assert one.scaled is not other.scaled
    assert one.counted is other.counted
    assert (one.scaled(np.ones(1)), other.scaled(np.ones(1))) == (2.0, 4.0)


def test_numbers_from_around_are_those_of_now(monkeypatch):
    """A function that reads a number of its module is another one when that number is another."""
    before = bind((made(top=scaled),), {"scale": by_factor}).scaled(np.ones(1))
    monkeypatch.setitem(globals(), "factor", 5.0)
    assert (before, bind((made(top=scaled),), {"scale": by_factor}).scaled(np.ones(1))) == (3.0, 5.0)


def test_a_law_that_makes_its_functions_anew_is_compiled_once():
    """`kernels_for` is asked before every advance: a law with properties that define functions must not compile each time."""

    class Anew:
        parameters, friction = (1e6,), 0.0

        @property
        def stiffness(self):
            return lambda radius_1, radius_2, parameters: (parameters[0], parameters[0])

        @property
        def wall_stiffness(self):
            return lambda radius, parameters: parameters[0]

        @property
        def contact_force(self):
            return lambda overlap, k_n, k_t, fx, fy, fz, sx, sy, sz, parameters: (k_n * overlap, fx, fy, fz, 0.0)

        @property
        def elastic_energy(self):
            return lambda force_n, force_t, k_n, k_t: 0.5 * force_n * force_n / k_n

    law = Anew()
    assert kernels_for(law).advance is kernels_for(law).advance
    assert lane_kernels_for(law, 4).advance_lanes is lane_kernels_for(law, 4).advance_lanes
    # what knows nothing of laws is the same for all
    assert kernels_for(law).move_grains is kernels_for(rd.dem.LinearFrictional()).move_grains


def test_only_kernels_of_our_own_are_cached_on_disk(monkeypatch):
    """Names on disk are those of rendulic's kernels; nothing that depends on a user's function."""
    asked = {}
    monkeypatch.setattr(
        compiling, "numba", SimpleNamespace(
            njit=lambda cache, **_: lambda plain: asked.setdefault(plain.__qualname__, cache) and plain, __version__="1"
        ),
    )  # fmt: skip
    monkeypatch.setattr(compiling, "_done", {})
    bind((mechanics,), {"law_contact_force": double})
    assert {name for name, to_disk in asked.items() if not to_disk} == {"pair_force_user", "double_user"}
    assert {name.rpartition("_")[0] for name, to_disk in asked.items() if to_disk} == {
        "damped", "dot", "cross", "fma_vector"
    }  # fmt: skip


def test_the_name_on_disk_changes_with_every_source(tmp_path, monkeypatch):
    """An edit of a file that is imported by an imported file gives another name; one elsewhere does not."""
    package = tmp_path / "made"
    package.mkdir()
    texts = {
        "top": "from made.middle import f\n", "middle": "import numpy\nfrom made import low\n", "low": "N = 1\n",
        "other": "N = 1\n",
    }  # fmt: skip
    monkeypatch.setattr(compiling, "PACKAGE", package)

    def name_with(**changed):
        for name, text in {**texts, **changed}.items():
            (package / f"{name}.py").write_text(text)
        compiling._read.cache_clear()
        sources_of.cache_clear()
        return sources_of(package / "top.py")

    try:
        before = name_with()
        assert name_with(low="N = 2\n") != before
        assert name_with(other="N = 2\n") == before
    finally:
        compiling._read.cache_clear()
        sources_of.cache_clear()


def test_two_kernels_of_one_name_are_refused():
    """They could not be told apart in what `bind` returns."""
    other = kernel(lambda values: 0.0)
    other.plain.__name__ = "scaled"
    with pytest.raises(UnboundKernel, match="two kernels are called 'scaled'"):
        bind((made(one=scaled, other=other),), {"scale": double})
