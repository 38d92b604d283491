"""Rates of a material point under a control: local state, homogenised compliance, solution, local rates.

The static hypothesis gives every plane its traction `sigma . m`; the strain is the weighted sum of the
planes' strains (Eqs. 18-23). Plastic strain depends on the rates of void ratio and mean stress through
the peak friction; that coupling is of rank one and is eliminated in closed form.
"""

from __future__ import annotations

from math import exp, isfinite, sqrt

import numpy as np

from rendulic.chang_hicher.kernels.arrays import CONSISTENT, PRINTED
from rendulic.chang_hicher.kernels.columns import PLANE, SHARED, STATE
from rendulic.chang_hicher.law import critical_state, plane_law
from rendulic.chang_hicher.law.planes import AXISYMMETRIC, GENERAL
from rendulic.foundation.compiling import kernel
from rendulic.tensors.mandel import ROOT2

__all__ = [
    "INVALID", "UNDECIDED", "VALID", "find_loading_planes", "homogenise", "local_state", "rates", "sliding",
    "void_ratio_effect",
]  # fmt: skip

VALID, INVALID, UNDECIDED = 0, 1, 2
UNSHEARED = 1e-10  # obliquity below which a plane has no shear direction yet
UNSHEARING = 1e-7  # share of the stress rate below which the shear rate of such a plane is rounding
NEUTRAL = 1e-10  # loading measure below which a plane neither loads nor unloads
ROUNDING = 1e-6  # of hardening over stiffness: below, multipliers are told from rounding less and less

hardening_modulus = kernel(plane_law.hardening_modulus)
mobilised_friction = kernel(plane_law.mobilised_friction)
sliding = kernel(plane_law.sliding)
dilatancy = kernel(plane_law.dilatancy)
loading_slope = kernel(plane_law.loading_slope)
critical_void_ratio = kernel(critical_state.critical_void_ratio)
peak_friction = kernel(critical_state.peak_friction)
peak_friction_slopes = kernel(critical_state.peak_friction_slopes)


@kernel
def local_state(material, planes, sigma, eps, memory, active, scratch):
    """Local state of every plane and the scalars they share; whether the state is admissible.

    `memory` is the mobilised friction of a plane (`printed`, `eq32`) or its plastic sliding
    (`consistent`). On loading planes it is given by the stress; theirs is not read.
    """
    p = (sigma[0] + sigma[1] + sigma[2]) / 3.0
    void_ratio = (1.0 + material.void_ratio_0) * exp(-(eps[0] + eps[1] + eps[2])) - 1.0
    if not (p > 0.0 and void_ratio > 0.0):
        return False
    e_c = critical_void_ratio(p, material.e_ref, material.critical_slope, material.p_ref)
    if not e_c > 0.0:
        return False
    tan_peak = peak_friction(void_ratio, e_c, material.interlocking, material.tan_phi_mu)
    by_p, by_e = peak_friction_slopes(p, void_ratio, e_c, tan_peak, material.interlocking, material.critical_slope)
    # force on a contact per normal stress, 3 V / (N l), from N l^3 / V = 12 / (pi (1 + e) e)
    area = 0.25 * np.pi * (1.0 + void_ratio) * void_ratio * material.branch_length**2
    k_0 = material.k_n0 * material.branch_length / area * (area / material.f_ref) ** material.exponent
    scratch.shared[SHARED.stiffness] = k_0
    scratch.shared[SHARED.tan_peak] = tan_peak
    scratch.shared[SHARED.by_pressure] = by_p
    scratch.shared[SHARED.by_void_ratio] = by_e
    scratch.shared[SHARED.density] = (
        (material.exponent - 1.0) * (1.0 + 2.0 * void_ratio) / (void_ratio * (1.0 + void_ratio))
    )
    scratch.shared[SHARED.void_ratio] = void_ratio
    scratch.shared[SHARED.critical_void_ratio] = e_c
    consistent = material.formulation == CONSISTENT
    tan_flow = tan_peak if material.formulation == PRINTED else material.tan_phi_0
    root = material.exponent == 0.5
    s11, s22, s33 = sigma[0], sigma[1], sigma[2]
    s23, s13, s12 = sigma[3] / ROOT2, sigma[4] / ROOT2, sigma[5] / ROOT2
    for a in range(planes.normal.shape[0]):
        m1, m2, m3 = planes.branch[a, 0], planes.branch[a, 1], planes.branch[a, 2]
        n1, n2, n3 = planes.normal[a, 0], planes.normal[a, 1], planes.normal[a, 2]
        t1 = s11 * m1 + s12 * m2 + s13 * m3
        t2 = s12 * m1 + s22 * m2 + s23 * m3
        t3 = s13 * m1 + s23 * m2 + s33 * m3
        normal = t1 * n1 + t2 * n2 + t3 * n3
        if not normal > 0.0:
            return False
        t1, t2, t3 = t1 - normal * n1, t2 - normal * n2, t3 - normal * n3
        tau = sqrt(t1 * t1 + t2 * t2 + t3 * t3)
        obliquity = tau / normal
        modulus = k_0 * (sqrt(normal) if root else normal**material.exponent)
        k_p = material.k_pR * modulus
        sheared = obliquity > UNSHEARED
        if active[a]:
            kappa = obliquity if sheared else 0.0
        elif consistent:
            kappa = mobilised_friction(memory[a], normal, k_p, tan_peak)
        else:
            # memory from before the peak friction fell: no plane carries more than that
            kappa = min(memory[a], (1.0 - 2e-6) * tan_peak)
        x = kappa / tan_peak
        if active[a] and not x < 1.0:
            return False
        if sheared:
            along = 1.0 / tau
            scratch.flow[a, 0], scratch.flow[a, 1], scratch.flow[a, 2] = along * t1, along * t2, along * t3
        scratch.shear[a, 0], scratch.shear[a, 1], scratch.shear[a, 2] = t1, t2, t3
        row = scratch.plane[a]
        row[PLANE.sigma], row[PLANE.tau], row[PLANE.modulus], row[PLANE.x], row[PLANE.kappa] = (
            normal,
            tau,
            modulus,
            x,
            kappa,
        )
        row[PLANE.hardening] = hardening_modulus(k_p, x)
        row[PLANE.slope] = loading_slope(kappa, tan_peak, material.exponent) if consistent else kappa
        row[PLANE.beta] = dilatancy(material.dilatancy, tan_flow, kappa)
        row[PLANE.excess] = obliquity - kappa
        # what the surface loses when peak friction, or the stiffness of the planes, change
        row[PLANE.softening] = normal * x * x if consistent else 0.0
    return True


@kernel
def homogenise(material, planes, active, scratch):
    """Compliance `d_eps = C d_sigma` into `scratch.compliance`; the determinant's share of the coupling."""
    c, g = scratch.compliance, scratch.gather[0]
    for i in range(6):
        g[i] = 0.0
        for j in range(6):
            c[i, j] = 0.0
    if planes.symmetry == GENERAL:
        add_elastic(planes, scratch, c)
        add_plastic(material, planes, active, scratch, c, g)
    else:
        add_principal(material, planes, active, scratch, c, g)
        if planes.symmetry == AXISYMMETRIC:
            exchange_mean(c, g)
    # d_eps = C d_sigma + g tr(d_eps)
    coupling = 1.0 - (g[0] + g[1] + g[2])
    for j in range(6):
        volume = (c[0, j] + c[1, j] + c[2, j]) / coupling
        for i in range(6):
            c[i, j] += g[i] * volume
    return coupling


@kernel
def add_elastic(planes, scratch, c):
    """The planes' elastic compliance."""
    for a in range(planes.normal.shape[0]):
        flexible = 1.0 / scratch.plane[a, PLANE.modulus]
        for i in range(6):
            for j in range(i, 6):
                c[i, j] += flexible * planes.elastic[a, i, j]
    for i in range(6):
        for j in range(i):
            c[i, j] = c[j, i]


@kernel
def add_plastic(material, planes, active, scratch, c, g):
    """The plastic compliance of loading planes, and what a rate of void ratio adds to their flow, into `g`."""
    b = scratch.gather[1]
    by_p, by_e, density = (
        scratch.shared[SHARED.by_pressure],
        scratch.shared[SHARED.by_void_ratio],
        scratch.shared[SHARED.density],
    )
    opened = 1.0 + scratch.shared[SHARED.void_ratio]
    for a in range(planes.normal.shape[0]):
        if not active[a]:
            continue
        row = scratch.plane[a]
        m1, m2, m3 = planes.branch[a, 0], planes.branch[a, 1], planes.branch[a, 2]
        f1, f2, f3 = scratch.flow[a, 0], scratch.flow[a, 1], scratch.flow[a, 2]
        shear = scratch.shear_mandel[a]
        shear[0], shear[1], shear[2] = m1 * f1, m2 * f2, m3 * f3
        shear[3], shear[4], shear[5] = (
            (m2 * f3 + m3 * f2) / ROOT2,
            (m1 * f3 + m3 * f1) / ROOT2,
            (m1 * f2 + m2 * f1) / ROOT2,
        )
        factor = planes.weight3[a] / row[PLANE.hardening]
        drop = row[PLANE.softening] * by_p / 3.0
        for j in range(6):
            b[j] = shear[j] - row[PLANE.slope] * planes.normal_mandel[a, j] - (drop if j < 3 else 0.0)
        by_strain = opened * void_ratio_effect(row, by_e, density, material)
        for i in range(6):
            flow = factor * (row[PLANE.beta] * planes.normal_mandel[a, i] + shear[i])
            g[i] += flow * by_strain
            for j in range(6):
                c[i, j] += flow * b[j]


@kernel
def add_principal(material, planes, active, scratch, c, g):
    """Both, of planes which stand for their mirror images: normal and shear components do not meet.

    Sums are numbers of their own, not entries of arrays, so that they stay in registers.
    """
    by_p, by_e, density = (
        scratch.shared[SHARED.by_pressure],
        scratch.shared[SHARED.by_void_ratio],
        scratch.shared[SHARED.density],
    )
    opened = 1.0 + scratch.shared[SHARED.void_ratio]
    c11, c12, c13, c21, c22, c23, c31, c32, c33 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    c44, c55, c66, g1, g2, g3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for a in range(planes.normal.shape[0]):
        row, elastic = scratch.plane[a], planes.elastic[a]
        flexible = 1.0 / row[PLANE.modulus]
        e12, e13, e23 = flexible * elastic[0, 1], flexible * elastic[0, 2], flexible * elastic[1, 2]
        c11, c22, c33 = c11 + flexible * elastic[0, 0], c22 + flexible * elastic[1, 1], c33 + flexible * elastic[2, 2]
        c12, c21, c13, c31, c23, c32 = c12 + e12, c21 + e12, c13 + e13, c31 + e13, c23 + e23, c32 + e23
        c44, c55, c66 = c44 + flexible * elastic[3, 3], c55 + flexible * elastic[4, 4], c66 + flexible * elastic[5, 5]
        if not active[a]:
            continue
        normal = planes.normal_mandel[a]
        m1, m2, m3 = planes.branch[a, 0], planes.branch[a, 1], planes.branch[a, 2]
        f1, f2, f3 = scratch.flow[a, 0], scratch.flow[a, 1], scratch.flow[a, 2]
        factor, slope, beta = planes.weight3[a] / row[PLANE.hardening], row[PLANE.slope], row[PLANE.beta]
        drop = row[PLANE.softening] * by_p / 3.0
        by_strain = opened * void_ratio_effect(row, by_e, density, material)
        b1 = m1 * f1 - slope * normal[0] - drop
        b2 = m2 * f2 - slope * normal[1] - drop
        b3 = m3 * f3 - slope * normal[2] - drop
        flow1 = factor * (beta * normal[0] + m1 * f1)
        flow2 = factor * (beta * normal[1] + m2 * f2)
        flow3 = factor * (beta * normal[2] + m3 * f3)
        g1, g2, g3 = g1 + flow1 * by_strain, g2 + flow2 * by_strain, g3 + flow3 * by_strain
        c11, c12, c13 = c11 + flow1 * b1, c12 + flow1 * b2, c13 + flow1 * b3
        c21, c22, c23 = c21 + flow2 * b1, c22 + flow2 * b2, c23 + flow2 * b3
        c31, c32, c33 = c31 + flow3 * b1, c32 + flow3 * b2, c33 + flow3 * b3
        s1, s2, s3 = (m2 * f3 + m3 * f2) / ROOT2, (m1 * f3 + m3 * f1) / ROOT2, (m1 * f2 + m2 * f1) / ROOT2
        c44 += factor * (beta * normal[3] + s1) * (s1 - slope * normal[3])
        c55 += factor * (beta * normal[4] + s2) * (s2 - slope * normal[4])
        c66 += factor * (beta * normal[5] + s3) * (s3 - slope * normal[5])
    c[0, 0], c[0, 1], c[0, 2], c[1, 0], c[1, 1], c[1, 2], c[2, 0], c[2, 1], c[2, 2] = (
        c11, c12, c13, c21, c22, c23, c31, c32, c33,
    )  # fmt: skip
    c[3, 3], c[4, 4], c[5, 5], g[0], g[1], g[2] = c44, c55, c66, g1, g2, g3


@kernel
def exchange_mean(c, g):
    """The mean with what the exchange of the lateral axes makes of it."""
    g[1] = 0.5 * (g[1] + g[2])
    g[2] = g[1]
    c[0, 1] = 0.5 * (c[0, 1] + c[0, 2])
    c[1, 0] = 0.5 * (c[1, 0] + c[2, 0])
    c[1, 1] = 0.5 * (c[1, 1] + c[2, 2])
    c[1, 2] = 0.5 * (c[1, 2] + c[2, 1])
    c[4, 4] = 0.5 * (c[4, 4] + c[5, 5])
    c[0, 2], c[2, 0], c[2, 2], c[2, 1], c[5, 5] = c[0, 1], c[1, 0], c[1, 1], c[1, 2], c[4, 4]


@kernel
def void_ratio_effect(row, by_e, density, material):
    """Derivative of the surface's resistance `sigma kappa` by void ratio at constant sliding."""
    if material.formulation != CONSISTENT:
        return 0.0
    return row[PLANE.softening] * by_e + row[PLANE.sigma] * row[PLANE.kappa] * (1.0 - row[PLANE.x]) * density


@kernel
def solve_6x6(matrix, right):
    """Solve in place with partial pivoting: `right` becomes the solution; the determinant is returned."""
    determinant = 1.0
    for k in range(6):
        pivot = k
        for i in range(k + 1, 6):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if pivot != k:
            determinant = -determinant
            for j in range(6):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            right[k], right[pivot] = right[pivot], right[k]
        determinant *= matrix[k, k]
        for i in range(k + 1, 6):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k + 1, 6):
                matrix[i, j] -= factor * matrix[k, j]
            right[i] -= factor * right[k]
    for k in range(5, -1, -1):
        for j in range(k + 1, 6):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]
    return determinant


@kernel
def rates(material, planes, control, sigma, eps, memory, active, scratch, out):
    """Rates of stress, strain and the path's parameter per unit of arc length, for given loading planes.

    Arc length keeps the rates finite where the control fails: there the rate of the parameter passes
    through zero. `out` is (13,), as `columns.STATE_ENTRIES`. The planes' loading measures, local rates
    and second-order works are left in `scratch`.
    """
    if not local_state(material, planes, sigma, eps, memory, active, scratch):
        return INVALID
    status = UNDECIDED
    for trial in range(50):
        coupling = homogenise(material, planes, active, scratch)
        control_matrix(control, scratch)
        for i in range(6):
            out[i] = control.target[i]
        determinant = solve_6x6(scratch.matrix, out) * coupling
        scratch.shared[SHARED.determinant] = determinant
        orient(control, scratch, out, determinant)
        if not isfinite(out[STATE.parameter]):
            return INVALID
        if local_rates(material, planes, active, scratch, out, trial // 10):
            status = VALID
            break
    return status


@kernel
def control_matrix(control, scratch):
    """`S + E C` into `scratch.matrix`."""
    for i in range(6):
        for j in range(6):
            value = control.stress_rows[i, j]
            for k in range(6):
                value += control.strain_rows[i, k] * scratch.compliance[k, j]
            scratch.matrix[i, j] = value


@kernel
def orient(control, scratch, out, determinant):
    """Strain rates from stress rates, all scaled to unit arc length and pointing onward along the path."""
    square = 0.0
    for i in range(6):
        value = 0.0
        for j in range(6):
            value += scratch.compliance[i, j] * out[j]
        out[STATE.strain + i] = value
        square += (value / control.strain_scale) ** 2 + (out[i] / control.stress_scale) ** 2
    scale = 1.0 / sqrt(square)
    if determinant * control.sign < 0.0:
        scale = -scale
    for i in range(STATE.parameter):
        out[i] *= scale
    out[STATE.parameter] = scale


@kernel
def local_rates(material, planes, active, scratch, out, patience):
    """Loading measure, plastic multiplier, strain rates and W2 of every plane.

    Planes without shear flow along their shear rate, which is known only now: returns False if
    one of these directions has changed. After ten trials those that do not
    flow are left at that (`patience` 1), after twenty all are (next to isotropic strain no choice may be consistent).
    """
    r11, r22, r33 = out[0], out[1], out[2]
    r23, r13, r12 = out[3] / ROOT2, out[4] / ROOT2, out[5] / ROOT2
    d_p = (r11 + r22 + r33) / 3.0
    d_void = -(1.0 + scratch.shared[SHARED.void_ratio]) * (
        out[STATE.strain] + out[STATE.strain + 1] + out[STATE.strain + 2]
    )
    by_p, by_e, density = (
        scratch.shared[SHARED.by_pressure],
        scratch.shared[SHARED.by_void_ratio],
        scratch.shared[SHARED.density],
    )
    size, stretch = 0.0, 0.0
    for i in range(6):
        size += out[i] * out[i]
        stretch += out[STATE.strain + i] * out[STATE.strain + i]
    size, stretch = sqrt(size), sqrt(stretch)
    settled = True
    for a in range(planes.normal.shape[0]):
        row = scratch.plane[a]
        m1, m2, m3 = planes.branch[a, 0], planes.branch[a, 1], planes.branch[a, 2]
        n1, n2, n3 = planes.normal[a, 0], planes.normal[a, 1], planes.normal[a, 2]
        t1 = r11 * m1 + r12 * m2 + r13 * m3
        t2 = r12 * m1 + r22 * m2 + r23 * m3
        t3 = r13 * m1 + r23 * m2 + r33 * m3
        d_normal = t1 * n1 + t2 * n2 + t3 * n3
        t1, t2, t3 = t1 - d_normal * n1, t2 - d_normal * n2, t3 - d_normal * n3
        flow = scratch.flow[a]
        if row[PLANE.tau] <= UNSHEARED * row[PLANE.sigma]:
            d_tau = sqrt(t1 * t1 + t2 * t2 + t3 * t3)
            flows = abs(flow[0]) + abs(flow[1]) + abs(flow[2]) > 0.0
            enough = d_tau > UNSHEARING * size if patience == 0 else flows and d_tau > 0.0 and patience == 1
            if enough:
                change = abs(flow[0] - t1 / d_tau) + abs(flow[1] - t2 / d_tau) + abs(flow[2] - t3 / d_tau)
                if change * d_tau > 1e-13 * size and change > 1e-12:
                    settled = False
                flow[0], flow[1], flow[2] = t1 / d_tau, t2 / d_tau, t3 / d_tau
            else:
                if flows:
                    settled = False
                flow[0], flow[1], flow[2] = 0.0, 0.0, 0.0
        along = flow[0] * t1 + flow[1] * t2 + flow[2] * t3
        measure = along - row[PLANE.slope] * d_normal
        measure -= row[PLANE.softening] * by_p * d_p + void_ratio_effect(row, by_e, density, material) * d_void
        elastic_shear = material.k_rR * row[PLANE.modulus]
        flexible = 1.0 / elastic_shear
        # relative to the rates at hand, so that rounding is told from loading; the multiplier of loading planes
        scale = size + elastic_shear * stretch
        if active[a]:
            scale *= row[PLANE.hardening] * flexible + ROUNDING
        row[PLANE.multiplier] = measure / scale
        local = scratch.local_rate[a]
        local[0], local[1] = material.k_rR * flexible * d_normal, flexible * t1
        local[2], local[3] = flexible * t2, flexible * t3
        if active[a]:
            multiplier = measure / row[PLANE.hardening]
            local[0] += row[PLANE.beta] * multiplier
            for i in range(3):
                local[1 + i] += flow[i] * multiplier
        row[PLANE.w2] = d_normal * local[0] + t1 * local[1] + t2 * local[2] + t3 * local[3]
        row[PLANE.sizes] = (d_normal**2 + t1**2 + t2**2 + t3**2) * (
            local[0] ** 2 + local[1] ** 2 + local[2] ** 2 + local[3] ** 2
        )
    return settled


@kernel
def find_loading_planes(material, planes, control, sigma, eps, memory, at_yield, active, scratch, out):
    """Find which of the planes at yield load, consistently with the rates that follow from it.

    All are tried as loading first; those whose multiplier would be negative unload, those that unload
    and would be pushed out load, until none of them changes. If all at once does not end, one at a time.
    `active` holds the answer; UNDECIDED if there is none.
    """
    n = active.shape[0]
    for a in range(n):
        active[a] = at_yield[a]
    for attempt in range(4 * n + 20):
        status = rates(material, planes, control, sigma, eps, memory, active, scratch, out)
        if status != VALID:
            return status
        worst, wrong = 0.0, -1
        for a in range(n):
            if not at_yield[a]:
                continue
            measure = scratch.plane[a, PLANE.multiplier]
            error = -measure if active[a] else measure
            if error > NEUTRAL:
                if attempt < 10:
                    active[a] = not active[a]
                if error > worst:
                    worst, wrong = error, a
        if wrong < 0:
            return VALID
        if attempt >= 10:
            active[wrong] = not active[wrong]
    return UNDECIDED
