"""The table of all quantities in results: column name, unit, label and meaning of each.

The table is used for the fields of history.parquet, the limits, the report, the page and docs/columns.md. A limit has
the name of the column that it bounds; :data:`BOUNDED` lists the few limits that bound a column of another name. Each
column declares where its error comes from, without which a limit on it is unproven.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from chipload.errors import InputError


@dataclass(frozen=True)
class ErrorSource:
    """Where the relative error of a quantity comes from.

    Parameters
    ----------
    exact : why the quantity has no error; empty: it has one
    like : columns whose error it has where the calculation states none of its own; the greatest of theirs counts
    """

    exact: str = ""
    like: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The source in words, for the page of columns."""
        if self.exact:
            return f"exact: {self.exact}"
        return f"as {', '.join(f'`{name}`' for name in self.like)}" if self.like else "stated by the calculation"


@dataclass(frozen=True)
class Column:
    """A quantity in results: its name, unit, label and meaning.

    Parameters
    ----------
    name : of the column, with the unit in it
    unit : as printed; empty for a count or a word
    label : name shown to the user
    meaning : one sentence
    error : where its relative error comes from; a limit on a column whose error nothing states is unproven
    signed : whether a limit bounds its size, whatever the sign
    least : whether a limit is the least value that is allowed
    none : of a count, what it says in words where it is 0; empty: "no" and the label
    """

    name: str
    unit: str
    label: str
    meaning: str
    error: ErrorSource = ErrorSource()
    signed: bool = False
    least: bool = False
    none: str = ""

    @property
    def title(self) -> str:
        """Label and unit.

        >>> COLUMNS["force_n"].title
        'force [N]'
        """
        return f"{self.label} [{self.unit}]" if self.unit else self.label


#: names, numbers and states; what the program and the job state; quantities whose error the calculation must state
LABEL = ErrorSource("a name, a number or a state, not a measured size")
PATH = ErrorSource("follows from the program's motions by coordinates alone")
COMMANDED = ErrorSource("commanded or stated, not calculated")
COMPARED = ErrorSource("difference of a measured and a predicted mean, both of which are stated")
COUNT = ErrorSource("a count of checked points; what lies between them is certified apart")
SPREAD = ErrorSource("a probability, which contains the spread of modes and coefficients")
STATED = ErrorSource()
FORCE, TORQUE = ErrorSource(like=("force_n",)), ErrorSource(like=("torque_nm",))
MEAN_TORQUE, POWER = ErrorSource(like=("torque_mean_nm",)), ErrorSource(like=("power_w",))
MEAN_FORCE = ErrorSource(like=("force_n", "torque_mean_nm"))
NORMAL, DEFLECTION = ErrorSource(like=("force_normal_n",)), ErrorSource(like=("deflection_um",))

_ROWS = (
    # where and when
    ("operation", "", "operation", "number of the operation in the job, from 0", LABEL),
    ("track", "", "track", "the strategy, variant, controller or program that the row belongs to", LABEL),
    ("pass", "", "pass", "name of the pass or section of the program", LABEL),
    ("line", "", "line", "line of the program; 0: none", LABEL),
    ("tool", "", "tool", "tool number", LABEL),
    ("motion", "", "motion", "rapid, line, arc or dwell", LABEL),
    ("rapid", "", "rapid", "whether the step is a rapid", LABEL),
    ("s_mm", "mm", "path", "length of the tip's path up to the end of the step", PATH),
    ("t_s", "s", "time", "time at the end of the step, with all rapids but the first, whose start is unknown", STATED),
    ("duration_s", "s", "duration", "time that the step takes on the machine", STATED),
    ("wait_s", "s", "wait", "what of the duration the machine stands after the step, as in a dwell", STATED),
    ("cutting_s", "s", "cutting time", "time of the step at the commanded feed", STATED),
    ("x_mm", "mm", "x", "tip in the workpiece frame", PATH),
    ("y_mm", "mm", "y", "tip in the workpiece frame", PATH),
    ("z_mm", "mm", "z", "tip in the workpiece frame", PATH),
    ("axis_x", "", "axis x", "tool axis in the workpiece frame, a unit vector from the tip to the spindle", PATH),
    ("axis_y", "", "axis y", "tool axis in the workpiece frame", PATH),
    ("axis_z", "", "axis z", "tool axis in the workpiece frame", PATH),
    ("contact_x_mm", "mm", "contact x", "contact point on the finished surface", PATH),
    ("contact_y_mm", "mm", "contact y", "contact point on the finished surface", PATH),
    ("contact_z_mm", "mm", "contact z", "contact point on the finished surface", PATH),
    # what is commanded
    ("feed_mm_min", "mm/min", "feed", "feed of the tip", COMMANDED),
    ("spindle_rpm", "1/min", "spindle speed", "spindle speed, negative when it turns anticlockwise", COMMANDED),
    ("override", "", "feed override", "feed over programmed feed", COMMANDED),
    ("override_state", "", "override state", "what determined the feed override", LABEL),
    ("feed_limited_by", "", "feed limited by", "what limits the feed of the line", LABEL),
    ("latency_s", "s", "latency", "time between a measurement and the override that follows from it", COMMANDED),
    # engagement and chip
    ("engagement_deg", "deg", "engagement", "engagement angle of the cutter", STATED),
    ("engagement_max_deg", "deg", "greatest engagement", "greatest engagement angle within the step", STATED),
    ("ae_mm", "mm", "radial depth of cut", "radial depth of cut", STATED),
    ("ap_mm", "mm", "axial depth of cut", "axial depth of cut", STATED),
    ("depth_mm", "mm", "depth of cut", "depth of cut normal to the surface", PATH),
    ("chip_max_mm", "mm", "chip thickness", "greatest undeformed chip thickness", STATED),
    ("chip_volume_mm3", "mm\u00b3", "chip volume", "volume that the step removes", STATED),
    ("engaged_volume_mm3", "mm\u00b3", "engaged volume", "volume that the engaged edge sweeps in the step", STATED),
    ("cutting_work_j", "J", "cutting work", "work of the torque without the edge coefficients", STATED),
    ("chip_areas", "", "chip areas", "number of separate areas of the chip: on a layer, or along the edge (moves)",
     STATED),
    ("chip_layers", "", "chip layers", "number of layers of the stock that lose material", STATED),
    ("flute_fill", "", "chip space", "loose chip volume of a tooth over the volume of its flute", MEAN_TORQUE),
    # loads
    ("force_n", "N", "force", "greatest magnitude of the force on the cutter over a revolution", STATED),
    ("force_xy_n", "N", "force across the axis", "greatest force on the cutter across its axis over a revolution",
     FORCE),
    ("force_axial_n", "N", "axial force", "greatest force on an upright cutter along its axis over a revolution, "
     "towards either end", FORCE),
    ("force_x_n", "N", "force x", "force on the cutter where the force across the axis is greatest", FORCE),
    ("force_y_n", "N", "force y", "force on the cutter where the force across the axis is greatest", FORCE),
    ("force_z_n", "N", "force z", "force on the cutter where the force across the axis is greatest", FORCE),
    ("force_x_mean_n", "N", "mean force x", "mean of the force on the cutter over a revolution", MEAN_FORCE),
    ("force_y_mean_n", "N", "mean force y", "mean of the force on the cutter over a revolution", MEAN_FORCE),
    ("force_z_mean_n", "N", "mean force z", "mean of the force on the cutter over a revolution", MEAN_FORCE),
    ("force_x_max_n", "N", "greatest force x", "greatest value over a revolution", FORCE),
    ("force_y_max_n", "N", "greatest force y", "greatest value over a revolution", FORCE),
    ("force_z_max_n", "N", "greatest force z", "greatest value over a revolution", FORCE),
    ("force_x_min_n", "N", "least force x", "least value over a revolution", FORCE),
    ("force_y_min_n", "N", "least force y", "least value over a revolution", FORCE),
    ("force_z_min_n", "N", "least force z", "least value over a revolution", FORCE),
    ("force_sd_n", "N", "standard deviation of force", "of the greatest force, from the spread of the coefficients",
     FORCE),
    ("torque_sd_nm", "N m", "standard deviation of torque", "of the greatest torque, from the spread of coefficients",
     TORQUE),
    ("torque_mean_sd_nm", "N m", "standard deviation of mean torque", "from the spread of the coefficients",
     MEAN_TORQUE),
    ("power_sd_w", "W", "standard deviation of power", "of the mean power, from the spread of the coefficients", POWER),
    ("thrust_n", "N", "drill thrust", "thrust of a drill along its axis; 0 in other steps", MEAN_TORQUE),
    ("force_normal_n", "N", "normal force", "greatest force normal to the surface that the step leaves", FORCE),
    ("force_normal_planned_n", "N", "planned normal force", "normal force that the plan expects", FORCE),
    ("force_allowable_n", "N", "allowable normal force", "normal force that the workpiece allows at the place", STATED),
    ("force_over_allowable", "", "force over allowable", "normal force over allowable normal force", NORMAL),
    ("torque_nm", "N m", "torque", "greatest torque on the cutter over a revolution", STATED),
    ("torque_mean_nm", "N m", "mean torque", "mean torque over a revolution, which the spindle must supply; mean over "
     "the step", STATED),
    ("torque_rise", "", "rise of torque", "greatest mean torque over a revolution within the step, over that of the "
     "step, less 1; the error of limits on mean torque and power contains it", MEAN_TORQUE),
    ("torque_measured_nm", "N m", "measured torque", "torque as the controller measures it", STATED),
    ("torque_planned_nm", "N m", "planned torque", "mean torque that the plan expects at the programmed feed",
     MEAN_TORQUE),
    ("torque_allowable_nm", "N m", "allowable torque", "torque that the workpiece allows at the place", STATED),
    ("torque_over_percent", "%", "torque over allowable", "torque above the allowable torque, in percent of it",
     STATED),
    ("power_w", "W", "power", "mean power over a revolution, mean over the step", MEAN_TORQUE),
    ("cutter_stress_mpa", "MPa", "cutter stress", "greatest equivalent stress of shank and fluted section", FORCE),
    ("strength_share", "", "stress over strength", "greatest equivalent stress of the workpiece over its strength",
     STATED),
    ("stress_mpa", "MPa", "workpiece stress", "greatest equivalent stress of the workpiece", STATED),
    # deflection and form error
    ("deflection_um", "\u00b5m", "deflection", "relative displacement of cutter and workpiece", FORCE),
    ("deflection_cutter_um", "\u00b5m", "cutter deflection", "deflection of cutter, holder and spindle", FORCE),
    ("deflection_workpiece_um", "\u00b5m", "workpiece deflection", "deflection of the workpiece", STATED),
    ("deflection_share", "", "deflection over model range", "deflection over the range of the rigid force model",
     DEFLECTION),
    ("form_error_um", "\u00b5m", "form error", "material left on the surface by deflection; negative: removed",
     STATED, True),
    ("flatness_um", "\u00b5m", "flatness", "width of the underside of the released part about its mean plane", STATED),
    ("distortion_um", "\u00b5m", "distortion", "deviation of the released part from where its surface was milled, over "
     "the best place of the part", STATED, True),
    ("form_points", "", "finished points", "number of points of the part's surface that the step finishes", STATED),
    ("ramp_deg", "deg", "ramp angle", "angle of descent into material under the cutter's centre; 90: a plunge", PATH),
    ("axial_overrun_mm", "mm", "cut above the flutes", "engaged length of the cutter above its flutes", STATED),
    # vibration
    ("stability_margin", "", "stability margin", "factor by which the cutting force (with straight teeth, the depth of "
     "cut) could grow before the step chatters; 3: 3 or more; 0: unknown", FORCE, False, True),
    ("stable_probability", "", "probability of stability", "probability that the step does not chatter, from the "
     "spread of modes and coefficients; 0: it certainly chatters, or unknown", SPREAD, False, True),
    ("chatter_hz", "Hz", "chatter frequency", "frequency of chatter at the stability margin; 0: the margin is 3",
     STATED),
    ("chatter_mode", "", "chatter mode", "number of the mode that chatters, from 1 in the order of the job; 0: none",
     LABEL),
    ("sle_um", "\u00b5m", "surface location error", "material left on the wall by forced vibration; negative: removed; "
     "0 if the step chatters or makes no wall", FORCE, True),
    # measured forces, and predicted ones to compare
    ("rotation_deg", "deg", "rotation", "rotation of tooth 0 from the beginning of a slot", COMMANDED),
    ("force_feed_n", "N", "force along the feed", "predicted force on the cutter along the feed", STATED),
    ("force_across_n", "N", "force across the feed", "predicted force on the cutter to the left of the feed", STATED),
    ("force_axis_n", "N", "force along the axis", "predicted force on the cutter along its axis", STATED),
    ("force_feed_measured_n", "N", "measured force along the feed", "measured force, averaged over revolutions",
     STATED),
    ("force_across_measured_n", "N", "measured force across the feed", "measured force, averaged over revolutions",
     STATED),
    ("force_axis_measured_n", "N", "measured force along the axis", "measured force, averaged over revolutions",
     STATED),
    ("mean_percent", "%", "error of mean force", "predicted minus measured mean force, over the measured one",
     COMPARED, True),
    ("peak_percent", "%", "error of peak force", "predicted minus measured peak force, over the measured one",
     COMPARED, True),
    # geometry of the part
    ("gouge_mm", "mm", "gouge", "deepest cut into the part", STATED),
    ("excess_mm", "mm", "excess", "greatest thickness left on the part where the cutter came near it", STATED),
    ("scallop_mm", "mm", "scallop height", "height of the material left between two passes", STATED),
    ("clearance_mm", "mm", "clearance", "least distance of shank and holder from what they must not touch", STATED),
    ("tool_clearance_mm", "mm", "tool clearance", "least distance of the whole tool from points of the walls, except "
     "the wall that a pass mills; 20: 20 or more", STATED),
    ("table_deg", "deg", "table angle", "angle between the axis of the pallet and the tool axis", PATH),
    ("pallet_deg", "deg", "pallet angle", "direction of the tool axis about the axis of the pallet", PATH),
    ("largest_diameter_mm", "mm", "largest diameter", "diameter of the largest cutter that reaches a contact point",
     STATED),
    ("unreached_points", "", "contact points not reached", "number of contact points that no cutter reaches", COUNT,
     False, False, "all contact points reached"),
    ("uncertified_points", "", "contact points not certified", "number of points whose largest cutter is uncertified",
     COUNT, False, False, "all contact points certified"),
    ("time_s", "s", "program time", "time of the program on the machine", STATED),
)  # fmt: skip


#: units by the ending of a column's name
UNITS: Mapping[str, str] = {
    "mm_min": "mm/min", "mm3": "mm\u00b3", "mm": "mm", "um": "\u00b5m", "deg": "deg", "s": "s", "n": "N", "nm": "N m",
    "w": "W", "j": "J", "mpa": "MPa", "rpm": "1/min", "percent": "%", "hz": "Hz",
}  # fmt: skip


def unit_of(name: str) -> str:
    """Return the unit that the ending of a column's name states; empty if it states none.

    >>> unit_of("feed_mm_min"), unit_of("torque_nm"), unit_of("tool")
    ('mm/min', 'N m', '')
    """
    words = name.split("_")
    return next((UNITS[end] for k in range(1, len(words)) if (end := "_".join(words[k:])) in UNITS), "")


def _by_name(columns: Iterable[Column]) -> Mapping[str, Column]:
    """Return the columns by name; each name is unique."""
    table: dict[str, Column] = {}
    for column in columns:
        if column.name in table:
            raise ValueError(f"column {column.name}: appears twice in the table of columns")
        if column.unit != unit_of(column.name):
            raise ValueError(f"column {column.name}: unit {column.unit!r} is not that of its name")
        table[column.name] = column
    return table


#: every quantity by its column name
COLUMNS: Mapping[str, Column] = _by_name(Column(*row) for row in _ROWS)

#: limits that bound a column of another name: limit, (column, label)
BOUNDED: Mapping[str, tuple[str, str]] = {
    "spindle_torque_nm": ("torque_mean_nm", "spindle torque"),
    "spindle_power_w": ("power_w", "spindle power"),
}


def column_of(limit: str) -> Column:
    """Return the column that a limit bounds, with the label of the limit.

    >>> column_of("spindle_power_w").title, column_of("spindle_power_w").name
    ('spindle power [W]', 'power_w')

    Raises
    ------
    InputError
        No column has this name.
    """
    name, label = BOUNDED.get(limit, (limit, ""))
    if name not in COLUMNS:
        raise InputError(f"limit {limit}: not known: no column of a history has this name")
    own = COLUMNS[name]
    return replace(own, label=label) if label else own


def error_of(column: str, errors: Mapping[str, float]) -> float:
    """Return the relative error of a column, from those that a calculation states; inf where nothing states it.

    Parameters
    ----------
    column : name of the column
    errors : relative errors that the calculation states, by column

    Examples
    --------
    >>> error_of("cutter_stress_mpa", {"force_n": 0.02}), error_of("feed_mm_min", {}), error_of("chip_max_mm", {})
    (0.02, 0.0, inf)
    >>> error_of("deflection_share", {"force_n": 0.02, "deflection_um": 0.03})
    0.03
    """
    if column in errors:
        return errors[column]
    source = COLUMNS[column].error
    if source.exact:
        return 0.0
    return max((error_of(name, errors) for name in source.like), default=math.inf)
