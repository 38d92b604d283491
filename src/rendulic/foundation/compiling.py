"""The one scheme of compiling: kernels, the names that are bound to them later, and their cache on disk.

A kernel is a plain function of arrays and numbers, marked by `@kernel`. It is compiled when it is first called, with
the same flags as every other one. What it is made of is found, not listed: the kernels that it calls by the names it
uses, its sources by the imports of its file. A name that is known only later (a function of the contact law, the number of
lanes) is declared by `unbound` and given its meaning by `bind`; a kernel with such a name cannot run without.

Kernels are cached on disk under a name that changes with any of their sources, with numba and with the flags. What
is made of a function from outside rendulic is compiled once per process and not cached: its source does not show the numbers
that it may use from around it.
"""

from __future__ import annotations

import ast
import dis
import hashlib
from collections.abc import Callable, Iterable, Mapping
from functools import cache, cached_property, partial, update_wrapper
from pathlib import Path
from threading import RLock
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numba

from rendulic.foundation.errors import RendulicError

__all__ = ["FLAGS", "Kernel", "Unbound", "UnboundKernel", "bind", "kernel", "sources_of", "unbound"]

# no liberties in arithmetic: NaN is kept, nothing is fused that is not written so, and machines end at the same bits
FLAGS = {"nogil": True, "error_model": "numpy", "fastmath": False}
PACKAGE = Path(__file__).parents[1]


class UnboundKernel(RendulicError):
    """A kernel was to run without something that it needs, such as its contact law."""


class Unbound:
    """What a name in kernels stands for before `bind`; see `unbound`."""

    def __init__(self, needed: str) -> None:
        self.needed = needed

    def __call__(self, *_arguments: Any) -> Any:
        raise UnboundKernel(f"a function of this kernel is not bound: {self.needed}")


def unbound(needed: str) -> Any:
    """Declare a name, or several, that `bind` will give a meaning; `needed` says in an error how to get one that has it."""
    return Unbound(needed)


class Kernel:
    """A function to be compiled. Called as it is, it must need nothing that is still unbound; see `kernel`."""

    def __init__(self, plain: FunctionType, inlining: Mapping[str, Any]) -> None:
        update_wrapper(self, plain)
        self.plain, self.inlining = plain, dict(inlining)
        # read now: a file that is edited while the process runs must not give its name to code from before
        self.sources = sources_of(Path(plain.__code__.co_filename)) if _is_own(plain) else ""

    def __call__(self, *arguments: Any) -> Any:
        return self._as_it_is(*arguments)

    def __repr__(self) -> str:
        return f"<kernel {self.plain.__module__}.{self.plain.__qualname__}>"

    @cached_property
    def _as_it_is(self) -> Callable:
        with _lock:
            return _compiled(self, {})

    @cached_property
    def used(self) -> dict[str, Any]:
        """What the names that the function takes from around it mean there."""
        return _taken_from_around(self.plain)

    @cached_property
    def unbound(self) -> dict[str, Unbound]:
        """What must be bound before it can run, for itself or for a kernel that it calls."""
        found: dict[str, Unbound] = {}
        for name, thing in self.used.items():
            if isinstance(thing, Unbound):
                found[name] = thing
            elif isinstance(thing, Kernel):
                found |= thing.unbound
        return dict(sorted(found.items()))


def kernel(plain: Callable | None = None, **inlining: Any) -> Any:
    """Make a function a kernel; also as a decorator with words.

    Parameters
    ----------
    plain : function
        Of arrays and numbers; it stays as it is, for whoever calls it as plain Python.
    **inlining
        How it becomes part of its callers, in numba's words. `forceinline=True`: in the last step, for small functions
        of which the compiler would make calls. `inline="always"`: in the first step, for large functions called once, which
        compile sooner so.
    """
    if plain is None:
        return partial(kernel, **inlining)
    return Kernel(plain, inlining)  # type: ignore[arg-type]


def bind(modules: Iterable[ModuleType], meaning: Mapping[str, Any]) -> SimpleNamespace:
    """The kernels of modules, and all that these call, with unbound names replaced by what they mean.

    Parameters
    ----------
    modules : iterable of modules
        Each kernel found in them is bound.
    meaning : mapping
        Of unbound names: plain functions, which are compiled; what is compiled already; or numbers.

    Returns
    -------
    namespace
        Compiled functions by name. A kernel is compiled once for everything that means the same to it.

    Raises
    ------
    UnboundKernel
        If a kernel needs a name that is not given.
    """
    waiting = [thing for module in modules for thing in vars(module).values() if isinstance(thing, Kernel)]
    found: dict[str, Kernel] = {}
    while waiting:
        one = waiting.pop()
        name = one.plain.__name__
        if found.setdefault(name, one) is not one:
            raise UnboundKernel(f"two kernels are called '{name}', {one} and {found[name]}: rename one of them")
        waiting += [thing for thing in one.used.values() if isinstance(thing, Kernel) and thing not in found.values()]
    with _lock:
        functions = {name: _function(thing) for name, thing in meaning.items()}
        return SimpleNamespace(**{name: _compiled(one, functions) for name, one in found.items()})


_lock = RLock()
_kernels: dict[tuple, Kernel] = {}  # of functions that were bound
_done: dict[tuple, Callable] = {}


def _function(thing: Any) -> Any:
    """A plain function as a kernel, the same one for functions that are alike; anything else as it is."""
    if not isinstance(thing, FunctionType):
        return thing
    around = (*_taken_from_around(thing).values(), *(cell.cell_contents for cell in thing.__closure__ or ()))
    alike = (thing.__code__, *((type(value), _or_itself(value)) for value in (*around, thing.__defaults__)))
    return _kernels.setdefault(alike, Kernel(thing, {}))


def _or_itself(value: Any) -> Any:
    """What tells a value from others: its equals, or itself where values of its kind cannot be told so."""
    try:
        hash(value)
    except TypeError:
        return id(value)
    return value


def _compiled(one: Kernel, functions: Mapping[str, Any]) -> Callable:
    for name, missing in one.unbound.items():
        if name not in functions:
            raise UnboundKernel(f"the kernel '{one.plain.__name__}' lacks '{name}': {missing.needed}")
    own = {name: functions[name] for name in one.unbound}
    key = (one, *own.items())
    if key not in _done:
        around = dict(one.plain.__globals__)
        for name, thing in one.used.items():
            meant = functions[name] if isinstance(thing, Unbound) else thing
            around[name] = _compiled(meant, functions) if isinstance(meant, Kernel) else meant
        plain = one.plain
        clone = FunctionType(plain.__code__, around, plain.__name__, plain.__defaults__, plain.__closure__)
        clone.__module__, clone.__doc__ = plain.__module__, plain.__doc__
        to_disk = _is_own(plain) and all(_is_own(thing) for thing in own.values())
        clone.__qualname__ = f"{plain.__name__}_{_digest(one, own) if to_disk else 'user'}"
        _done[key] = numba.njit(cache=to_disk, **one.inlining, **FLAGS)(clone)  # type: ignore[call-overload]
    return _done[key]


def _is_own(thing: Any) -> bool:
    """Whether the sources of rendulic, and the numbers bound, say all about it."""
    return isinstance(thing, int | float) or str(getattr(thing, "__module__", "")).split(".")[0] == "rendulic"


def _digest(one: Kernel, own: Mapping[str, Any]) -> str:
    parts = [numba.__version__, repr(FLAGS), repr(one.inlining), one.sources]
    for name, thing in own.items():
        parts += [name, getattr(thing, "__qualname__", None) or repr(thing), getattr(thing, "sources", "")]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:12]


def _taken_from_around(plain: FunctionType) -> dict[str, Any]:
    codes: list[CodeType] = [plain.__code__]
    for code in codes:
        codes += [constant for constant in code.co_consts if isinstance(constant, CodeType)]
    names = {step.argval for code in codes for step in dis.get_instructions(code) if step.opname == "LOAD_GLOBAL"}
    around = plain.__globals__
    return {name: around[name] for name in sorted(names) if name in around}


@cache
def sources_of(file: Path) -> str:
    """What a file of rendulic is made of, as one digest: its text, and that of all that it imports from rendulic."""
    found = [file]
    for one in found:
        found += [below for below in _read(one)[1] if below not in found]
    return hashlib.sha256(
        "\0".join(f"{one.relative_to(PACKAGE)}\0{_read(one)[0]}" for one in sorted(found)).encode()
    ).hexdigest()


@cache
def _read(file: Path) -> tuple[str, tuple[Path, ...]]:
    """The text of a file, and the files of rendulic that it imports."""
    text = file.read_text(encoding="utf-8")
    names = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module:
            names += [(f"{node.module}.{alias.name}", node.module) for alias in node.names]
        elif isinstance(node, ast.Import):
            names += [(alias.name, alias.name) for alias in node.names]
    return text, tuple(dict.fromkeys(path for choice in names if (path := _file_of(*choice)) is not None))


def _file_of(*modules: str) -> Path | None:
    """The file of the first of these modules that is one of rendulic's."""
    for module in modules:
        package, *parts = module.split(".")
        if package == PACKAGE.name:
            place = PACKAGE.joinpath(*parts)
            for path in (place.with_suffix(".py"), place / "__init__.py"):
                if path.is_file():
                    return path
    return None
