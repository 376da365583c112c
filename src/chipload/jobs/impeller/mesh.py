"""Triangle meshes of the surfaces and bodies of an impeller."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipload.jobs.impeller.outcome import Searched
from chipload.planning.impeller.impeller import Impeller
from chipload.planning.impeller.surfaces import hub_range

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HUB, BLADE = (150, 156, 166, 255), (120, 130, 144, 255)
#: how far a coloured surface stands off the metal, so that it is seen [mm]
OFF = 0.05


def surface_mesh(op: Searched) -> tuple[Floats, Ints]:
    """Contact points (c, 3) [mm], a little off the metal, and triangles between them."""
    a, b = op.surface.shape
    return op.place + OFF * op.surface.scene.normal, grid_faces(a, b)


def body_meshes(impeller: Impeller, fine: tuple[int, int] = (33, 7)) -> list[tuple[str, tuple[Floats, Ints], Any]]:
    """Hub and blades: name, vertices and triangles, colour."""
    low, high = hub_range(impeller, 0.0)
    s, theta = np.linspace(low, high, fine[0]), np.linspace(0.0, 2.0 * np.pi, 121)
    hub = impeller.hub.at(np.repeat(s, len(theta)), np.tile(theta, len(s)))
    out = [("hub", (hub, grid_faces(len(s), len(theta))), HUB)]
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, fine[0]), np.linspace(0, 1, fine[1]), indexing="ij"))
    for body, name in zip(impeller.bodies, ("blade", "splitter"), strict=False):
        parts = [(side.at(u, v), grid_faces(*fine)) for side in (body.plus, body.minus)]
        plus, minus = (p.reshape(*fine, 3) for p, _ in parts)
        if impeller.fillets:
            fillet = impeller.fillets[0 if name == "blade" else 1]
            parts += [(side.at(u, v), grid_faces(*fine)) for side in (fillet.plus, fillet.minus)]
        parts += [_strip(plus[:, -1], minus[:, -1]), _strip(plus[0], minus[0]), _strip(plus[-1], minus[-1])]
        whole: list[tuple[Floats, Ints]] = []
        for k in range(impeller.blades):
            c, w = np.cos(k * impeller.pitch), np.sin(k * impeller.pitch)
            turn = np.array([[c, w, 0.0], [-w, c, 0.0], [0.0, 0.0, 1.0]])
            whole += [(p @ turn, f) for p, f in parts]
        starts = np.cumsum([0] + [len(p) for p, _ in whole[:-1]])
        faces = np.concatenate([f + k for (_, f), k in zip(whole, starts, strict=True)])
        out.append((f"{name}s", (np.concatenate([p for p, _ in whole]), faces), BLADE))
    return out


def grid_faces(a: int, b: int) -> Ints:
    """Triangles (2 (a - 1)(b - 1), 3) of a grid of a x b points, the second index the faster."""
    k = (np.arange(a - 1)[:, None] * b + np.arange(b - 1)).ravel()
    return np.concatenate([np.stack([k, k + b, k + b + 1], axis=1), np.stack([k, k + b + 1, k + 1], axis=1)])


def _strip(plus: Floats, minus: Floats) -> tuple[Floats, Ints]:
    """Between the same edge of both sides of a blade."""
    return np.concatenate([plus, minus]), grid_faces(2, len(plus))
