"""Quality columns under diverse names and codes, wide and long."""

from proofs.dialects.common import case, comma, loop, num, sheet, stamp, three
from proofs.dialects.generic_time import NAMES
from proofs.dialects.historians import long

KEYS = ("pv", "sp", "op")


def columns(name, label, good, bad, why, after=True, sep=",", head="Time", last=False, zero=False):
    """Wide with a quality column per tag; label(tag) names it; last: all quality columns at the end."""

    @case("quality", why=why, name=name)
    def make():
        lp = loop(name, 120, 5, bad=5)
        heads, quals = [], []
        for n in NAMES:
            if last:
                heads.append(n)
                quals.append(label(n))
            else:
                heads += [n, label(n)] if after else [label(n), n]
        rows = []
        for i in lp.rows():
            row, tail = [stamp(lp.t[i])], []
            for k in KEYS:
                is_bad = k == "pv" and i in lp.bad
                x = getattr(lp, k)[i]
                v = num(0.0 if zero and is_bad else x) if sep == "," else comma(0.0 if zero and is_bad else x)
                q = bad if is_bad else good
                if last:
                    row.append(v)
                    tail.append(q)
                else:
                    row += [v, q] if after else [q, v]
            rows.append(row + tail)
        return {"e.csv": sheet([head, *heads, *quals], rows, sep)}, three(lp, NAMES)


columns("q_dot_status", lambda n: f"{n}.Status", "Good", "Bad", "FIC101.PV.Status, words")
columns(
    "q_underscore_q", lambda n: f"{n}_Q", 192, 0, "FIC101.PV_Q, OPC DA codes, bad written as 0.00", zero=True
)
columns("q_blank_quality", lambda n: f"{n} Quality", "G", "B", "'FIC101.PV Quality', letters")
columns("q_qual_prefix", lambda n: f"Qual {n}", 192, 24, "'Qual FIC101.PV' before the value", after=False)
columns(
    "q_opc_ua_zero_good",
    lambda n: f"{n}.StatusCode",
    0,
    2147483648,
    "OPC UA: 0 good, 0x80000000 bad",
    zero=True,
)
columns("q_opc_ua_hex", lambda n: f"{n}_StatusCode", "0x00000000", "0x80050000", "OPC UA codes in hex")
columns("q_at_the_end", lambda n: f"Q({n})", "GOOD", "BAD", "all quality columns after all values", last=True)
columns(
    "q_german_status",
    lambda n: f"{n} Güte",
    "gut",
    "schlecht",
    "German words, decimal comma",
    sep=";",
    head="Zeit",
)
columns("q_is_bad", lambda n: f"{n}.is_bad", "False", "True", "is_bad true/false: inverted sense")
columns("q_valid_flag", lambda n: f"{n}_valid", 1, 0, "valid 1/0", zero=True)
columns("q_error_flag", lambda n: f"{n}_error", 0, 1, "error 0/1: inverted sense", zero=True)


@case("quality", why="one quality column for the whole row: all tags of a bad row are bad")
def q_one_for_row():
    lp = loop("q1", 120, 5, bad=5)
    rows = [
        [stamp(lp.t[i]), num(lp.pv[i]), num(lp.sp[i]), num(lp.op[i]), "Bad" if i in lp.bad else "Good"]
        for i in lp.rows()
    ]
    return {"e.csv": sheet(["Time", *NAMES, "Quality"], rows)}, three(lp, NAMES, KEYS)


@case("quality", why="one OPC code for the row, in front of the values")
def q_one_for_row_in_front():
    lp = loop("q2", 120, 5, bad=5)
    rows = [
        [stamp(lp.t[i]), 8 if i in lp.bad else 192, num(lp.pv[i]), num(lp.sp[i]), num(lp.op[i])]
        for i in lp.rows()
    ]
    return {"e.csv": sheet(["Timestamp", "OPC Quality", *NAMES], rows)}, three(lp, NAMES, KEYS)


def stacked(name, header, good, bad, why, doubt=None):
    @case("quality", why=why, name=name)
    def make():
        lp = loop(name, 120, 5, bad=6)
        unsure = lp.bad[::3] if doubt is not None else []
        rows = long(
            lp,
            NAMES,
            lambda n, i, v, b: [stamp(lp.t[i]), n, num(v), (doubt if i in unsure else bad) if b else good],
            by_tag=False,
        )
        extra = {"uncertain": {NAMES[0]: unsure}} if unsure else {}
        return {"e.csv": sheet(["Time", "Tag", "Value", header], rows)}, three(lp, NAMES), extra


stacked(
    "q_long_words_uncertain",
    "Quality",
    "Good",
    "Bad",
    "Good/Bad/Uncertain; uncertain is not good",
    "Uncertain",
)
stacked("q_long_opc_uncertain", "Quality", 192, 28, "192, 28, 68 (uncertain: last usable value)", 68)
stacked("q_long_opc_good_kinds", "Quality", 216, 0, "216 = good, local override")
stacked(
    "q_long_ua_words", "StatusCode", "Good", "BadSensorFailure", "OPC UA names", "UncertainLastUsableValue"
)
stacked("q_long_letters", "Q", "G", "B", "letters G/B in a column Q")
stacked("q_long_bad_flag", "Bad", "false", "true", "column Bad true/false: inverted sense")


@case("quality", why="OPC HDA: 0x00040000 raw + 192; 0x00020000 + 192 = interpolated, still good")
def q_hda_upper_bits():
    lp = loop("q3", 120, 5, bad=5)
    rows = long(
        lp,
        NAMES,
        lambda n, i, v, b: [
            stamp(lp.t[i]),
            n,
            num(v),
            0x00100000 if b else (0x000200C0 if i % 10 == 9 else 0x000400C0),
        ],
        by_tag=False,
    )
    return {"e.csv": sheet(["Timestamp", "ItemID", "Value", "Quality"], rows)}, three(lp, NAMES)


@case("quality", why="letter after the number in the same cell: 48.21 B is bad; good cells carry no letter")
def q_letter_in_cell():
    lp = loop("q4", 120, 5, bad=5)
    rows = [
        [stamp(lp.t[i]), num(lp.pv[i]) + (" B" if i in lp.bad else ""), num(lp.sp[i]), num(lp.op[i])]
        for i in lp.rows()
    ]
    return {"e.csv": sheet(["Time", *NAMES], rows)}, three(lp, NAMES)


@case("quality", why="invalid written as -9999 beside status BAD")
def q_sentinel_with_status():
    lp = loop("q5", 120, 5, bad=5)
    rows = long(
        lp,
        NAMES,
        lambda n, i, v, b: [n, stamp(lp.t[i]), "-9999" if b else num(v), "BAD" if b else "OK"],
    )
    return {"e.csv": sheet(["Tagname", "Timestamp", "Value", "Status"], rows)}, three(lp, NAMES)


columns("q_one_zero", lambda n: f"{n} Quality", 1, 0, "1 good and 0 bad, under a plain name")
columns(
    "q_annotated", lambda n: f"{n}.Status", "Annotated; Good", "Bad; Annotated", "words that semicolons part"
)
