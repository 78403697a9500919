"""loops.csv, tags by their endings, controllers in stated units."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analyzer.history.export import open_export
from analyzer.loops.tags import (
    LoopSpec,
    as_stated,
    controller,
    derivative_as_stated,
    find_loops,
    match,
    read_loops,
)
from identification.errors import InputError
from identification.models import Form

SHARED = Path(__file__).parents[3].parent / "shared"


def written(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    path = folder / "loops.csv"
    path.write_bytes(text.encode(encoding))
    return path


def only(folder: Path, text: str) -> LoopSpec:
    (spec,) = read_loops(written(folder, text))
    return spec


def test_only_the_loop_is_required(tmp_path: Path) -> None:
    """A file with loop names only is enough, and the defaults that it uses are listed."""
    spec = only(tmp_path, "loop\nFIC101\n")
    assert (spec.loop, spec.form, spec.gain_unit, spec.ti_unit) == ("FIC101", Form.IDEAL, "percent", "s")
    assert (spec.op_lo, spec.op_hi, spec.kp) == (0, 100, None)
    assert {"form ideal", "gain in percent", "ti in s", "PV range as recorded"} <= set(spec.defaults)


def test_every_column_is_read(tmp_path: Path) -> None:
    """Each column of the contract is read, and additional columns of the plant are kept."""
    spec = only(
        tmp_path,
        "loop,description,type,area,master,ratio_of,sp,pv,op,mode,position,pv_lo,pv_hi,op_lo,op_hi,pv_unit,kp,ti,td,form,gain_unit,"
        "ti_unit,scan_s,importance,shift\n"
        "F1,feed,flow,mill,T1,F2,a.SP,a.PV,a.OP,a.M,a.Z,-5,15,4,20,l/s,2.5,0.4,0.1,series,band,min,0.5,3,B\n",
    )
    assert spec.tags == ("a.SP", "a.PV", "a.OP", "a.M", "a.Z")
    assert (spec.description, spec.type, spec.area, spec.pv_unit) == ("feed", "flow", "mill", "l/s")
    assert (spec.master, spec.ratio_of) == ("T1", "F2")
    assert (spec.pv_lo, spec.pv_hi, spec.op_lo, spec.op_hi) == (-5, 15, 4, 20)
    assert (spec.kp, spec.ti, spec.td, spec.scan_s, spec.importance) == (2.5, 0.4, 0.1, 0.5, 3)
    assert (spec.form, spec.gain_unit, spec.ti_unit) == (Form.SERIES, "band", "min")
    assert spec.extra == {"shift": "B"}
    assert spec.defaults == ()


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_a_table_from_a_european_spreadsheet(tmp_path: Path, encoding: str) -> None:
    """Semicolons, decimal commas, several encodings, capitals in the header and empty rows are read correctly."""
    text = "Loop;Description;KP;Ti\r\n\r\nTIC1;Kühler;1,5;20\r\n;;;\r\n"
    (spec,) = read_loops(written(tmp_path, text, encoding))
    assert (spec.loop, spec.description, spec.kp, spec.ti) == ("TIC1", "Kühler", 1.5, 20)


@pytest.mark.parametrize(
    ("text", "fragments"),
    [
        ("", ["empty file", "'loop'"]),
        ("loop,kp\n", ["no loops"]),
        ("name,kp\nF1,2\n", ["no column 'loop'", "name, kp"]),
        ("loop,tpye\nF1,flow\n", ["'tpye'", "did you mean 'type'?"]),
        ("loop,pv_low\nF1,0\n", ["'pv_low'", "did you mean 'pv_lo'?"]),
        ("loop,kp\nF1,1\nF2,1\nF1,2\n", ["loop F1 in rows 2, 4"]),
        ("loop,kp\nF1,1\nF2,big\n", ["row 3", "column 'kp'", "'big'", "a number"]),
        ("loop,kp\nF1,nan\n", ["row 2", "'nan'"]),
        ("loop,ti\nF1,-3\n", ["row 2", "column 'ti'", "not below 0"]),
        ("loop,form\nF1,standard\n", ["column 'form'", "'standard'", "ideal, series, parallel"]),
        ("loop,gain_unit\nF1,%\n", ["column 'gain_unit'", "percent, engineering, band"]),
        ("loop,ti_unit\nF1,hours\n", ["column 'ti_unit'", "s, min, repeats/min"]),
        ("loop,pv_lo,pv_hi\nF1,100,0\n", ["row 2", "pv_lo 100.0 and pv_hi 0.0", "pv_hi above pv_lo"]),
        ("loop,pv_lo,pv_hi\nF1,0,\n", ["row 2", "both or neither"]),
        ("loop,kp,kp\nF1,1,2\n", ["'kp' occurs twice"]),
        ("loop,kp\n,1\n", ["row 2", "no loop name"]),
    ],
)
def test_errors_of_loops_csv_are_reported(tmp_path: Path, text: str, fragments: list[str]) -> None:
    """Each error in a loops.csv is reported with its place and its remedy."""
    with pytest.raises(InputError) as error:
        read_loops(written(tmp_path, text))
    assert str(tmp_path / "loops.csv") in str(error.value)
    for fragment in fragments:
        assert fragment in str(error.value)


def test_missing_file(tmp_path: Path) -> None:
    """A loops.csv that does not exist is an input error without a traceback."""
    with pytest.raises(InputError, match="cannot be opened"):
        read_loops(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("tags", "expected"),
    [
        (
            ["F1.SP", "F1.PV", "F1.OP", "F1.MODE", "F1.POS"],
            ("F1", "F1.SP", "F1.PV", "F1.OP", "F1.MODE", "F1.POS"),
        ),
        (["F1_PV", "F1_OP"], ("F1", None, "F1_PV", "F1_OP", None, None)),
        (["f1.pv"], ("f1", None, "f1.pv", None, None, None)),
        (["F1.SV", "F1.PV", "F1.MV", "F1.MODE"], ("F1", "F1.SV", "F1.PV", "F1.MV", "F1.MODE", None)),
        (["F1.MEAS", "F1.SPT", "F1.OUT", "F1.MA"], ("F1", "F1.SPT", "F1.MEAS", "F1.OUT", "F1.MA", None)),
        (["F1.SP", "F1.PV", "F1.CV"], ("F1", "F1.SP", "F1.PV", "F1.CV", None, None)),
        (
            ["F1/PID1/PV.CV", "F1/PID1/SP.CV", "F1/PID1/OUT.CV", "F1/PID1/MODE.ACTUAL"],
            ("F1", "F1/PID1/SP.CV", "F1/PID1/PV.CV", "F1/PID1/OUT.CV", "F1/PID1/MODE.ACTUAL", None),
        ),
        (["320P:me", "320P:spa", "320P:con"], ("320P", "320P:spa", "320P:me", "320P:con", None, None)),
    ],
)
def test_loops_by_their_endings(tags: list[str], expected: tuple[str | None, ...]) -> None:
    """The tag endings of each control system give the signals of the loop; CV and MV have the meaning of that
    system.
    """
    (spec,) = find_loops(tags)
    assert (spec.loop, spec.sp, spec.pv, spec.op, spec.mode, spec.position) == expected


def test_two_blocks_of_a_module_are_two_loops() -> None:
    """Two function blocks of one module keep their full names, because the name of the module would be that of
    both.
    """
    specs = find_loops(["F1/PID1/PV.CV", "F1/PID2/PV.CV"])
    assert [spec.loop for spec in specs] == ["F1/PID1", "F1/PID2"]


def test_no_pv_no_loop() -> None:
    """Tags without a PV, and tags without a known ending, form no loop."""
    assert find_loops(["F1.OP", "F1.SP", "TI77", "F2.PV.quality"]) == ()


def test_match_fills_defaults_and_reports_what_is_missing() -> None:
    """Rows without tags get LOOP.SP and so on, or the endings of the control system; missing tags are reported and
    kept.
    """
    specs = (LoopSpec("F1"), LoopSpec("Y1"), LoopSpec("GONE"), LoopSpec("N1", pv="N1.X", op="N1.Y"))
    tags = ["F1.PV", "F1.OP", "Y1.PV", "Y1.MV", "N1.X", "NEW.PV"]
    matched, notes = match(specs, tags)
    assert [spec.loop for spec in matched] == ["F1", "Y1", "GONE", "N1"]
    assert (matched[0].pv, matched[0].op, matched[0].sp) == ("F1.PV", "F1.OP", None)
    assert matched[1].op == "Y1.MV"
    assert (matched[2].pv, matched[2].wanted_pv) == (None, "GONE.PV")
    assert (matched[3].pv, matched[3].op) == ("N1.X", None)
    assert notes == (
        "GONE: not assessed, no PV tag GONE.PV in the export",
        "N1: OP tag N1.Y is not in the export",
        "1 loops of the export are not in loops.csv, not assessed: NEW",
    )


@pytest.mark.parametrize(
    ("spec", "kp", "ti_s", "td_s"),
    [
        (LoopSpec("a", kp=2, ti=30), 2, 30, 0),
        (LoopSpec("a", kp=50, ti=0.5, gain_unit="band", ti_unit="min"), 2, 30, 0),
        (LoopSpec("a", kp=4, ti=2, gain_unit="engineering", ti_unit="repeats/min"), 8, 30, 0),
        (LoopSpec("a", kp=2, ti=30, td=10, form=Form.SERIES), 2 * (1 + 10 / 30), 40, 7.5),
        (LoopSpec("a", kp=-2, ti=15, td=8, form=Form.PARALLEL), -2, 30, 4),
        (LoopSpec("a", kp=2, ti=0), 2, math.inf, 0),
    ],
)
def test_controllers_in_the_units_of_the_project(spec: LoopSpec, kp: float, ti_s: float, td_s: float) -> None:
    """Bands, engineering gains, minutes, repeats and all forms are converted to percent, seconds and the ideal
    form.
    """
    pid = controller(spec, pv_span=200)
    assert pid is not None
    assert (pid.kp, pid.ti_s, pid.td_s) == pytest.approx((kp, ti_s, td_s))


SPECS = st.builds(
    LoopSpec,
    loop=st.just("a"),
    kp=st.one_of(st.floats(0.01, 500), st.floats(-500, -0.01)),
    ti=st.floats(0.01, 1e4),
    td=st.none(),
    form=st.sampled_from(Form),
    gain_unit=st.sampled_from(["percent", "engineering", "band"]),
    ti_unit=st.sampled_from(["s", "min", "repeats/min"]),
    op_lo=st.sampled_from([0.0, 4.0]),
    op_hi=st.sampled_from([20.0, 100.0]),
)


@given(SPECS, st.floats(0.1, 1e4), st.floats(0, 1))
def test_stated_settings_are_unchanged_by_conversion_and_back(
    spec: LoopSpec, pv_span: float, share: float
) -> None:
    """Stated settings that are converted to percent and seconds and back are unchanged, in any form and unit."""
    ti_s = {"s": spec.ti, "min": spec.ti, "repeats/min": 1 / spec.ti if spec.ti else 0}[spec.ti_unit]
    spec = replace(spec, td=None if ti_s is None else 0.99 * share * ti_s)
    pid = controller(spec, pv_span)
    assert pid is not None
    assert as_stated(pid, spec, pv_span) == pytest.approx((spec.kp, spec.ti), rel=1e-6)
    assert derivative_as_stated(pid, spec, pv_span) == pytest.approx(spec.td or 0.0, rel=1e-5, abs=1e-9)


def test_no_settings_no_controller() -> None:
    """Without gain or integral time there is no controller; an engineering gain needs a range."""
    assert controller(LoopSpec("a", kp=1), 100) is None
    assert controller(LoopSpec("a", ti=1), 100) is None
    with pytest.raises(InputError, match="a: gain in engineering units and no PV range"):
        controller(LoopSpec("a", kp=1, ti=1, gain_unit="engineering"), None)


@pytest.mark.skipif(not SHARED.exists(), reason="the plants' files lie outside the repository")
@pytest.mark.parametrize("name", ["plants/a", "concealed", "recordings/isdb", "recordings/refinery"])
def test_real_loops_csv(name: str) -> None:
    """Each available loops.csv is read and has as many loops as rows."""
    path = SHARED / name / "loops.csv"
    assert len(read_loops(path)) == len(path.read_text().split()) - 1


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        *(("kp", cell) for cell in ("inf", "1e400", "nan", "1e-300", "1e9")),
        *(("ti", cell) for cell in ("-1", "1e-300", "1e300")),
        *(("scan_s", cell) for cell in ("1e-300", "inf", "-1")),
        *(("importance", cell) for cell in ("inf", "-5")),
        *(("td", cell) for cell in ("inf", "1e-320")),
    ],
)
def test_extreme_numbers_are_refused(tmp_path, column, cell):
    """Infinite, vanishing and extreme settings are errors: one line names row and column."""
    stated = {"kp": "1", "ti": "10", "td": "0", "scan_s": "1", "importance": "1", column: cell}
    text = f"loop,{','.join(stated)}\nFIC1,{','.join(stated.values())}\n"
    with pytest.raises(InputError, match=f"row 2, column '{column}'"):
        read_loops(written(tmp_path, text))


@pytest.mark.parametrize(
    ("low", "high"), [("0", "inf"), ("0", "1e-320"), ("5", "5"), ("100", "0"), ("1e15", "2e15")]
)
def test_impossible_ranges_are_refused(tmp_path, low, high):
    """A range without a representable positive width is refused."""
    with pytest.raises(InputError, match="row 2"):
        read_loops(written(tmp_path, f"loop,op_lo,op_hi\nFIC1,{low},{high}\n"))


def test_a_zero_without_meaning_is_an_empty_cell(tmp_path):
    """Gains and scan times of 0, as some control systems export them, are empty cells. A gain of 0 with an integral
    time means integral action alone.
    """
    (loop,) = read_loops(written(tmp_path, "loop,kp,ti,scan_s\nFIC1,0,0,0\n"))
    assert (loop.kp, loop.ti, loop.scan_s) == (None, 0.0, None)
    assert not loop.stated & {"kp", "scan_s"}


@pytest.mark.parametrize(
    ("sp", "pv", "op"),
    [
        *(("SPT", "PV", "OP"), ("SETP", "PV", "CV"), ("SPT", "PV", "MV"), ("SPT", "MEAS", "CO")),
        *(("Sollwert", "Istwert", "Stellgröße"), ("SP", "IST", "OP"), ("SP", "PV", "Stellwert")),
    ],
)
@pytest.mark.parametrize("mark", "._")
def test_endings_of_several_vendors(sp, pv, op, mark):
    """A set point and an output are found by the names of any vendor, even if PV has the name of another vendor."""
    tags = {role: f"FIC1{mark}{ending}" for role, ending in (("sp", sp), ("pv", pv), ("op", op))}
    (loop,) = find_loops(tags.values())
    assert (loop.loop, loop.sp, loop.pv, loop.op) == ("FIC1", tags["sp"], tags["pv"], tags["op"])


def test_words_after_a_blank():
    """A complete word may follow a blank; two letters after a blank may be part of a name."""
    (loop,) = find_loops(["FIC1 Istwert", "FIC1 Sollwert", "column PV", "column SP"])
    assert (loop.loop, loop.sp, loop.pv) == ("FIC1", "FIC1 Sollwert", "FIC1 Istwert")


def test_no_tag_has_two_roles():
    """An MV next to PV and OP is no second output, and no tag is both set point and output."""
    (loop,) = find_loops(["A.PV", "A.OP", "A.MV"])
    assert (loop.pv, loop.op, loop.sp) == ("A.PV", "A.OP", None)


@pytest.mark.parametrize("names", [("Sollwert", "Istwert", "Stellgröße"), ("SETP", "PV", "CV")])
def test_bare_columns_belong_to_the_file_s_loop(tmp_path, names):
    """Columns that are named only by role belong to the loop with the name of the file."""
    rows = "".join(f"2026-03-02 00:00:{k:02d};50;{k};{k}\n" for k in range(60))
    (tmp_path / "FIC1.csv").write_text(f"Zeit;{';'.join(names)}\n{rows}", encoding="utf-8")
    (loop,) = find_loops(open_export([tmp_path / "FIC1.csv"]).tags)
    assert (loop.loop, loop.op is not None, loop.sp is not None) == ("FIC1", True, True)


def test_a_table_without_a_header_is_read_in_the_order_of_loops_csv() -> None:
    """Columns without names are the tags of loops.csv in its order if the numbers are equal; otherwise none is
    assigned.
    """
    stated = (LoopSpec("A", sp="A.S", pv="A.P", op="A.O"), LoopSpec("B"))
    columns = [f"column {i}" for i in range(2, 8)]
    (a, b), notes = match(stated, columns)
    assert (a.sp, a.pv, a.op) == ("column 2", "column 3", "column 4")
    assert (b.sp, b.pv, b.op) == ("column 5", "column 6", "column 7")
    assert "in the order of loops.csv" in notes[0]
    assert match(stated, columns[:-1])[0][0].pv is None
    assert match(stated, ["A.S", "A.P", "A.O"])[0][0].pv == "A.P"


VENDORS = (
    ("FIC101", "FIC101.SPEU", "FIC101.PVEU", "FIC101.CVEU"),
    ("TIC1", "TIC1:WSP", "TIC1:PV", "TIC1:OP"),
    ("mixer", "mixer.SET_POINT", "mixer.ACTUAL", "mixer.Y"),
    ("FIC101", "SP FIC101 (m3/h)", "PV FIC101 (m3/h)", "OP FIC101 (%)"),
    ("temperature", "target", "temperature", "power"),
    ("Mesure", "Consigne", "Mesure", "Commande"),
    ("TIC5", "Consigne TIC5", "Mesure TIC5", "Commande TIC5"),
    ("U1", "U1/PID1/SP.CV", "U1/PID1/PV.CV", "U1/PID1/OUT.CV"),
    ("x", "climate.x_temperature", "climate.x_current_temperature", "climate.x_heating_power"),
    ("boiler", "sensor.boiler_setpoint", "sensor.boiler_process_value", "sensor.boiler_output"),
    ("a1/fic7", "a1/fic7/sp", "a1/fic7/pv", "a1/fic7/cv"),
    ("AS1/FIC1", "AS1/FIC1.SP#Value", "AS1/FIC1.PV_Out#Value", "AS1/FIC1.MV#Value"),
    ("FIC1", "FIC1 SP", "FIC1 PV", "FIC1 OP"),
    ("F1", "F1_SP.F_CV", "F1_PV.F_CV", "F1_OUT.F_CV"),
    ("R1", "R1.W", "R1.X", "R1.Y"),
    ("TIC 5", "TIC 5 - Börvärde", "TIC 5 - Ärvärde", "TIC 5 - Utsignal"),
)


@pytest.mark.parametrize("own", VENDORS, ids=lambda own: own[2])
def test_loops_by_the_names_of_many_vendors(own: tuple[str, str, str, str]) -> None:
    """Roles are found after or before the loop name, in many languages, with units, blocks and domains around
    them.
    """
    (loop,) = find_loops(["Y99", *own[1:], "flow rate 7"])
    assert (loop.loop.rstrip(" -"), loop.sp, loop.pv, loop.op) == own


def test_a_column_that_numbers_the_rows_is_no_tag(tmp_path: Path) -> None:
    """An id column that decreases by one in each row is left out; a value under another name that does the same is
    kept.
    """
    rows = "".join(f"{900 - k},2026-03-02 00:00:{k:02d},{k},{k}\n" for k in range(60))
    (tmp_path / "x.csv").write_text("id,time,FT_1,FV_1\n" + rows)
    assert open_export([tmp_path / "x.csv"]).tags == ("FT_1", "FV_1")


def test_isa_letters_pair_measurement_and_valve() -> None:
    """FT_211 and FV_211 form a loop; LT_211 and an index form none."""
    (loop,) = find_loops(["id", "FT_211", "FV_211", "LT_211", "TV_7"])
    assert (loop.loop, loop.pv, loop.op) == ("FIC211", "FT_211", "FV_211")


@pytest.mark.parametrize(
    "tags", [["TK1 Level", "TK2 Level"], ["R1.Temperature", "R1.Pressure"], ["X", "Y", "Z"]]
)
def test_a_word_alone_makes_no_loop(tags: list[str]) -> None:
    """A measurement with the name of its quantity forms no loop."""
    assert find_loops(tags) == ()
