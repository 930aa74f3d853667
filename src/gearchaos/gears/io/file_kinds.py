"""What a file is that is given as a table, by its first bytes, and what to do with one that is none."""

from __future__ import annotations

import re

HEAD = 4096
"""Bytes in which a file shows what it is."""

_EXPORT = "Export the numbers as CSV, as a workbook, or in the Universal File Format (.uff)."
_HDF5 = "In Python: pandas.read_hdf or h5py, then to_csv."
_KINDS = tuple((re.compile(begin, re.DOTALL | re.IGNORECASE), what, advice) for begin, what, advice in (
    (rb"MATLAB 7\.3 MAT-file", "a MAT-file of version 7.3", "In MATLAB: save('table.mat', 'name', '-v7')."),
    (rb"TDSm", "a TDMS file of LabVIEW or DIAdem",
     "In Python: nptdms.TdmsFile.read('file.tdms').as_dataframe().to_csv('file.csv')."),
    (rb"MDF  |UnFinMF ", "a measurement file of ASAM MDF",
     "In Python: asammdf.MDF('file.mf4').to_dataframe().to_csv('file.csv')."),
    (rb"\x89HDF\r\n\x1a\n|.{512}\x89HDF\r\n\x1a\n", "an HDF5 file", _HDF5), (rb"CDF[\1\2\5]", "a NetCDF file", _HDF5),
    (rb"\x93NUMPY", "an array of NumPy", "In Python: numpy.savetxt('table.csv', numpy.load('file.npy'), "
     "delimiter=',', header='order,amplitude [um]')."),
    (rb"PAR1", "a Parquet file", "In Python: pandas.read_parquet('file.parquet').to_csv('file.csv')."),
    (rb"RIFF....WAVE", "a sound file", "In Python: scipy.io.wavfile.read gives its samples, to be scaled and written "
     "with their unit."),
    (rb"%PDF", "a PDF", "Ask for the table itself, or copy its rows to a text file."),
    (rb"\x89PNG|\xff\xd8\xff|GIF8|BM....\0\0\0\0|II\*\0|MM\0\*", "a picture",
     "Read the values off, or ask for the table."),
    (rb"\x1f\x8b|BZh\d|\xfd7zXZ\0|7z\xbc\xaf|Rar!|\x28\xb5\x2f\xfd", "a compressed file", "Unpack it first."),
    (rb"SQLite format 3", "a database", ""), (rb"\{\\rtf", "a document", ""),
    (rb"\s*(?:<!doctype html|<html|<\?xml)", "a page of HTML or XML", ""),
))


def is_mat(content: bytes) -> bool:
    """Whether a file begins as a MAT-file of version 5, which MATLAB's ``-v6`` and ``-v7`` write."""
    return content.startswith(b"MATLAB 5.0 MAT-file")


def no_table(head: bytes) -> str:
    """What a file is that its first bytes show to be no table, and what to do; empty for any other file."""
    return next((f"It is {what}. {advice or _EXPORT}" for begin, what, advice in _KINDS if begin.match(head)), "")
