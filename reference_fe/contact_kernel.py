"""Compiled loops over the contact points of one obstacle (law and averages over a step: contact.py).

Array shapes: nodes (f, a), shape (f, q, a), weight (f, q), place, before and slip (f, q, 3), displacement (n, 3),
slot (f, a, a). body: (kind, origin (3,), direction (3,), radius). law: (stiffness, damping, friction, stick
stiffness, stick damping). path: (1 / h, start, reach), see contact.Stretch.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from reference_fe.kernel import FAST, _scatter, inlined

PLANE, SPHERE, DRUM = 0, 1, 2


@inlined
def _arm(body, x, r):
    """Fill r (3) from the body's centre or axis to x; returns its length, of a plane the signed height."""
    kind, origin, direction, _ = body
    along = 0.0
    for i in range(3):
        r[i] = x[i] - origin[i]
        along += r[i] * direction[i]
    if kind == PLANE:
        return along
    if kind == DRUM:
        for i in range(3):
            r[i] -= along * direction[i]
    return math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])


@inlined
def _mean_normal(body, r0, l0, r1, l1, n):
    """Fill n (3) with n . (x1 - x0) = l1 - l0 exactly; the unit normal where both arms are one."""
    for i in range(3):
        n[i] = body[2][i] if body[0] == PLANE or l0 + l1 == 0 else (r0[i] + r1[i]) / (l0 + l1)


@inlined
def _ramp(a, b):
    """Mean of max(0, d) for d from a to b, its derivatives by a and b, and the share of the way with d > 0."""
    if a <= 0 and b <= 0:
        return 0.0, 0.0, 0.0, 0.0
    if a >= 0 and b >= 0:
        return 0.5 * (a + b), 0.5, 0.5, 1.0
    share = max(a, b) / abs(b - a)
    far, near = share - 0.5 * share * share, 0.5 * share * share
    return 0.5 * share * max(a, b), far if a > 0 else near, far if b > 0 else near, share


@inlined
def _pressure(law, path, d0, d1):
    """Mean pressure while the penetration goes from d0 to d1, its derivative by d1, and the spring's part."""
    k, c = law[0], law[1]
    per_step, start, reach = path
    if per_step == 0:
        return k * max(0.0, d1), k if d1 > -reach else 0.0, k * max(0.0, d1)
    a, rate = d0 + start * (d1 - d0), per_step * (d1 - d0)
    mean, by_a, by_b, share = _ramp(a, d1)
    spring, slope = k * mean, k * (start * by_a + by_b)
    if c == 0 or rate == 0:
        return spring, slope + (c * per_step if mean > 0 else 0.0), spring
    if rate > 0:
        return spring + c * rate * share, slope + c * per_step * (1.0 if share == 1 else 1 / (1 - start)), spring
    lag = -c * rate / k
    mean, by_a, by_b, _ = _ramp(a - lag, d1 - lag)
    return k * mean, k * (start * by_a + by_b) + c * per_step * (by_a + by_b), spring


@inlined
def _friction(law, per_step, limit, n, move, slip, t, new):
    """Fill the traction t (3) and the new slip (3) of a move (3) over the step; returns the trial's size."""
    size = math.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    across, before, trial, length = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        across += n[i] * move[i] / size if size > 0 else 0.0
        before += n[i] * slip[i] / size if size > 0 else 0.0
    for i in range(3):
        unit = n[i] / size if size > 0 else 0.0
        shear = move[i] - across * unit
        new[i] = slip[i] - before * unit + shear
        t[i] = -(law[3] * new[i] + law[4] * per_step * shear)
        trial += t[i] * t[i]
        length += new[i] * new[i]
    trial, length = math.sqrt(trial), law[3] * math.sqrt(length)
    for i in range(3):
        if trial > limit:
            t[i] *= limit / trial
        if trial > limit and length > limit:
            new[i] *= limit / length
    return trial


@inlined
def _here(place, shape, u, x):
    """Fill x (3): where a point of the reference place is, with its nodes' displacements u (a, 3)."""
    for i in range(3):
        x[i] = place[i]
        for a in range(shape.size):
            x[i] += shape[a] * u[a, i]


@inlined
def _meet(body, law, path, x0, x1, slip, n, n1, t, new):
    """One point going from x0 to x1: fills the mean normal n, the last one n1, the traction t of friction and the
    new slip. Returns the penetrations at both ends, mean pressure, its slope, the spring's part, the trial friction,
    and the length (m) by which the normal turns; all zero where the point stays outside."""
    l1 = _arm(body, x1, n1)
    l0 = _arm(body, x0, t)
    d0, d1 = body[3] - l0, body[3] - l1
    if d0 <= 0 and d1 <= -path[2]:
        return d0, d1, 0.0, 0.0, 0.0, 0.0, 1.0
    turn = l0 + l1
    if path[0] == 0:  # statics: the normal at the end
        _mean_normal(body, n1, l1, n1, l1, n)
        turn = l1
    else:
        _mean_normal(body, t, l0, n1, l1, n)
    _mean_normal(body, n1, l1, n1, l1, n1)
    pressure, slope, spring = _pressure(law, path, d0, d1)
    trial = 0.0
    t[0] = t[1] = t[2] = 0.0
    if law[2] > 0:
        trial = _friction(law, path[0], law[2] * pressure, n, x1 - x0, slip, t, new)
    return d0, d1, pressure, slope, spring, trial, turn


@njit(cache=True, fastmath=FAST)
def add_force(body, law, path, nodes, shape, weight, place, before, slip, displacement, force, grip):
    """Add the mean contact force over a step to `force` (n, 3), and its stiffness at each node to `grip` (n,)."""
    count = nodes.shape[1]
    u, x, n, n1, t, new = np.empty((count, 3)), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for f in range(nodes.shape[0]):
        for a in range(count):
            for i in range(3):
                u[a, i] = displacement[nodes[f, a], i]
        for q in range(weight.shape[1]):
            _here(place[f, q], shape[f, q], u, x)
            met = _meet(body, law, path, before[f, q], x, slip[f, q], n, n1, t, new)
            pressure, slope, trial = met[2], met[3], met[5]
            if pressure == 0 and slope == 0:
                continue
            if law[2] > 0 and trial <= law[2] * pressure:
                slope = max(slope, law[3] + law[4] * path[0])
            for a in range(count):
                share = weight[f, q] * shape[f, q, a]
                grip[nodes[f, a]] += share * shape[f, q, a] * slope
                for i in range(3):
                    force[nodes[f, a], i] += share * (pressure * n[i] + t[i])


@inlined
def _stiffness(body, law, per_step, met, n, n1, t, K):
    """Fill K (3, 3) = - d(pressure n + t) / dx1 at one point, its symmetric part; without the part of the friction
    that follows the pressure, which has no symmetric counterpart."""
    _, _, pressure, slope, _, trial, turn = met
    curved = 0.0 if body[0] == PLANE or turn == 0 else pressure / turn
    limit, size = law[2] * pressure, n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    stick, slide = 0.0, 0.0
    if law[2] > 0 and limit > 0 and size > 0:
        stick = law[3] + law[4] * per_step
        if trial > limit:
            stick *= limit / trial
            slide = stick / (limit * limit)
    for i in range(3):
        for j in range(3):
            one = 1.0 if i == j else 0.0
            flat = one - body[2][i] * body[2][j] if body[0] == DRUM else one
            normal = 0.5 * (n[i] * n1[j] + n1[i] * n[j])
            K[i, j] = slope * normal - curved * (flat - normal) - slide * t[i] * t[j]
            if stick > 0:
                K[i, j] += stick * (one - n[i] * n[j] / size)


@njit(cache=True, fastmath=FAST)
def add_tangent(
    body, law, path, nodes, shape, weight, place, before, slip, displacement, factor, number, indptr, slot, values
):
    """Add factor x the contact's tangent to the upper-triangle CSR values."""
    count = nodes.shape[1]
    u, x, n, n1, t, new = np.empty((count, 3)), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    K, block = np.empty((3, 3)), np.empty((count, count, 3, 3))
    for f in range(nodes.shape[0]):
        for a in range(count):
            for i in range(3):
                u[a, i] = displacement[nodes[f, a], i]
        touched = False
        for q in range(weight.shape[1]):
            _here(place[f, q], shape[f, q], u, x)
            met = _meet(body, law, path, before[f, q], x, slip[f, q], n, n1, t, new)
            if met[2] == 0 and met[3] == 0:
                continue
            if not touched:
                block[:] = 0.0
                touched = True
            _stiffness(body, law, path[0], met, n, n1, t, K)
            for a in range(count):
                for b in range(count):
                    share = factor * weight[f, q] * shape[f, q, a] * shape[f, q, b]
                    for i in range(3):
                        for j in range(3):
                            block[a, b, i, j] += share * K[i, j]
        if touched:
            for a in range(count):
                for b in range(count):
                    if slot[f, a, b] >= 0:
                        _scatter(block[a, b], False, number[nodes[f, a]], slot[f, a, b], indptr, values)


@njit(cache=True, fastmath=FAST)
def settle(body, law, path, nodes, shape, weight, place, before, slip, displacement, after, fresh):
    """Fill the places `after` and slips `fresh` (f, q, 3) behind a step; returns the energy stored there and the
    energy spent in the step (J)."""
    count = nodes.shape[1]
    u, n, n1, t = np.empty((count, 3)), np.empty(3), np.empty(3), np.empty(3)
    stored, spent = 0.0, 0.0
    for f in range(nodes.shape[0]):
        for a in range(count):
            for i in range(3):
                u[a, i] = displacement[nodes[f, a], i]
        for q in range(weight.shape[1]):
            new, old = fresh[f, q], slip[f, q]
            new[:] = 0.0
            _here(place[f, q], shape[f, q], u, after[f, q])
            met = _meet(body, law, path, before[f, q], after[f, q], old, n, n1, t, new)
            d0, d1, pressure, _, spring, _, _ = met
            spent += weight[f, q] * (pressure - spring) * (d1 - d0)
            if d1 <= 0:
                new[:] = 0.0
            else:
                stored += weight[f, q] * 0.5 * law[0] * d1 * d1
            for i in range(3):
                kept = 0.5 * law[3] * new[i] * new[i]
                lost = 0.5 * law[3] * old[i] * old[i] - kept
                if pressure > 0:
                    lost -= t[i] * (after[f, q, i] - before[f, q, i])
                stored += weight[f, q] * kept
                spent += weight[f, q] * lost
    return stored, spent


@njit(cache=True, fastmath=FAST)
def snapshot(body, law, nodes, shape, weight, place, slip, displacement, velocity, pressure, traction):
    """Fill pressure (f, q) and traction (f, q, 3) of the law at one instant."""
    u, x, r, rate = np.empty((nodes.shape[1], 3)), np.empty(3), np.empty(3), np.empty(3)
    nothing, t, new = np.zeros(3), np.empty(3), np.empty(3)
    for f in range(nodes.shape[0]):
        for q in range(weight.shape[1]):
            rate[:] = 0.0
            for a in range(nodes.shape[1]):
                for i in range(3):
                    u[a, i] = displacement[nodes[f, a], i]
                    rate[i] += shape[f, q, a] * velocity[nodes[f, a], i]
            _here(place[f, q], shape[f, q], u, x)
            length = _arm(body, x, r)
            pressure[f, q] = 0.0
            traction[f, q] = 0.0
            if length >= body[3]:
                continue
            _mean_normal(body, r, length, r, length, r)
            inward = -(r[0] * rate[0] + r[1] * rate[1] + r[2] * rate[2])
            pressure[f, q] = max(0.0, law[0] * (body[3] - length) + law[1] * inward)
            t[:] = 0.0
            if law[2] > 0:
                instant = (law[0], law[1], law[2], law[3], 0.0)
                new[:] = slip[f, q] + law[4] / law[3] * (rate + inward * r)
                _friction(instant, 0.0, law[2] * pressure[f, q], r, nothing, new.copy(), t, new)
            for i in range(3):
                traction[f, q, i] = pressure[f, q] * r[i] + t[i]
