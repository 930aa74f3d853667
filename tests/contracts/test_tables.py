"""Tables in text files: every form that is read, and every ambiguity or mistake that is refused with its line."""

import os

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears import units
from gearchaos.gears.inputs.csvtable import MOST_BYTES, Column, read_table

COLUMNS = (
    Column("order"), Column("amplitude", units.LENGTH), Column("phase", units.ANGLE, ("phase angle",), required=False))
CURVE = (Column("roll angle", units.ANGLE, required=False), Column("fraction", required=False),
         Column("stiffness", units.STIFFNESS), Column("level", units.STIFFNESS, required=False, by_unit=False))


@pytest.fixture
def read(tmp_path):
    """A function that writes a text to a file and reads it as a table."""

    def read(text, columns=COLUMNS, **options):
        path = tmp_path / "table.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_table(path, columns, field="orders", **options)

    return read


SAME = {
    "commas": "order,amplitude [um],phase [deg]\n1,12.5,90\n2,0.5,-180\n",
    "semicolons": "order;amplitude [um];phase [deg]\n1;12.5;90\n2;0.5;-180\n",
    "tabs": "order\tamplitude [um]\tphase [deg]\n1\t12.5\t90\n2\t0.5\t-180\n",
    "spaces": "order amplitude[um]   phase [deg]\n1  12.5 90\n2 0.5 -180\n",
    "decimal commas": "order;amplitude [um];phase [deg]\n1;12,5;90\n2;0,5;-180\n",
    "decimal commas and tabs": "order\tamplitude [um]\tphase [deg]\n1\t12,500\t90\n2\t,5\t-1,8e2\n",
    "CRLF": "order,amplitude [um],phase [deg]\r\n1,12.5,90\r\n2,0.5,-180",
    "CR": "order,amplitude [um],phase [deg]\r1,12.5,90\r2,0.5,-180\r",
    "byte order mark": "\ufefforder,amplitude [um],phase [deg]\n1,12.5,90\n2,0.5,-180\n",
    "UTF-16": "order,amplitude [µm],phase [deg]\n1,12.5,90\n2,0.5,-180\n".encode("utf-16"),
    "micro sign": "order,amplitude [µm],phase [°]\n1,12.5,90\n2,0.5,-180\n",
    "Greek letter mu": "order,amplitude [μm],phase [deg]\n1,12.5,90\n2,0.5,-180\n",
    "comments": "# measured\n\norder,amplitude [um],phase [deg] # static\n1,12.5,90 # 1st\n\n# 2nd\n2,0.5,-180\n",
    "other units": "order,amplitude [mm],phase [rad]\n1,0.0125,1.5707963267948966\n2,5e-4,-3.141592653589793\n",
    "round brackets": "order,amplitude (um),phase (deg)\n1,12.5,90\n2,0.5,-180\n",
    "slash": "order,amplitude/[um],phase / (deg)\n1,12.5,90\n2,0.5,-180\n",
    "units alone": "order,um,deg\n1,12.5,90\n2,0.5,-180\n",
    "another order": "phase [deg],order,amplitude [um]\n90,1,12.5\n-180,2,0.5\n",
    "case and underscores": "ORDER,Amplitude [um],phase_angle [deg]\n1,12.5,90\n2,0.5,-180\n",
    "quotation marks": '"order","amplitude [um]","phase [deg]"\n"1","12.5","90"\n"2","0.5","-180"\n',
    "spaces around cells": " order , amplitude [um] ,  phase [deg]\n 1 , 12.5 , 90 \n2, .5 ,-180.\n",
    "exponents": "order,amplitude [um],phase [deg]\n1,1.25e+1,9E1\n+2,5e-1,-18e1\n",
}


@pytest.mark.parametrize("form", SAME)
def test_all_forms_of_a_table_are_read_as_the_same(read, form):
    table = read(SAME[form], abscissa=("order",))
    assert table.columns["order"].tolist() == [1, 2]
    assert table.columns["amplitude"] == pytest.approx([12.5e-6, 0.5e-6], rel=1e-15)
    assert table.columns["phase"] == pytest.approx([np.pi / 2, -np.pi], rel=1e-15)


def test_rows_know_their_lines(read):
    table = read(SAME["comments"])
    assert table.lines == (4, 7)
    error = table.error(1, "must be right", 3, "Correct it.")
    assert str(error) == f"{table.path}, line 7, must be right; got 3. Correct it."


def test_a_column_that_is_not_required_may_be_missing(read):
    assert set(read("order,um\n1,2\n").columns) == {"order", "amplitude"}


HEADER = "order,amplitude [um]\n"

REFUSED = {
    "empty": ("", None, "must have a header and rows"),
    "comments only": ("# nothing\n\n", None, "must have a header and rows"),
    "one line": (HEADER, 1, "at least 1 row"),
    "no header": ("1,2\n2,3\n", 1, "header with names and units"),
    "header in a comment": ("# order,amplitude [um]\n1,2\n", 2, "header with names and units"),
    "unknown column": ("order,amplitude [um],mass [kg]\n1,2,3\n", 1, "columns among"),
    "misspelt column": ("ordre,amplitude [um]\n1,2\n", 1, "Did you mean 'order'"),
    "column without name": ("order,amplitude [um],\n1,2,\n", 1, "columns among"),
    "unit without brackets": ("order,amplitude um\n1,2\n", 1, "put each unit in brackets"),
    "missing column": ("order,phase [deg]\n1,2\n", 1, "column amplitude"),
    "column twice": ("order,amplitude [um],um\n1,2,3\n", 1, "amplitude once"),
    "missing unit": ("order,amplitude\n1,2\n", 1, "the unit of amplitude"),
    "wrong unit": ("order,amplitude [kg]\n1,2\n", 1, "unit of a length"),
    "share as an angle": ("order,um,phase [%]\n1,2,3\n", 1, "unit of an angle"),
    "number of an angle": ("order,um,phase [1]\n1,2,3\n", 1, "unit of an angle"),
    "temperature as an angle": ("order,um,phase [°C]\n1,2,3\n", 1, "unit of an angle"),
    "unknown unit": ("order,amplitude [umm]\n1,2\n", 1, "unit of a length"),
    "unit of a pure number": ("order [Hz],amplitude [um]\n1,2\n", 1, "no unit for order"),
    "no number": (HEADER + "1,two\n", 2, "finite numbers"),
    "number with unit": (HEADER + "1,2 um\n", 2, "finite numbers"),
    "empty cell": (HEADER + "1,2\n2,\n", 3, "The cell is empty"),
    "NaN": (HEADER + "1,nan\n", 2, "finite numbers"),
    "infinity": (HEADER + "1,inf\n", 2, "finite numbers"),
    "overflow": (HEADER + "1,1e999\n", 2, "finite numbers"),
    "Python's underscores": (HEADER + "1,1_000\n", 2, "finite numbers"),
    "digits of other scripts": (HEADER + "1,٣\n", 2, "finite numbers"),
    "Fortran's exponent": (HEADER + "1,1.0D+3\n", 2, "finite numbers"),
    "too few cells": (HEADER + "1,2\n2\n", 3, "2 cells"),
    "too many cells": (HEADER + "1,2\n2,3,4\n", 3, "2 cells"),
    "decimal commas between commas": (HEADER + "1,2,5\n", 2, "semicolons"),
    "rows with other separators": (HEADER + "1;2\n", 2, "2 cells"),
    "decimal commas between spaces": ("order um\n1 2,5\n", 2, "no commas where spaces"),
    "comma that may separate thousands": ("order;um\n1;2,500\n2;1,250\n", 2, "may be a decimal comma"),
    "decimal comma beside a point": ("order;um\n1;2.5\n2;1,25\n", 3, "decimal point"),
    "thousands and decimals": ("order;um\n1;1,234.5\n", 2, "finite numbers"),
    "thousands and decimals in German": ("order;um\n1;1.234,5\n", 2, "finite numbers"),
    "spaces between thousands": ("order;um\n1;1 234\n", 2, "finite numbers"),
    "falling abscissa": (HEADER + "2,1\n1,2\n", 3, "greater order"),
    "repeated abscissa": (HEADER + "1,1\n1,2\n", 3, "repeat the order of line 2"),
    "repeated row": (HEADER + "1,1\n2,2\n2,2\n", 4, "repeat the order of line 3"),
    "Latin-1": ("order,amplitude [µm]\n".encode("latin-1"), 1, "UTF-8"),
    "null characters": (b"order,um\n1,\x00\n", None, "text file"),
    "UTF-16 without mark": ("order,um\n1,2\n".encode("utf-16-le"), None, "text file"),
    "broken UTF-16": (b"\xff\xfeo", 1, "UTF-8"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_in_one_way_only_is_refused_with_its_line(read, case, tmp_path):
    text, line, words = REFUSED[case]
    with pytest.raises(InputError) as raised:
        read(text, abscissa=("order",))
    assert words in str(raised.value)
    assert raised.value.field == ("orders" if line is None else f"{tmp_path / 'table.csv'}, line {line},")


def test_a_comma_is_decimal_if_another_number_of_the_file_shows_it(read):
    assert read("order;um\n1;2,500\n2;0,250\n").columns["amplitude"] == pytest.approx([2.5e-6, 0.25e-6])
    assert read("order;um\n1;2,500\n2;1234,5\n").columns["amplitude"] == pytest.approx([2.5e-6, 1234.5e-6])


def test_a_unit_alone_that_fits_two_columns_is_refused(read):
    columns = (Column("length", units.LENGTH, required=False), Column("width", units.LENGTH, required=False))
    with pytest.raises(InputError, match="length or width"):
        read("mm\n1\n", columns)


def test_exactly_one_abscissa_is_needed(read):
    for header in ("N/um\n1\n", "deg,fraction,N/um\n1,2,3\n"):
        with pytest.raises(InputError, match="exactly one of the columns roll angle, fraction"):
            read(header, CURVE, abscissa=("roll angle", "fraction"))


def test_a_jump_is_two_rows_with_the_same_abscissa_but_not_the_same_value(read):
    header = "roll angle [deg],stiffness [N/um]\n0,400\n"
    table = read(header + "1,300\n1,200\n2,100\n", CURVE, abscissa=("roll angle",), jumps=True)
    assert table.columns["stiffness"] == pytest.approx([4e8, 3e8, 2e8, 1e8], rel=1e-15)
    for rows in ("1,300\n1,300\n", "1,300\n1,200\n1,100\n"):
        with pytest.raises(InputError, match="must not repeat the roll angle of line"):
            read(header + rows, CURVE, abscissa=("roll angle",), jumps=True)


def test_a_least_number_of_rows_may_be_asked_for(read):
    assert len(read(HEADER + "1,2\n2,3\n", least_rows=2).lines) == 2
    with pytest.raises(InputError, match="at least 3 rows"):
        read(HEADER + "1,2\n2,3\n", least_rows=3)


def test_files_that_are_no_tables_are_refused(tmp_path, read):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path, tmp_path / "missing", tmp_path / "pipe", "null\0character", "/dev/zero"):
        with pytest.raises(InputError, match="orders must be a file that can be read"):
            read_table(path, COLUMNS, field="orders")
    for path in (3, None, b"bytes"):
        with pytest.raises(InputError, match="orders must be the path of a file"):
            read_table(path, COLUMNS, field="orders")


def test_a_large_file_is_refused(read):
    text = HEADER + "1,2\n" * (MOST_BYTES // 4)
    with pytest.raises(InputError, match="more than 4,000,000 bytes"):
        read(text)
