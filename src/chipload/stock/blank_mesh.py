"""A stock in layers as one closed mesh whose parts overlap a little, so that no two of its faces lie in one plane."""

from __future__ import annotations

import numpy as np
import shapely

from chipload.lazy import trimesh
from chipload.stock.layers import LayeredStock
from chipload.stock.solid import prisms
from chipload.stock.tile_grid import polygons

#: greatest number of prisms, if sections differ from layer to layer
PRISMS = 64
#: overlap of neighbouring prisms [mm]: far above the resolution of rays, far below what is visible
OVERLAP_MM = 2e-3


def blank_mesh(stock: LayeredStock) -> trimesh.Trimesh:
    """Return the initial stock as a closed mesh [mm], from which a removal mesh can begin.

    Neighbouring layers with the same section form one prism. If there would be more than :data:`PRISMS`, the layers
    form that many groups instead, each a prism with the section of its middle layer.

    Examples
    --------
    >>> from chipload.stock.rings import ring_stock
    >>> tube = ring_stock(np.linspace(0.0, 2.0, 9), lambda z: 0 * z + 9.0, lambda z: 0 * z + 10.0)
    >>> mesh = blank_mesh(tube)
    >>> bool(mesh.is_watertight), bool(np.isclose(mesh.volume, tube.volume())), mesh.bounds[:, 2].tolist()
    (True, True, [0.0, 2.0])
    """
    if not stock.cut.any():
        return stock.body()
    sections = [stock.section(k) for k in range(stock.layers)]
    groups = [[0]]
    for k in range(1, stock.layers):
        if shapely.equals(sections[groups[-1][0]], sections[k]):
            groups[-1].append(k)
        else:
            groups.append([k])
    if len(groups) > PRISMS:
        groups = [part.tolist() for part in np.array_split(np.arange(stock.layers), PRISMS) if len(part)]
    out = []
    for group in groups:
        last = group[-1] == stock.layers - 1
        ends = [stock.bounds[group[0]], stock.bounds[group[-1] + 1] + (0.0 if last else OVERLAP_MM)]
        out.append(prisms([polygons(sections[group[len(group) // 2]])], np.array(ends)))
    return trimesh.util.concatenate([part for part in out if len(part.faces)])
