"""Rows as pandas DataFrames. pandas is not among the dependencies: whoever wants frames installs it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from gradient_routes.bench.cases.column import Column
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from pandas import DataFrame

DTYPES = {"INTEGER": "Int64", "REAL": "Float64", "TEXT": "string"}


def frame(columns: Iterable[Column], names: Sequence[str], records: Iterable[tuple[Any, ...]]) -> DataFrame:
    """Records as a DataFrame whose types are those of `columns`, whatever the data; other columns are text.

    Raises InputError where pandas is not installed.
    """
    try:
        import pandas as pd
    except ImportError as error:
        raise InputError("pandas is not installed - pip install 'gradient-routes[frames]'") from error
    types = {column.name: column.type.removesuffix(" PRIMARY KEY") for column in columns}
    data = pd.DataFrame.from_records(list(records), columns=list(names))
    return data.astype({name: DTYPES[types.get(name, "TEXT")] for name in names})
