"""Stable Fluids in plain NumPy, as in Bonilla & Velho, section II: an oracle that shares no code with wfluid.

J. Stam, Stable Fluids, 1999, on a staggered grid: u (ny, nx + 1) and v (ny + 1, nx) on faces, displacement
and viscosity at centres. Lengths in longer sides. Every axis is "free-slip", "no-slip" or "periodic".
"""

import numpy as np


def padded(f, rules):
    """f with a ghost on every side; `rules` along y and x: "even", "odd", "face" or "periodic"."""
    for axis, rule in enumerate(rules):
        first, last = f.take([0], axis), f.take([-1], axis)
        if rule == "periodic":
            first, last = last, first
        sign = {"even": 1, "periodic": 1, "odd": -1, "face": 0}[rule]
        f = np.concatenate([sign * first, f, sign * last], axis)
    return f


def sampled(f, rules, y, x):
    """f between its points, bilinearly; y and x in points from its first one."""
    ghosts, places = padded(f, rules), []
    for place, rule, n in zip((y, x), rules, f.shape, strict=True):
        place = place % n if rule == "periodic" else np.clip(place, -1, n)
        before = np.minimum(np.floor(place).astype(int), n - (rule != "periodic" and rule != "face"))
        before = np.clip(before, -1, n - 1)
        places.append((before + 1, place - before))
    (j, t), (i, s) = places
    above = ghosts[j, i] * (1 - s) + ghosts[j, i + 1] * s
    below = ghosts[j + 1, i] * (1 - s) + ghosts[j + 1, i + 1] * s
    return above * (1 - t) + below * t


class StableFluids:
    """The fluid at rest, and its steps."""

    def __init__(self, nx, ny, width, height, walls, mu, sweeps):
        self.nx, self.ny, self.h, self.sweeps = nx, ny, (height / ny, width / nx), sweeps
        self.walls = walls[1], walls[0]  # along y, along x, as the axes of arrays
        self.mu = np.broadcast_to(np.asarray(mu, dtype=float), (ny, nx))
        self.u, self.v = np.zeros((ny, nx + 1)), np.zeros((ny + 1, nx))
        self.d = np.zeros((2, ny, nx))

    def step(self, dt, gained):
        """v0 + `gained` = v1, v1 traced gives v2, diffused v3, projected v4; v4 moves the map."""
        along_y, along_x = (wall == "periodic" for wall in self.walls)
        u, v = (f + g for f, g in zip((self.u, self.v), gained, strict=True))
        self.u, self.v = self.closed(u, v)
        y, x = self.feet(dt)
        # a face lies between two centres; the first ones have a centre before them only on a periodic axis
        faces_u, faces_v = ([(f + np.roll(f, 1, axis)) / 2 for f in (y, x)] for axis in (1, 0))
        rows, columns = np.arange(self.ny)[:, None], np.arange(self.nx)
        u, v = self.points(self.u, 1), self.points(self.v, 0)
        u[:, : self.nx] = sampled(u, self.rules(1), rows + faces_u[0], columns + faces_u[1])
        v[: self.ny] = sampled(v, self.rules(0), rows + faces_v[0], columns + faces_v[1])
        self.u, self.v = self.closed(self.whole(u, 1), self.whole(v, 0))
        u, v = self.points(self.u, 1), self.points(self.v, 0)
        u = self.diffused(u, self.mu, self.rules(1), self.h, dt)
        v = self.diffused(v.T, self.mu.T, self.rules(0)[::-1], self.h[::-1], dt).T
        self.u, self.v = self.projected(*self.closed(self.whole(u, 1), self.whole(v, 0)))
        y, x = self.feet(dt)
        normal = ["periodic" if p else "odd" for p in (along_y, along_x)]
        across = [self.tangential(axis) for axis in (0, 1)]
        rules = (across[0], normal[1]), (normal[0], across[1])
        offsets = x * self.h[1], y * self.h[0]
        self.d = np.stack(
            [sampled(d, r, rows + y, columns + x) + o for d, r, o in zip(self.d, rules, offsets, strict=True)]
        )

    def tangential(self, axis):
        """The rule along an axis for what moves parallel to its walls."""
        return {"free-slip": "even", "no-slip": "odd", "periodic": "periodic"}[self.walls[axis]]

    def rules(self, axis):
        """The rules along y and x of the component along `axis`."""
        own = "periodic" if self.walls[axis] == "periodic" else "face"
        return (self.tangential(0), own) if axis == 1 else (own, self.tangential(1))

    def points(self, f, axis):
        """A component's points: without the last face where it is the first one again."""
        return f.take(range(f.shape[axis] - 1), axis) if self.walls[axis] == "periodic" else f.copy()

    def whole(self, f, axis):
        """A component with its last face."""
        return np.concatenate([f, f.take([0], axis)], axis) if self.walls[axis] == "periodic" else f

    def closed(self, u, v):
        """The components with nothing through closed walls."""
        u, v = u.copy(), v.copy()
        if self.walls[1] == "periodic":
            u[:, -1] = u[:, 0]
        else:
            u[:, [0, -1]] = 0
        if self.walls[0] == "periodic":
            v[-1] = v[0]
        else:
            v[[0, -1]] = 0
        return u, v

    def feet(self, dt):
        """Where a step of Euler back along the velocity leads from every centre: offsets [cells] y, x."""
        centre = (self.v[1:] + self.v[:-1]) / 2, (self.u[:, 1:] + self.u[:, :-1]) / 2
        middles = np.arange(self.ny)[:, None] + 0.5, np.arange(self.nx)[None] + 0.5
        out = []
        for f, h, middle, n, wall in zip(
            centre, self.h, middles, (self.ny, self.nx), self.walls, strict=True
        ):
            offset = -dt * f / h
            out.append(offset if wall == "periodic" else np.clip(offset, -middle, n - middle))
        return out

    def diffused(self, f, mu, rules, h, dt):
        """f' - dt div (mu grad f') = f for a component along the second axis, by Jacobi sweeps from f."""
        wraps = tuple("periodic" if rule == "periodic" else "even" for rule in rules)
        m, columns = padded(mu, wraps), f.shape[1]
        node = (m[1:, 1:] + m[1:, :-1] + m[:-1, 1:] + m[:-1, :-1])[:, :columns] / 4
        a_y, a_x = dt / h[0] ** 2, dt / h[1] ** 2
        west, east = a_x * m[1:-1, :columns], a_x * m[1:-1, 1 : columns + 1]
        north, south = a_y * node[:-1], a_y * node[1:]
        out = f
        for _ in range(self.sweeps):
            p = padded(out, rules)
            pull = west * p[1:-1, :-2] + east * p[1:-1, 2:] + north * p[:-2, 1:-1] + south * p[2:, 1:-1]
            out = (f + pull) / (1 + west + east + north + south)
            if rules[1] == "face":
                out[:, [0, -1]] = 0
        return out

    def projected(self, u, v):
        """v - grad q with Lap q = div v, by Jacobi sweeps from 0."""
        h_y, h_x = self.h
        source = np.diff(u, axis=1) / h_x + np.diff(v, axis=0) / h_y
        rules = tuple("periodic" if wall == "periodic" else "even" for wall in self.walls)
        q = np.zeros_like(source)
        for _ in range(self.sweeps):
            p = padded(q, rules)
            near = (p[1:-1, :-2] + p[1:-1, 2:]) / h_x**2 + (p[:-2, 1:-1] + p[2:, 1:-1]) / h_y**2
            q = (near - source) / (2 / h_x**2 + 2 / h_y**2)
        p = padded(q, rules)
        return self.closed(u - np.diff(p[1:-1], axis=1) / h_x, v - np.diff(p[:, 1:-1], axis=0) / h_y)
