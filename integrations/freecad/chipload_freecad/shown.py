"""A result as objects of the document: the verdict, its findings at their places, and the path in colours.

Coordinates are those of the job. Objects are in the group `chipload`; a new result replaces them.
"""

import math

GROUP = "Chipload"
#: colours of the bands of a value, from its least to its greatest: blue to yellow, seen by all eyes
COLOURS = ((0.27, 0.0, 0.33), (0.23, 0.32, 0.55), (0.13, 0.57, 0.55), (0.37, 0.79, 0.38), (0.99, 0.91, 0.14))
#: findings that are shown at most
MOST_FINDINGS = 200


def bands(values, count=5):
    """The edges of equal bands from the least of some values to the greatest; none: of no value.

    >>> bands([0.0, 5.0, 10.0], 2)
    [0.0, 5.0, 10.0]
    """
    known = [v for v in values if isinstance(v, float) and math.isfinite(v)]
    if not known:
        return []
    low, high = min(known), max(known)
    return [low + (high - low) * k / count for k in range(count + 1)]


def runs(points, values, edges):
    """Polylines of each band: of steps that follow one another with values in the same band.

    Parameters
    ----------
    points : (n, 3), the end of each step; the first step, which begins nowhere, is left out
    values : (n,), of each step
    edges : of :func:`bands`

    >>> runs([(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)], [0.0, 1.0, 9.0, 9.0], [0.0, 5.0, 10.0])
    [[[(0, 0, 0), (1, 0, 0)]], [[(1, 0, 0), (2, 0, 0), (3, 0, 0)]]]
    """
    out = [[] for _ in edges[1:]]
    last = None
    for k in range(1, len(points)):
        value = values[k]
        if not (isinstance(value, float) and math.isfinite(value)) or points[k] == points[k - 1]:
            continue
        band = max(sum(value > edge for edge in edges[1:-1]), 0)
        if band == last and out[band][-1][-1] == points[k - 1]:
            out[band][-1].append(points[k])
        else:
            out[band].append([points[k - 1], points[k]])
        last = band
    return out


def show(document, result, column="force_n"):
    """Show a result in a document, its path in the colours of a column; return the group.

    Raises
    ------
    KeyError
        The history has no such column.
    """
    remove(document)
    group = document.addObject("App::DocumentObjectGroup", GROUP)
    group.Label = f"chipload: {result.verdict}"
    verdict = group.newObject("App::FeaturePython", "ChiploadVerdict")
    verdict.Label = result.message[:120]
    for name, value in (("Verdict", result.verdict), ("Message", result.message), ("Report", str(result.folder))):
        verdict.addProperty("App::PropertyString", name, "chipload")
        setattr(verdict, name, value)
    verdict.addProperty("App::PropertyStringList", "Limits", "chipload")
    verdict.Limits = [limit_text(limit) for limit in result.limits]
    verdict.addProperty("App::PropertyStringList", "Findings", "chipload")
    verdict.Findings = [finding["text"] for finding in result.findings]
    placed = [f for f in result.findings if f["place"]]
    placed += [
        {"text": limit_text(limit), "place": limit["place"]}
        for limit in result.limits if limit["state"] != "holds" and limit["place"]
    ]  # fmt: skip
    for finding in placed[:MOST_FINDINGS]:
        label = group.newObject("App::Annotation", "ChiploadFinding")
        label.Label = finding["text"][:80]
        label.LabelText = [finding["text"]]
        label.Position = tuple(finding["place"])
    _path(group, result, column)
    return group


def limit_text(limit):
    """A limit with its worst value and the line of the program."""
    worst = "not known" if limit["worst"] is None else f"{limit['worst']:.4g}"
    where = f" in line {limit['line']}" if limit["line"] else ""
    return f"{limit['name']}: {worst} of {limit['limit']:g} {limit['unit']}{where}: {limit['state']}".replace("  ", " ")


def _path(group, result, column):
    """The path of the tip, an object for each band of the column."""
    import Part

    columns = result.columns
    values = columns[column]
    points = list(zip(columns["x_mm"], columns["y_mm"], columns["z_mm"]))
    cuts = [rapid not in ("true", 1.0) for rapid in columns["rapid"]]
    values = [value if cut else math.nan for value, cut in zip(values, cuts)]
    edges = bands(values)
    for k, lines in enumerate(runs(points, values, edges)):
        if not lines:
            continue
        one = group.newObject("Part::Feature", "ChiploadPath")
        one.Label = f"{column} {edges[k]:.4g} to {edges[k + 1]:.4g}"
        one.Shape = Part.makeCompound([Part.makePolygon(line) for line in lines])
        if one.ViewObject is not None:
            one.ViewObject.LineColor = COLOURS[k]
            one.ViewObject.LineWidth = 3.0


def remove(document):
    """Remove what an earlier result left in the document."""
    group = document.getObject(GROUP)
    if group is not None:
        for one in list(group.Group):
            document.removeObject(one.Name)
        document.removeObject(group.Name)
