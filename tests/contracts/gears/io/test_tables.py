"""Tables in text files: every form that is read, and every ambiguity or mistake that is refused with its line."""

import os
import sys

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears.io import units
from gearchaos.gears.io.tables import MOST_BYTES, Column, read_table
from tests.contracts.gears.io.exports import workbook

ORDER, AMPLITUDE = Column("order"), Column("amplitude", {units.LENGTH: 1.0}, words="amplitude")
PHASE = Column("phase", {units.ANGLE: 1.0}, ("phase angle",), words="phase")
ANGLE = Column("roll angle", {units.ANGLE: 1.0}, words="angle")
STIFFNESS = Column("stiffness", {units.STIFFNESS: 1.0}, words="stiff|steif")
GROUPS = ((ORDER,), (AMPLITUDE,), (PHASE,))
TWO = ((ORDER,), (AMPLITUDE,))
CURVE = ((ANGLE, Column("fraction")), (STIFFNESS, Column("level", {units.STIFFNESS: 1.0})))


@pytest.fixture
def read(tmp_path):
    """A function that writes a text to a file and reads it as a table."""

    def read(text, groups=GROUPS, **options):
        path = tmp_path / "table.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_table(path, groups, field="orders", **options)

    return read


SAME = {
    "commas": "order,amplitude [um],phase [deg]\n1,12.5,90\n2,0.5,-180\n",
    "spaces": "order amplitude[um]   phase [deg]\n1  12.5 90\n2 0.5 -180\n",
    "texts in the first column": "remark  order  amplitude [um]  phase [deg]\nok  1  12.5  90\nok  2  0.5  -180\n",
    "decimal commas": "order;amplitude [um];phase [deg]\n1;12,5;90\n2;0,5;-180\n",
    "decimal commas and tabs": "order\tamplitude [um]\tphase [deg]\n1\t12,500\t90\n2\t,5\t-1,8e2\n",
    "CR": "order,amplitude [um],phase [deg]\r1,12.5,90\r2,0.5,-180\r",
    "byte order mark": "\ufefforder,amplitude [um],phase [deg]\n1,12.5,90\n2,0.5,-180\n",
    "UTF-16": "order,amplitude [µm],phase [deg]\n1,12.5,90\n2,0.5,-180\n".encode("utf-16"),
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
    "Windows-1252": "order;amplitude [µm];phase [°]\r\n1;12,5;90\r\n2;0,5;-180\r\n".encode("cp1252"),
    "sep=": "sep=;\norder;amplitude [um];phase [deg]\n1;12,5;90\n2;0,5;-180\n",
    "sep= with a comma": "sep=,\norder,amplitude [um],phase [deg]\n1,12.5,90\n2,.5,-180\n",
    "separators at the end": "order;amplitude [um];phase [deg];\n1;12,5;90;\n2;0,5;-180;\n;;;\n",
    "separators at the end of rows": "order,amplitude [um],phase [deg]\n1,12.5,90,\n2,0.5,-180,,\n",
    "other columns": "index;order;remark;amplitude [um];phase [deg];force [N]\n7;1;a b;12,5;90;\n8;2;;0,5;-180;3\n",
    "column without name": ",order,amplitude [um],phase [deg]\n0,1,12.5,90\n1,2,0.5,-180\n",
    "units in a row": "order;amplitude;phase\n;[um];[deg]\n1;12,5;90\n2;0,5;-180\n",
    "units in a row without brackets": "order,amplitude,phase\n-,um,deg\n1,12.5,90\n2,0.5,-180\n",
    "titles above": "Report of 24.11.2026\nTeeth: 17; 103\n\norder;amplitude [um];phase [deg]\n1;12,5;90\n2;0,5;-180\n",
    "header as a comment": "# measured\n# order,amplitude [um],phase [deg]\n1,12.5,90\n2,0.5,-180\n",
    "units after a slash": "order;amplitude / um;phase / (deg)\n1;12,5;90\n2;0,5;-180\n",
    "units after in": "order;amplitude in um;phase in °\n1;12,5;90\n2;0,5;-180\n",
    "fixed width": "  order   amplitude [um]     phase angle [deg]\n    1           12.5            90\n"
                   "    2            0.5          -180\n",
    "fixed width with decimal commas": "order    amplitude [um]    phase [deg]\n1  12,5  90\n2  0,5  -180\n",
    "one space": "order [-] amplitude [um] phase angle [deg]\n1 12.5 90\n2 0.5 -180\n",
    "decimal commas in quotation marks": 'order,"amplitude [um]","phase [deg]"\n1,"12,5",90\n2,"0,5",-180\n',
    "comma in a header": '"order","no, matter","amplitude [um]","phase [deg]"\n1,3,12.5,90\n2,4,0.5,-180\n',
    "line break in a header": 'order;"amplitude\n[um]";"phase\n[deg]"\n1;12,5;90\n2;0,5;-180\n',
    "minutes": "order,amplitude [um],phase [']\n1,12.5,5400\n2,0.5,-10800\n",
    "words": "order,amplitude of error [um],phase at entry [deg]\n1,12.5,90\n2,0.5,-180\n",
}


@pytest.mark.parametrize("form", SAME)
def test_all_forms_of_a_table_are_read_as_the_same(read, form):
    table = read(SAME[form], increasing=True)
    assert table.columns["order"].tolist() == [1, 2]
    assert table.columns["amplitude"] == pytest.approx([12.5e-6, 0.5e-6], rel=1e-15)
    assert table.columns["phase"] == pytest.approx([np.pi / 2, -np.pi], rel=1e-15)


def test_rows_know_their_lines(read):
    table = read(SAME["comments"])
    assert table.lines == (4, 7)
    error = table.error(1, "must be right", 3, "Correct it.")
    assert str(error) == f"{table.path}, line 7, must be right; got 3. Correct it."


@pytest.mark.parametrize("kind", ["xlsx", "ods"])
def test_a_workbook_is_read_as_a_text_is(read, kind):
    rows = [["Report"], ["order", "amplitude [µm]", "phase [deg]"], [1, 12.5, 90], [2, 0.5, -180]]
    table = read(workbook(kind, rows), increasing=True)
    assert table.columns["amplitude"] == pytest.approx([12.5e-6, 0.5e-6], rel=1e-15) and table.lines == (3, 4)
    with pytest.raises(InputError, match=r"table\.csv, line 4, must have finite numbers; got 'two'"):
        read(workbook(kind, [*rows[:3], [2, "two", 0]]))
    with pytest.raises(InputError, match=r"must be a workbook with one sheet that is not empty; got .*Save the sheet"):
        read(workbook(kind, rows, rows))


def test_files_of_spreadsheets_that_cannot_be_read_say_what_they_are(read, monkeypatch):
    for start in (b"PK\3\4", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"):
        with pytest.raises(InputError, match=r"must be a workbook that can be read, or a text.* Save the sheet as CSV"):
            read(start + bytes(600))
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(InputError, match=r'a workbook, needs the package python-calamine.*gearchaos\[tables\]'):
        read(workbook("xlsx", [["order"]]))


HEADER = "order,amplitude [um]\n"

REFUSED = {
    "empty": ("", None, "must have a header and rows"),
    "comments only": ("# nothing\n\n", None, "must have a header and rows"),
    "one line": (HEADER, 1, "must have rows of numbers"),
    "no header": ("1,2\n2,3\n", 1, "header with names and units"),
    "comment that is no header": ("# order of things\n1,2\n", 2, "must be a header with names and units"),
    "misspelt column": ("ordre,amplitude [um]\n1,2\n", 1, "must have the column order; got ['ordre', "),
    "unit without brackets": ("order,amplitude um\n1,2\n", 1, "its unit in brackets"),
    "missing column": ("order,phase [deg]\n1,2\n", 1, "column amplitude"),
    "column twice": ("order,amplitude [um],amplitude [mm]\n1,2,3\n", 1, "exactly one column for amplitude"),
    "meant twice": ("order,amplitude A [um],amplitude B [um]\n1,2,3\n", 1, "{ amplitude = 'amplitude A [um]' }"),
    "unit alone of other words": ("order,length [um]\n1,2\n", 1, "write columns = { amplitude = 'length [um]' }"),
    "missing unit": ("order,amplitude\n1,2\n", 1, "the unit of amplitude"),
    "wrong unit": ("order,amplitude [kg]\n1,2\n", 1, "unit of a length"),
    "inch or second": ('order,amplitude ["]\n1,2\n', 1, "unit of a length"),
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
    "numbers below the table": (HEADER + "1,2\nmean,2\n", 3, "must have finite numbers; got 'mean'"),
    "cells without a quotation mark": (HEADER + '1,"2\n' + "3" * 140_000, 3, "never closed"),
    "empty cells between spaces": ("order  amplitude [um]  phase [deg]\n1  2  3\n2  3\n", 3, "3 cells"),
    "letters of DOS": ("order;amplitude [µm]\n1;2\n".encode("cp437"), 1, "unit of a length"),
    "bytes of no encoding": (b"order;amplitude [um\x81]\n1;2\n", 1, "Windows-1252"),
    "comma that may separate thousands": ("order;um\n1;2,500\n2;1,250\n", 2, "may be a decimal comma"),
    "decimal comma beside a point": ("order;um\n1;2.5\n2;1,25\n", 3, "decimal point"),
    "thousands and decimals": ("order;um\n1;1,234.5\n", 2, "finite numbers"),
    "thousands and decimals in German": ("order;um\n1;1.234,5\n", 2, "finite numbers"),
    "spaces between thousands": ("order;um\n1;1 234\n", 2, "finite numbers"),
    "falling abscissa": (HEADER + "2,1\n1,2\n", 3, "greater order"),
    "repeated abscissa": (HEADER + "1,1\n1,2\n", 3, "repeat the order of line 2"),
    "null characters": (b"order,um\n1,\x00\n", None, "text file"),
    "UTF-16 without mark": ("order,um\n1,2\n".encode("utf-16-le"), None, "text file"),
    "broken UTF-16": (b"\xff\xfeo", 1, "UTF-16"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_in_one_way_only_is_refused_with_its_line(read, case, tmp_path):
    text, line, words = REFUSED[case]
    with pytest.raises(InputError) as raised:
        read(text, TWO, increasing=True)
    assert words in str(raised.value)
    assert raised.value.field == ("orders" if line is None else f"{tmp_path / 'table.csv'}, line {line},")


def test_a_comma_is_decimal_if_another_number_of_the_file_shows_it(read):
    assert read("order;um\n1;2,500\n2;0,250\n", TWO).columns["amplitude"] == pytest.approx([2.5e-6, 0.25e-6])
    assert read("order;um\n1;2,500\n2;1234,5\n", TWO).columns["amplitude"] == pytest.approx([2.5e-6, 1234.5e-6])


@pytest.mark.parametrize("unit", ["%", "1", "°C", "Grad", "grad", "furlong"])
def test_units_that_are_none_of_an_angle_are_refused(read, unit):
    """Pint takes Grad for a gigaradian, where German programs mean degrees."""
    with pytest.raises(InputError, match="line 1, must have the unit of an angle for phase") as error:
        read(f"order,um,phase [{unit}]\n1,2,3\n")
    assert ("deg or gon" in str(error.value)) == (unit.lower() == "grad")


def test_exactly_one_column_of_a_group_is_needed(read):
    length, width = (Column(name, {units.LENGTH: 1.0}, words=name) for name in ("length", "width"))
    for text, groups, words in (
            ("order,mm\n1,1\n", ((ORDER,), (length, width)), "exactly one column for length or width"),
            ("order,mm\n1,1\n", ((length,), (width,)), "must say whether this is length or width; got 'mm'"),
            ("x,N/um\n1,1\n", CURVE, r"must have the column roll angle \[deg\] or fraction"),
            ("roll angle [deg],fraction,N/um\n1,2,3\n", CURVE,
             r"exactly one column for roll angle or fraction.* columns = \{ roll_angle =")):
        with pytest.raises(InputError, match=words):
            read(text, groups)


BOTH = "angle [deg];angle of wheel 2 [deg];k;stiffness [N/mm]\n0;0;3;4\n1;2;5;6\n"


@pytest.mark.parametrize(("chosen", "angle", "stiffness", "note"), [
    ({"roll_angle": "angle of wheel 2 [deg]", "stiffness": "stiffness"}, 2, 6e3,
     "roll angle is 'angle of wheel 2 [deg]', stiffness is 'stiffness [N/mm]'; not used: 'angle [deg]', 'k'"),
    ({"roll_angle": "ANGLE", "stiffness": "k [N/um]"}, 1, 5e6, "stiffness is 'k' in N/um"),
    ({"roll angle": "Angle [rad]"}, 180 / np.pi, 6e3, "roll angle is 'angle [deg]' in rad"),
])
def test_columns_that_are_chosen_are_taken_and_said(read, chosen, angle, stiffness, note):
    table = read(BOTH, CURVE, chosen=chosen)
    assert np.degrees(table.columns["roll angle"][1]) == pytest.approx(angle, rel=1e-15)
    assert table.columns["stiffness"][1] == pytest.approx(stiffness, rel=1e-15)
    assert note in table.notes[0] and table.notes[0].startswith("columns of table.csv: ")


@pytest.mark.parametrize(("chosen", "words"), [
    ({"roll_angle": "phi"}, "line 1, must have the column that is chosen as roll_angle once; got 'phi'. It has 'angle"),
    ({"angel": "phi"}, "columns must be one of"), ({"stiffness": "k"}, "line 1, must say the unit of stiffness"),
    ({"roll_angle": "angle", "fraction": "k"}, "line 1, must have one column among roll angle, fraction"),
    ({"stiffness": "angle"}, "line 1, must say whether this is roll angle or stiffness"),
])
def test_choices_that_are_wrong_are_refused(read, chosen, words):
    with pytest.raises(InputError) as error:
        read(BOTH, CURVE, chosen={"roll_angle": "angle", **chosen})
    assert words in str(error.value)


def test_what_was_taken_by_its_meaning_is_said(read):
    assert read(SAME["commas"]).notes == read(SAME["units alone"]).notes == ()
    assert read(SAME["words"]).notes == (
        "columns of table.csv: order is 'order', amplitude is 'amplitude of error [um]', phase is 'phase at entry "
        "[deg]'",)
    many = "".join(f",x{i}" for i in range(9))
    (note,) = read(f"order,amplitude [um]{many}\n1,2{',0' * 9}\n", TWO).notes
    assert note.endswith("not used: 'x0', 'x1', 'x2', 'x3', 'x4', …")


def test_a_jump_is_two_rows_with_the_same_abscissa_but_not_the_same_value(read):
    header = "roll angle [deg],stiffness [N/um]\n0,400\n"
    table = read(header + "1,300\n1,200\n2,100\n", CURVE, increasing=True, jumps=True)
    assert table.columns["stiffness"] == pytest.approx([4e8, 3e8, 2e8, 1e8], rel=1e-15)
    for rows in ("1,300\n1,300\n", "1,300\n1,200\n1,100\n"):
        with pytest.raises(InputError, match=r"must not repeat the roll angle of line .; got '1 deg'"):
            read(header + rows, CURVE, increasing=True, jumps=True)


def test_files_that_are_no_tables_are_refused(tmp_path, read):
    os.mkfifo(tmp_path / "pipe")
    none = (tmp_path, tmp_path / "missing", tmp_path / "pipe", "null\0character", "/dev/zero")
    for paths, words in ((none, "a file that can be read"), ((3, None, b"bytes"), "the path of a file")):
        for path in paths:
            with pytest.raises(InputError, match=f"orders must be {words}"):
                read_table(path, GROUPS, field="orders")
    with pytest.raises(InputError, match="more than 4,000,000 bytes"):
        read(HEADER + "1,2\n" * (MOST_BYTES // 4))
