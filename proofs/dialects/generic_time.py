"""Stamps: numbers, words, zones, offsets, and stamps that cannot be determined."""

from proofs.dialects.common import at, case, comma, loop, num, sheet, stamp, text, three

NAMES = ["FIC101.PV", "FIC101.SP", "FIC101.OP"]
DOT = "%d.%m.%Y %H:%M:%S"


def table(lp, show, head="Time", sep=",", val=num, names=NAMES, **kw):
    """Wide table with a function for the stamp."""
    rows = [[show(lp.t[i]), val(lp.pv[i]), val(lp.sp[i]), val(lp.op[i])] for i in lp.rows()]
    return sheet([head, *names], rows, sep, **kw)


def numbers(name, show, why, head="Time", dt=5, shift=0.0):
    @case("time-number", why=why, name=name)
    def make():
        lp = loop(name, 120, dt)
        lp.t = lp.t + shift
        return {"export.csv": table(lp, show, head)}, three(lp, NAMES)


numbers("epoch_seconds", lambda t: f"{t:.0f}", "epoch seconds", "timestamp")
numbers("epoch_seconds_fraction", lambda t: f"{t:.3f}", "epoch seconds with fraction", "time", 1, 0.25)
numbers("epoch_milliseconds", lambda t: f"{t * 1e3:.0f}", "epoch milliseconds", "ts", 1, 0.125)
numbers("epoch_microseconds", lambda t: f"{t * 1e6:.0f}", "epoch microseconds", "ts_us", 1, 0.125)
numbers("epoch_nanoseconds", lambda t: str(round(t * 1e6) * 1000), "epoch nanoseconds", "time", 2, 0.5)
numbers("filetime", lambda t: str((round(t * 1000) + 11644473600000) * 10**4), "Windows FILETIME", "FileTime")
numbers("dotnet_ticks", lambda t: str((round(t * 1000) + 62135596800000) * 10**4), ".NET ticks", "Ticks")
numbers("matlab_datenum", lambda t: f"{t / 86400 + 719529:.10f}", "MATLAB datenum", "datenum")
numbers("excel_serial_wide", lambda t: f"{t / 86400 + 25569:.9f}", "Excel serials, one column", "Zeit", 10)


def words(name, months, fmt, why, start, head="Time", val=comma, sep=";", enc="utf-8"):
    @case("time-words", why=why, name=name)
    def make():
        lp = loop(name, 120, 5, start)
        body = table(lp, lambda t: stamp(t, fmt, months=months.split()), head, sep, val, enc=enc)
        return {"export.csv": body}, three(lp, NAMES)


DE = "Jan Feb Mrz Apr Mai Jun Jul Aug Sep Okt Nov Dez"
FR = "janv. févr. mars avr. mai juin juil. août sept. oct. nov. déc."
ES = "ene feb mar abr may jun jul ago sep oct nov dic"
IT = "gen feb mar apr mag giu lug ago set ott nov dic"
FI = "tammi helmi maalis huhti touko kesä heinä elo syys loka marras joulu"
SV = "jan feb mar apr maj jun jul aug sep okt nov dec"
PL = "sty lut mar kwi maj cze lip sie wrz paź lis gru"
CS = "led úno bře dub kvě čer čvc srp zář říj lis pro"
PT = "jan fev mar abr mai jun jul ago set out nov dez"
NL = "jan feb mrt apr mei jun jul aug sep okt nov dec"
words("months_german", DE, "%d. %b %Y %H:%M:%S", "Okt/Dez", "2024-12-09 08:00:00", "Zeit")
words(
    "months_french",
    FR,
    "%d %b %Y %H:%M:%S",
    "août, cp1252",
    "2024-08-08 08:00:00",
    "Horodatage",
    enc="cp1252",
)
words("months_spanish", ES, "%d-%b-%y %H:%M:%S", "dic", "2024-12-19 08:00:00", "Fecha")
words("months_italian", IT, "%d-%b-%Y %H.%M.%S", "gen, dots in time", "2025-01-09 08:00:00", "Data/ora")
words("months_finnish", FI, "%d %b %Y %H.%M.%S", "joulu, dots in time", "2024-12-05 08:00:00", "Aika")
words("months_swedish", SV, "%d %b %Y %H:%M:%S", "maj", "2024-05-05 08:00:00", "Tid")
words("months_polish", PL, "%d %b %Y %H:%M:%S", "paź", "2024-10-07 08:00:00", "Czas")
words("months_czech", CS, "%d. %b %Y %H:%M:%S", "říj", "2024-10-07 08:00:00", "Čas")
words("months_portuguese", PT, "%d/%b/%Y %H:%M:%S", "out", "2024-10-07 08:00:00", "Data")
words("months_dutch", NL, "%d-%b-%Y %H:%M:%S", "mrt", "2025-03-07 08:00:00", "Tijd")


@case("time-zone", why="(UTC+01:00) in every cell")
def zone_bracket_cell():
    lp = loop("z1", 120, 5)
    return {"e.csv": table(lp, lambda t: stamp(t + 3600) + " (UTC+01:00)")}, three(lp, NAMES)


@case("time-zone", why="(UTC+01:00) in the header only")
def zone_bracket_header():
    lp = loop("z2", 120, 5)
    return {"e.csv": table(lp, lambda t: stamp(t + 3600), "Time (UTC+01:00)")}, three(lp, NAMES)


@case("time-zone", why="UTC named in the header")
def zone_utc_header():
    lp = loop("z3", 120, 5)
    return {"e.csv": table(lp, stamp, "Timestamp [UTC]")}, three(lp, NAMES)


@case("time-zone", why="offset per row changes at the end of summer time (+02:00, +01:00)")
def zone_offsets_per_row():
    lp = loop("z4", 180, 10, "2024-10-27 00:45:00")

    def show(t):
        return stamp(t, "%Y-%m-%dT%H:%M:%S", "Europe/Berlin") + (
            "+02:00" if t < at("2024-10-27 01:00:00") else "+01:00"
        )

    return {"e.csv": table(lp, show)}, three(lp, NAMES)


@case("time-zone", why="CET / CEST after the stamp, through the autumn change")
def zone_cet_cest_suffix():
    lp = loop("z5", 180, 10, "2024-10-27 00:45:00")
    return {"e.csv": table(lp, lambda t: stamp(t, DOT + " %Z", "Europe/Berlin"), "Zeit", ";", comma)}, three(
        lp, NAMES
    )


@case("time-zone", why="compact -0600 offset without a colon")
def zone_offset_compact():
    lp = loop("z6", 120, 5)
    return {"e.csv": table(lp, lambda t: stamp(t, "%Y-%m-%d %H:%M:%S%z", "America/Chicago"))}, three(
        lp, NAMES
    )


BERLIN = {"timezone": "Europe/Berlin"}


@case("time-dst", options=BERLIN, why="German wall clock in winter")
def local_plain_berlin():
    lp = loop("y1", 120, 5, "2024-11-21 08:00:00", "Europe/Berlin")
    return {"e.csv": table(lp, lambda t: stamp(t, DOT, "Europe/Berlin"), "Zeit", ";", comma)}, three(
        lp, NAMES
    )


@case("time-dst", options=BERLIN, why="autumn: 02:59:50 is followed by 02:00:00; order of rows tells")
def local_autumn_berlin():
    lp = loop("y2", 240, 10, "2024-10-27 00:40:00")
    return {"e.csv": table(lp, lambda t: stamp(t, DOT, "Europe/Berlin"), "Zeit", ";", comma)}, three(
        lp, NAMES
    )


@case("time-dst", options=BERLIN, why="autumn, newest first")
def local_autumn_newest_first():
    lp = loop("y3", 240, 10, "2024-10-27 00:40:00")
    lines = table(lp, lambda t: stamp(t, tz="Europe/Berlin")).decode().split("\r\n")
    return {"e.csv": text([lines[0], *lines[-2:0:-1]])}, three(lp, NAMES)


@case("time-dst", options=BERLIN, why="spring: 01:59:50 is followed by 03:00:00")
def local_spring_berlin():
    lp = loop("y4", 240, 10, "2024-03-31 00:40:00")
    return {"e.csv": table(lp, lambda t: stamp(t, DOT, "Europe/Berlin"), "Zeit", ";", comma)}, three(
        lp, NAMES
    )


@case("time-dst", "unknowable", "all rows inside the repeated hour, no jump: summer or winter time?", BERLIN)
def local_autumn_inside():
    lp = loop("y5", 180, 10, "2024-10-27 00:10:00")
    return {"e.csv": table(lp, lambda t: stamp(t, tz="Europe/Berlin"))}, three(lp, NAMES)


@case(
    "time-dst",
    "unknowable",
    "02:00-03:00 exists in the file but not in Berlin that day: clock is not Berlin's",
    BERLIN,
)
def local_spring_missing_hour():
    lp = loop("y6", 240, 10, "2024-03-31 00:50:00")
    return {"e.csv": table(lp, lambda t: stamp(t + 3600))}, three(lp, NAMES)


@case("time-dst", "unknowable", "stamps without zone fall back by an hour once and no zone is stated")
def local_fall_back_no_zone():
    lp = loop("y7", 240, 10, "2024-10-27 00:40:00")
    return {"e.csv": table(lp, lambda t: stamp(t, tz="Europe/Berlin"))}, three(lp, NAMES)


@case("time-dst", options=BERLIN, why="a clock that keeps winter time, over the spring change")
def winter_clock_spring():
    lp = loop("y8", 400, 60, "2024-03-30 22:00:00")
    return {"e.csv": table(lp, lambda t: stamp(t + 3600))}, three(lp, NAMES)


@case("time-dst", options=BERLIN, why="a clock that keeps winter time, over the autumn change")
def winter_clock_autumn():
    lp = loop("y9", 400, 60, "2024-10-26 22:00:00")
    return {"e.csv": table(lp, lambda t: stamp(t + 3600))}, three(lp, NAMES)


@case("time-dst", options=BERLIN, why="hourly samples: two at 02:00 in autumn")
def hourly_autumn():
    lp = loop("y10", 100, 3600, "2024-10-25 22:00:00")
    return {"e.csv": table(lp, lambda t: stamp(t, tz="Europe/Berlin"))}, three(lp, NAMES)


@case("time-zone", why="EST in the header")
def zone_letters_header():
    lp = loop("z7", 120, 5)
    return {"e.csv": table(lp, lambda t: stamp(t - 5 * 3600), "Time (EST)")}, three(lp, NAMES)


@case("time-zone", why="ISO with the zone's name in brackets, as Java writes it")
def zone_name_bracket():
    lp = loop("z8", 120, 5)

    def show(t):
        return stamp(t, "%Y-%m-%dT%H:%M:%S+01:00[Europe/Berlin]", "Europe/Berlin")

    return {"e.csv": table(lp, show)}, three(lp, NAMES)


@case("time-words", why="ctime")
def ctime_stamps():
    lp = loop("w1", 120, 5)
    return {"e.csv": table(lp, lambda t: stamp(t, "%a %b %d %H:%M:%S %Y"))}, three(lp, NAMES)


@case("time-words", why="24:00:00 at the end of a day")
def midnight_24():
    lp = loop("w2", 120, 60, "2024-11-21 23:00:00")

    def show(t):
        return stamp(t - 86400, "%Y-%m-%d 24:00:00") if t == at("2024-11-22 00:00:00") else stamp(t)

    return {"e.csv": table(lp, show)}, three(lp, NAMES)
