"""Conversion of a history to a pandas DataFrame or an xarray Dataset (both come with ``chipload[notebook]``)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chipload.lazy import require_extra
from chipload.result.columns import COLUMNS
from chipload.result.limits import Columns

if TYPE_CHECKING:
    import pandas
    import xarray

#: columns that tell where a row is: coordinates of a dataset
COORDINATES = ("t_s", "s_mm", "line", "pass")


def pandas_of(columns: Columns) -> pandas.DataFrame:
    """Return a DataFrame with a row for each step and the columns of a history.

    Raises
    ------
    InputError
        pandas is not installed.
    """
    require_extra("notebook", "pandas")
    import pandas

    return pandas.DataFrame({name: np.array(values) for name, values in columns.items()})


def xarray_of(columns: Columns) -> xarray.Dataset:
    """Return a Dataset with one dimension, ``step``.

    Time, path, line and pass are coordinates. Each variable has the attributes ``units``, ``long_name`` and
    ``description``; xarray shows them in plots and stores them in NetCDF files.

    Raises
    ------
    InputError
        xarray is not installed.
    """
    require_extra("notebook", "xarray")
    import xarray

    variables = {name: ("step", np.array(values), _attributes(name)) for name, values in columns.items()}
    coordinates = {name: variables.pop(name) for name in COORDINATES if name in variables}
    return xarray.Dataset(variables, coordinates)


def _attributes(name: str) -> dict[str, str]:
    if name not in COLUMNS:
        return {}
    column = COLUMNS[name]
    return {"units": column.unit, "long_name": column.label, "description": column.meaning}
