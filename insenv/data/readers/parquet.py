"""Apache Parquet, by pyarrow (the ``io`` extra)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from insenv.core.errors import InputError
from insenv.data.readers.conventions import unit_of
from insenv.data.readers.table import Column, Table, as_labels, as_numbers, check_size, decoding, find_column


def read_parquet(path: Path, columns: Sequence[Column]) -> Table:
    """Wanted columns of a Parquet file; missing values are an error.

    Raises
    ------
    InputError
        If pyarrow is not installed, the file is damaged, or a column is missing or no number.
    """
    try:
        from pyarrow import parquet
    except ImportError:
        raise InputError(f"{path}: Parquet needs pyarrow; install insenv[io]") from None
    with decoding(path, "Parquet"):
        file = parquet.ParquetFile(path, page_checksum_verification=True)
        names = list(file.schema_arrow.names)
        wanted = {c: names[find_column(path, names, c)] for c in columns}
        metadata = file.metadata
        groups = sum(metadata.row_group(i).total_byte_size for i in range(metadata.num_row_groups))
        unfolded = max(groups, 8.0 * metadata.num_rows * len(set(wanted.values())))
        check_size(path, unfolded, path.stat().st_size)
        data = file.read(columns=list(dict.fromkeys(wanted.values())))
        for column, name in wanted.items():
            if data.column(name).null_count:
                row = data.column(name).is_null().to_pylist().index(True)
                raise InputError(f"{path}: row {row}: {column} is missing; wanted a value")
        arrays = {c: data.column(name).to_numpy() for c, name in wanted.items()}
        values = {c.channel: as_numbers(path, c, a) for c, a in arrays.items() if not c.label}
        labels = {c.channel: as_labels(path, c, a) for c, a in arrays.items() if c.label}
    units = {c.channel: unit for c, name in wanted.items() if (unit := unit_of(names, names.index(name)))}
    return Table(values, labels, units)
