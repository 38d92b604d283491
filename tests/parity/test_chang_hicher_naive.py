"""The kernels of the Chang-Hicher model against its definition in plain NumPy, contact by contact.

The reference below is written from the theory, in forces and displacements of contacts with 3 x 3
tensors. All that is unknown in a rate (stress, strain, plastic multipliers, peak friction) is solved
from one dense linear system; derivatives of the yield surface are taken with a complex step. Nothing
is eliminated, nothing is taken from the kernels, and nothing is fast.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rendulic as rd
from rendulic.chang_hicher import tangent
from rendulic.chang_hicher.drive.following import follow_path
from rendulic.tensors.rendulic_plane import increment_along
from rendulic.tensors.sphere_rules import bazant_oh_37, lebedev

P = 300e3
ROOT2 = np.sqrt(2.0)
FABRICS = {
    "isotropic": None,
    "orthotropic": np.diag([0.37, 0.35, 0.28]),
    "inclined": np.array([[0.36, 0.03, -0.02], [0.03, 0.33, 0.01], [-0.02, 0.01, 0.31]]),
}
# another sand than the default, so that no parameter is 1 or equal to another
OTHER = {
    "k_n0": 11e3, "f_ref": 0.05, "exponent": 0.4, "k_rR": 0.6, "k_pR": 1.3, "dilatancy": 0.8, "tan_phi_mu": 0.6,
    "tan_phi_0": 0.55, "e_ref": 1.05, "critical_slope": 0.15, "p_ref": 20e3, "interlocking": 1.4,
    "branch_length": 0.5e-3,
}  # fmt: skip


def tensor_of(six):
    """Symmetric tensor from components 11, 22, 33, 23, 13, 12."""
    a, b, c, d, e, f = six
    return np.array([[a, f, e], [f, b, d], [e, d, c]])


def components(tensor):
    return np.array([tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[1, 2], tensor[0, 2], tensor[0, 1]])


def derivative(function, value):
    """Exact to rounding, by a step into the complex plane."""
    return function(value + 1e-30j * np.maximum(np.abs(value), 1.0)).imag / (1e-30 * np.maximum(np.abs(value), 1.0))


@dataclass
class Naive:
    """The model of theory, section 5: contacts of spheres on planes, static hypothesis."""

    normals: np.ndarray
    weights: np.ndarray
    fabric: np.ndarray | None
    formulation: str
    void_ratio_0: float
    own: dict = field(repr=False)

    def __post_init__(self):
        density = np.ones(len(self.normals))
        if self.fabric is not None:
            density += 7.5 * np.array([n @ (self.fabric - np.eye(3) / 3) @ n for n in self.normals])
        self.share = self.weights * density / (self.weights @ density)  # of the contacts on each plane
        self.own_fabric = sum(w * np.outer(n, n) for w, n in zip(self.share, self.normals, strict=True))

    def local_state(self, sigma, eps):
        """What a stress and a strain mean for the contacts."""
        o = self.own
        here = dict(o)
        e = here["e"] = (1 + self.void_ratio_0) * np.exp(-np.trace(eps)) - 1
        p = here["p"] = np.trace(sigma) / 3
        e_c = here["e_c"] = o["e_ref"] - o["critical_slope"] * np.log10(p / o["p_ref"])
        here["t"] = (e_c / e) ** o["interlocking"] * o["tan_phi_mu"]
        here["force"] = self.forces(sigma, e)
        here["f_n"] = np.einsum("ai,ai->a", here["force"], self.normals)
        shear = here["force"] - here["f_n"][:, None] * self.normals
        here["f_r"] = np.linalg.norm(shear, axis=1)
        here["direction"] = shear / np.where(here["f_r"] > 0, here["f_r"], np.inf)[:, None]
        here["k_n"] = self.normal_stiffness(here["f_n"])
        return here

    def per_volume(self, e):
        """Contacts in a volume, `12 / (pi (1 + e) e l^3)`."""
        return 12 / (np.pi * (1 + e) * e * self.own["branch_length"] ** 3)

    def forces(self, sigma, e):
        """`f_j = V sigma_ij A^-1_ik l_k` with `A = sum l l`."""
        length = self.own["branch_length"]
        a_per_volume = self.per_volume(e) * length**2 * self.own_fabric
        return (length * self.normals) @ np.linalg.inv(a_per_volume) @ sigma

    def normal_stiffness(self, f_n):
        return self.own["k_n0"] * (f_n / self.own["f_ref"]) ** self.own["exponent"]

    def kappa(self, sliding, f_n, t):
        """The hyperbola of Eq. 31."""
        k_p = self.own["k_pR"] * self.normal_stiffness(f_n)
        return k_p * t * sliding / (f_n * t + k_p * sliding)

    def sliding(self, here):
        """The sliding that puts the present forces on the surface."""
        eta, k_p = here["f_r"] / here["f_n"], self.own["k_pR"] * here["k_n"]
        return here["f_n"] * eta / (k_p * (1 - eta / here["t"]))

    def rates(self, sigma, eps, loading, control):
        """Rates of stress and strain, and the plastic multipliers.

        Unknown are stress and strain rates (6 + 6), a multiplier per plane, and the rate of tan(phi_p).
        `control(d_sigma, d_eps)` gives six residuals that vanish for the rates asked for.
        """
        here = self.local_state(sigma, eps)
        n = len(self.normals)
        eta, slid, t = here["f_r"] / here["f_n"], self.sliding(here), here["t"]
        f_n, length = here["f_n"], self.own["branch_length"]
        flow_friction = t if self.formulation == "printed" else self.own["tan_phi_0"]
        beta = self.own["dilatancy"] * (flow_friction - eta)
        # slopes of the resistance `f_n kappa`
        by_sliding = derivative(lambda s: f_n * self.kappa(s, f_n, t), slid)
        by_force = derivative(lambda f: f * self.kappa(slid, f, t), f_n)
        by_friction = derivative(lambda u: f_n * self.kappa(slid, f_n, u), t)
        inverse = np.linalg.inv(self.per_volume(here["e"]) * length**2 * self.own_fabric)

        def residuals(unknowns):
            d_sigma, d_eps = tensor_of(unknowns[:6]), tensor_of(unknowns[6:12])
            multiplier, d_t = unknowns[12 : 12 + n], unknowns[12 + n]
            d_e = -(1 + here["e"]) * np.trace(d_eps)
            d_p = np.trace(d_sigma) / 3
            # the forces' rate at the present number of contacts, elastic and plastic displacement
            d_force = self.forces(d_sigma, here["e"])
            d_fn = np.einsum("ai,ai->a", d_force, self.normals)
            d_ft = d_force - d_fn[:, None] * self.normals
            d_fr = np.einsum("ai,ai->a", d_ft, here["direction"])
            displacement = (
                (d_fn / here["k_n"] + beta * multiplier)[:, None] * self.normals
                + d_ft / (self.own["k_rR"] * here["k_n"])[:, None]
                + multiplier[:, None] * here["direction"]
            )
            strain = np.zeros((3, 3))
            for a in range(n):
                product = np.outer(inverse @ (length * self.normals[a]), displacement[a])
                strain += self.per_volume(here["e"]) * self.share[a] * 0.5 * (product + product.T)
            if self.formulation == "consistent":
                # fewer contacts carry more force each: V / N ~ e (1 + e)
                crowding = d_e * (1 + 2 * here["e"]) / (here["e"] * (1 + here["e"]))
                consistency = (
                    d_fr + here["f_r"] * crowding - by_force * (d_fn + f_n * crowding)
                    - by_sliding * multiplier - by_friction * d_t
                )  # fmt: skip
            else:
                consistency = d_fr - eta * d_fn - by_sliding * multiplier
            d_e_c = -self.own["critical_slope"] * d_p / (here["p"] * np.log(10))
            return np.concatenate((
                components(strain - d_eps) * P, control(d_sigma, d_eps), np.where(loading, consistency, multiplier),
                [d_t - t * self.own["interlocking"] * (d_e_c / here["e_c"] - d_e / here["e"])],
            ))  # fmt: skip

        constant = residuals(np.zeros(13 + n))
        matrix = np.stack([residuals(unit) - constant for unit in np.eye(13 + n)], axis=1)
        solution = solve_scaled(matrix, -constant)
        return tensor_of(solution[:6]), tensor_of(solution[6:12]), solution[12 : 12 + n]


def solve_scaled(matrix, right):
    """Solve with rows and columns of size one: forces are newtons, stresses are of 1e5 Pa."""
    rows = np.abs(matrix).max(axis=1)
    columns = np.abs(matrix / rows[:, None]).max(axis=0)
    return np.linalg.solve(matrix / rows[:, None] / columns, right / rows) / columns


def naive_of(sand, void_ratio):
    """The reference for a `ChangHicher`."""
    own = dict(sand.parameters) | {"tan_phi_0": sand.parameters.flow_friction}
    return Naive(sand.rule.normals, sand.rule.weights, sand.fabric, sand.formulation, void_ratio, own)


def no_shear(d_eps):
    """Shear strains are held."""
    return components(d_eps)[3:] * P


def undrained(_d_sigma, d_eps):
    """Unit axial strain at constant volume, equal lateral strains."""
    return np.concatenate(((np.diag(d_eps) - [1.0, -0.5, -0.5]) * P, no_shear(d_eps)))


def drained(d_sigma, d_eps):
    """Unit axial strain, lateral stresses held."""
    return np.concatenate(([(d_eps[0, 0] - 1.0) * P, d_sigma[1, 1], d_sigma[2, 2]], no_shear(d_eps)))


def constant_p(d_sigma, d_eps):
    """Unit axial strain at constant mean stress, equal lateral stresses."""
    held = [(d_eps[0, 0] - 1.0) * P, np.trace(d_sigma), d_sigma[1, 1] - d_sigma[2, 2]]
    return np.concatenate((held, no_shear(d_eps)))


PATHS = {
    "undrained": (rd.paths.constant_volume(0.06), undrained),
    "drained": (rd.paths.drained_triaxial(0.05), drained),
    "constant p": (rd.paths.constant_p(0.05), constant_p),
}


def records(sand, void_ratio, path):
    """What is recorded of the assembly and of the planes along a path, by name."""
    driven = follow_path(sand.at(P, void_ratio), path).driven.of_all_planes()
    return driven.record, driven.plane_record


def mandel_to_tensor(vector):
    return tensor_of(np.concatenate((vector[:3], vector[3:] / ROOT2)))


@pytest.mark.parametrize("material", [{}, OTHER], ids=["hostun", "other sand"])
@pytest.mark.parametrize("fabric", FABRICS.values(), ids=FABRICS)
@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)
@pytest.mark.parametrize("formulation", ["printed", "eq32", "consistent"])
def test_rates_are_the_definitions(formulation, path, fabric, material):
    """Stress and strain rates along a path equal those of the dense system, and planes load where they should.

    Ten states of each path, peak and softening among them, short of the plastic limit, at which H = 0 and
    rounding has no bound. Multipliers of loading planes are positive.
    """
    followed, control = path
    sand = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=fabric, **material)
    naive = naive_of(sand, 0.9)
    record, planes = records(sand, 0.9, followed)
    assert float(record["stress"][:, 0].max()) > 1.1 * P
    n_loading = []
    short = np.flatnonzero(planes["x"].max(axis=1) < 0.999)
    for k in short[np.linspace(5, len(short) - 1, 10).astype(int)]:
        sigma, eps = mandel_to_tensor(record["stress"][k]), mandel_to_tensor(record["strain"][k])
        loading = planes["is_loading"][k] > 0.5
        d_sigma, d_eps, multiplier = naive.rates(sigma, eps, loading, control)
        stress_rate, strain_rate = (
            record[name][k] / record["strain_rate"][k, 0] for name in ("stress_rate", "strain_rate")
        )
        # rounding times the condition of the system, of up to 1 / (1 - x)^2
        stress_size, strain_size = np.abs(stress_rate).max(), np.abs(strain_rate).max()
        assert_allclose(d_sigma, mandel_to_tensor(stress_rate), rtol=1e-9, atol=1e-9 * stress_size)
        assert_allclose(d_eps, mandel_to_tensor(strain_rate), rtol=1e-9, atol=1e-9 * strain_size)
        # a unit strain displaces contacts by l; planes change sides at 1e-9 of the loading measure, over H
        softness = (1.0 - planes["x"][k]) ** 2
        assert ((multiplier * softness)[loading] > -1e-8 * naive.own["branch_length"]).all()
        n_loading.append(int(loading.sum()))
    assert max(n_loading) > 20
    # the record says of a plane what the definition says
    here = naive.local_state(sigma, eps)
    area = here["f_n"] / planes["sigma"][k]
    assert_allclose(area, area[0], rtol=1e-13)
    assert_allclose(planes["tau"][k] * area, here["f_r"], rtol=0, atol=1e-13 * here["f_r"].max())


@pytest.mark.parametrize("formulation", ["printed", "eq32", "consistent"])
def test_local_strains_are_the_definitions(formulation):
    """Displacements of every plane, over l, are what the strain of a path adds up to (Eq. 21)."""
    sand = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation)
    point = sand.at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.02))
    normal, shear = point.plane_strain[:, :1], point.plane_strain[:, 1:]
    displacement = normal * sand.rule.normals + shear
    strain = 3.0 * np.einsum("a,ai,aj->ij", sand.rule.weights, sand.rule.normals, displacement)
    assert_allclose(0.5 * (strain + strain.T), point.strain, rtol=0, atol=1e-15)
    # shear strains lie in their planes
    assert_allclose(np.einsum("ai,ai->a", shear, sand.rule.normals), 0.0, atol=1e-15)


def test_unloaded_planes_stay_inside_their_surface():
    """Planes that unloaded keep their sliding, and the friction it mobilises is more than they carry.

    The sliding is that of the definition at the record where they unloaded.
    """
    sand = rd.ChangHicher(rule=bazant_oh_37())
    naive = naive_of(sand, 0.9)
    record, planes = records(sand, 0.9, rd.paths.constant_volume(0.06))
    loading = planes["is_loading"] > 0.5
    unloaded = np.flatnonzero(loading[5] & ~loading[-1])
    assert len(unloaded) >= 12
    states = zip(record["stress"], record["strain"], strict=True)
    found = [naive.local_state(mandel_to_tensor(stress), mandel_to_tensor(strain)) for stress, strain in states]
    for a in unloaded:
        last = np.flatnonzero(loading[:, a])[-1]
        kept = naive.sliding(found[last])[a]
        for here in found[last + 2 :: 10]:
            carried = here["f_r"][a] / here["f_n"][a]
            assert naive.kappa(kept, here["f_n"], here["t"])[a] > carried


@pytest.mark.parametrize("formulation", ["printed", "eq32", "consistent"])
@pytest.mark.parametrize("alpha", [80.0, 110.0, 125.0, 150.0, 250.0, 300.0])
def test_tangent_is_the_definitions(formulation, alpha):
    """`tangent` in a direction of strain gives the stress rate of the dense system with these loading planes."""
    sand = rd.ChangHicher(rule=bazant_oh_37(), formulation=formulation, fabric=FABRICS["inclined"])
    point = sand.at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.3, until_eta=0.7))
    direction = increment_along(alpha)
    own = tangent(point, direction)

    def imposed(_d_sigma, d_eps):
        return components(d_eps - np.diag(direction)) * P

    d_sigma, _d_eps, multiplier = naive_of(sand, 0.9).rates(point.stress, point.strain, own.is_loading, imposed)
    d_eps = np.concatenate((direction, np.zeros(3)))
    expected = mandel_to_tensor(own.stiffness @ d_eps)
    # rounding, times the condition of the dense system
    assert_allclose(d_sigma, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert (multiplier[own.is_loading] >= -1e-12).all()


def test_loading_set_is_the_only_consistent_one():
    """A plane that does not load would have a negative multiplier if it did, at every direction around."""
    sand = rd.ChangHicher(rule=bazant_oh_37())
    point = sand.at(P, 0.9)
    point.load(rd.paths.drained_triaxial(0.3, until_eta=0.6))
    naive = naive_of(sand, 0.9)
    sheared = point.planes()["tau"] > 1.0
    seen = set()
    for alpha in range(0, 360, 30):
        direction = increment_along(alpha)
        is_loading = tangent(point, direction).is_loading & sheared
        seen.add(int(is_loading.sum()))

        def imposed(_d_sigma, d_eps, direction=direction):
            return components(d_eps - np.diag(direction)) * P

        assert (naive.rates(point.stress, point.strain, is_loading, imposed)[2][is_loading] >= 0.0).all()
        for plane in np.flatnonzero(~is_loading & sheared)[::5]:
            tried = is_loading.copy()
            tried[plane] = True
            assert naive.rates(point.stress, point.strain, tried, imposed)[2][plane] <= 0.0
    assert 0 in seen
    assert max(seen) >= 28


@pytest.mark.parametrize("formulation", ["printed", "eq32", "consistent"])
def test_driver_against_a_plain_integration(formulation):
    """Classical Runge-Kutta with fixed steps and the dense system ends where the driver does.

    Thirteen planes from 0.2 % to 1 % of undrained strain, all loading, past no event but the loss of
    W2. Steps halved once show the reference's own error, which bounds the difference.
    """
    sand = rd.ChangHicher(formulation=formulation, rule=lebedev(7))
    naive = naive_of(sand, 0.9)
    point = sand.at(P, 0.9)
    point.load(rd.paths.constant_volume(0.002), tolerance=1e-11)
    sigma, eps = point.stress, point.strain
    loading = tangent(point, [1.0, -0.5, -0.5]).is_loading & (point.planes()["tau"] > 1.0)
    curve = point.load(rd.paths.constant_volume(0.008), tolerance=1e-11)
    assert not set(curve.event_kind.values) & {"plane_unloads", "plane_reloads"}
    ends = [integrated(naive, sigma, eps, loading, steps) for steps in (10, 20)]
    own_error = np.abs(ends[1] - ends[0]).max()
    assert own_error < 1e-3 * P
    # the finer one is sixteen times better than their difference
    assert_allclose(ends[1], point.stress, rtol=0, atol=own_error / 8.0)


def integrated(naive, sigma, eps, loading, steps, strain=0.008):
    """Stress after this axial strain, undrained, by the classical Runge-Kutta method."""

    def slope(s, e):
        return np.stack(naive.rates(s, e, loading, undrained)[:2])

    h, y = strain / steps, np.stack((sigma, eps))
    for _ in range(steps):
        k1 = slope(*y)
        k2 = slope(*(y + 0.5 * h * k1))
        k3 = slope(*(y + 0.5 * h * k2))
        k4 = slope(*(y + h * k3))
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return y[0]


def test_the_definition_knows_its_planes():
    """The reference itself: its forces carry the stress (Love-Weber), its contacts number as they should."""
    naive = Naive(bazant_oh_37().normals, bazant_oh_37().weights, FABRICS["inclined"], "consistent", 0.9,
                  dict(rd.ChangHicher(rule=bazant_oh_37()).parameters) | {"tan_phi_0": 0.65})  # fmt: skip
    sigma = np.array([[4.0, 0.3, 0.1], [0.3, 3.0, -0.2], [0.1, -0.2, 2.5]]) * 1e5
    force = naive.local_state(sigma, np.zeros((3, 3)))["force"]
    branch = naive.own["branch_length"] * naive.normals
    weber = naive.per_volume(0.9) * np.einsum("a,ai,aj->ij", naive.share, branch, force)
    assert_allclose(weber, sigma, rtol=0, atol=1e-14 * P)
