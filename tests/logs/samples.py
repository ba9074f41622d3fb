"""Logs in every dialect that `frictionlab.logs` knows, written from numbers that are known: the tests' truth."""

import gzip
import io
import math
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import h5py
import numpy as np
import scipy.io
from numpy.typing import NDArray

from frictionlab.recording import Recording

STEP_MM = 1.02 * 50 / 65520
EPOCH_MS = 1726280207647


@dataclass(frozen=True)
class Truth:
    """The numbers behind a log: s, mm, mm, and their texts with a decimal point."""

    rows: tuple[tuple[str, str, str], ...]

    @property
    def columns(self) -> NDArray[np.float64]:
        """The numbers as they stand in the log: stamps [s], mass and base [mm]."""
        return np.array([[float(cell) for cell in row] for row in self.rows]).T

    @property
    def time(self) -> NDArray[np.float64]:
        """Stamps [s]."""
        return np.asarray(self.columns[0])

    @property
    def mass(self) -> NDArray[np.float64]:
        """Displacement of the mass [m]."""
        return np.asarray(self.columns[1] / 1000)

    @property
    def base(self) -> NDArray[np.float64]:
        """Displacement of the base [m]."""
        return np.asarray(self.columns[2] / 1000)


def truth(samples: int = 500, rate: float = 250.0, seed: int = 0) -> Truth:
    """A mass and a base at 1 Hz seen through an optoNCDT of 50 mm range."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / rate
    x = np.round((2.0 * np.sin(2 * math.pi * t) + rng.normal(0, 1e-3, samples)) / STEP_MM) * STEP_MM
    y = np.round((1.5 * np.cos(2 * math.pi * t) + rng.normal(0, 1e-3, samples)) / STEP_MM) * STEP_MM
    return Truth(tuple((f"{a:.6f}", f"{b:.6f}", f"{c:.6f}") for a, b, c in zip(t, x, y, strict=True)))


def comma(text: str) -> str:
    """The same number with a decimal comma."""
    return text.replace(".", ",")


def table(data: Truth, header: str, separator: str, *, mark: Callable[[str], str] = str, end: str = "\n") -> str:
    """Header and rows."""
    lines = [separator.join(mark(cell) for cell in row) for row in data.rows]
    return end.join([*header.split("\n"), *lines]) + end if header else end.join(lines) + end


def write(path: Path, text: str, encoding: str = "utf-8") -> Path:
    """Write text as it is; compressed if the path ends in .gz."""
    raw = text.encode(encoding)
    path.write_bytes(gzip.compress(raw, mtime=0) if path.suffix == ".gz" else raw)
    return path


def log(path: Path, head: str, *columns: Sequence[str] | NDArray[np.float64], separator: str = ",") -> Path:
    """A log of these columns, numbers or their texts, below a head of a line, of several or of none."""
    texts = [[cell if isinstance(cell, str) else f"{cell:.9f}" for cell in column] for column in columns]
    rows = "".join(separator.join(row) + "\n" for row in zip(*texts, strict=True))
    return write(path, f"{head}\n{rows}" if head else rows)


def zipped(data: bytes, *names: str) -> bytes:
    """An archive that holds this under each name; the same bytes each time."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as archive:
        for name in names:
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return held.getvalue()


def matlab(path: Path, version: Literal["4", "5", "7.3"], **variables: object) -> Path:
    """A file of MATLAB with these variables, packed where the version packs."""
    if version == "7.3":
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, value in variables.items():
                file[name] = np.atleast_2d(np.asarray(value))
                file[name].attrs["MATLAB_class"] = np.bytes_("double")
        raw = path.read_bytes()
        path.write_bytes(b"MATLAB 7.3 MAT-file" + raw[19:])
    else:
        scipy.io.savemat(path, variables, format=version, do_compression=version == "5")
    return path


def assert_is(recording: Recording, data: Truth, *, within: float = 0.0) -> None:
    """The recording has these numbers, every bit of them or to so many m and thousand times as many s; no flag."""
    np.testing.assert_allclose(recording.time, data.time, rtol=1e-15, atol=max(1e3 * within, 1e-15))
    np.testing.assert_allclose(recording.mass_displacement, data.mass, rtol=0.0, atol=within)
    np.testing.assert_allclose(recording.base_displacement, data.base, rtol=0.0, atol=within)
    assert not recording.quality.any()


def sensortool(data: Truth, column: int, separator: str, *, mark: Callable[[str], str] = str, late_ms: int = 0) -> str:
    """One sensor's file as sensorTOOL writes it: six lines, padded names, epoch time; column 1 mass, 2 base."""
    lines = [
        "sensorTOOL protocol",
        "Sensor: optoNCDT ILD1420",
        "Serial number: 0123456",
        "Measuring range: 50 mm",
        "Start: 2024-09-14 02:16:47.647",
        "",
        separator.join((" Acquisition time ", " Epoch time (ms) ", " Distance1 (mm) ")),
    ]
    for row in data.rows:
        ms = float(row[0]) * 1000 + EPOCH_MS + late_ms
        clock = f"2024-09-14 02:{16 + int(ms / 1000 - 1726280160) // 60:02d}:{(ms / 1000) % 60:06.3f}"
        lines.append(separator.join((clock, mark(f"{ms:.3f}"), mark(row[column]))))
    return "\r\n".join(lines) + "\r\n"


def ni(data: Truth, *, own_times: bool = True) -> str:
    """NI-type CSV with a byte order mark, CRLF and a time column per channel."""
    rows: list[tuple[str, ...]] = [
        ("Timestamp", "2024-05-01 10:00:00", "Timestamp", "2024-05-01 10:00:00"),
        ("Interval", "0.004", "Interval", "0.004"),
        ("Channel name", '"Mass"', "Channel name", '"Base"'),
        ("Unit", '"mm"', "Unit", '"mm"'),
        *((t, x, t, y) for t, x, y in data.rows),
    ]
    if not own_times:
        rows = [row[:2] + row[3:] for row in rows]
    return "\ufeff" + "\r\n".join(",".join(row) for row in rows) + "\r\n"


def servo(data: Truth) -> str:
    """A servo drive's log: stated interval, the unit in place of the time's name, a blank last line."""
    rows = [f"{float(t) * 1000:.3f},{x},{y}" for t, x, y in data.rows]
    return "\n".join(["Sampling time interval(ms),4.001", "ms,mass_mm,base_mm", *rows]) + "\n\n"


def labview(data: Truth, *, columns: str = "One", comments: bool = True, segments: int = 1) -> str:
    """A LabVIEW measurement file with decimal commas."""
    head = [
        "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", "Decimal_Separator\t,",
        "Multi_Headings\tYes", f"X_Columns\t{columns}", "Time_Pref\tAbsolute", "Operator\tMüller", "Date\t2024/05/01",
        "Time\t10:00:00,5", "***End_of_Header***\t", "\t",
    ]  # fmt: skip
    own = {"Samples": "500", "Date": "2024/05/01", "Time": "10:00:00,5", "Y_Unit_Label": "mm", "X_Dimension": "Time"}
    own |= {"X0": "0,0E+0", "Delta_X": "0,004"}
    part = "\t\t" if columns == "Multi" else "\t"  # each above its channel
    segment = ["Channels\t2\t\t", *(f"{key}\t{said}{part}{said}\t" for key, said in own.items())]
    segment += ["***End_of_Header***\t\t\t"]
    names = {"One": "X_Value\tMass\tBase\tComment", "No": "X_Value\tMass\tBase\tComment"}
    names["Multi"] = "X_Value\tMass\tX_Value\tBase\tComment"
    lines = list(head)
    size = -(-len(data.rows) // segments)
    for k in range(segments):
        lines += [*segment, names[columns]]
        for i, (t, x, y) in enumerate(data.rows[k * size : (k + 1) * size]):
            cells = {"One": [t, x, y], "No": ["", x, y], "Multi": [t, x, t, y]}[columns]
            note = "\tStart müde" if comments and i == 3 else ""
            lines.append("\t".join(map(comma, cells)) + note)
    return "\r\n".join(lines) + "\r\n"


def picoscope(data: Truth, names: str = "Time,Mass,Base") -> str:
    """PicoScope, in millimetres."""
    rows = [f"{float(t) * 1000:.6f},{x},{y}" for t, x, y in data.rows]
    return "\r\n".join([names, "(ms),(mm),(mm)", "", *rows]) + "\r\n"


def catman(data: Truth) -> str:
    """HBM catman ASCII: dozens of rows of words, tabs, decimal commas."""
    head = ["catman AP ASCII-Export V5.1", "Prüfstand\tReibdämpfer", "Headerlines = 14", ""]
    wide = [
        "Zeit  1 - Standardmessrate\tMasse Weg\tBasis Weg",
        "s\tmm\tmm",
        "01.05.2024 10:00:00\t01.05.2024 10:00:00\t01.05.2024 10:00:00",
        "dt=4 ms\tdt=4 ms\tdt=4 ms",
        "Kein Sensor\tLaser Nr. 1\tLaser Nr. 2",
        "keine\tNullwert gesetzt\tNullwert gesetzt",
        "-\tµ-Filter: aus\tµ-Filter: aus",
        "Kanal\tA\tB",
        "Gerät\tMX840\tMX840",
        "Bemerkung\tlinks\trechts",
    ]
    rows = ["\t".join(map(comma, row)) for row in data.rows]
    return "\r\n".join([*head, *wide, *rows]) + "\r\n"


def german(data: Truth) -> str:
    """Tabs, decimal commas, CRLF, a micro sign in the comments."""
    return "# Auflösung 1 µm\r\n" + table(data, "t [s]\tmass [mm]\tbase [mm]", "\t", mark=comma, end="\r\n")


CLEAN: dict[str, tuple[Callable[[Truth], str], str, str]] = {
    "comma": (lambda d: table(d, "time [s],mass [mm],base [mm]", ","), "utf-8", "plain"),
    "semicolon": (lambda d: table(d, "time [s];mass [mm];base [mm]", ";"), "utf-8", "plain"),
    "decimal comma": (lambda d: table(d, "Zeit [s];Masse [mm];Basis [mm]", ";", mark=comma), "utf-8", "plain"),
    "tab": (lambda d: table(d, "t_s\tx_mm\ty_mm", "\t"), "utf-8", "plain"),
    "tab-decimal-comma": (german, "cp1252", "plain"),
    "blanks": (lambda d: table(d, "t_s x_mm y_mm", "   "), "utf-8", "plain"),
    "comments": (lambda d: table(d, "# rig A\n# 250 Hz\n# t [s], x [mm], y [mm]", ","), "utf-8", "plain"),
    "utf-16": (lambda d: table(d, "time [s],mass [mm],base [mm]", ","), "utf-16", "plain"),
    "utf-16-le, no mark": (lambda d: table(d, "time [s],mass [mm],base [mm]", ","), "utf-16-le", "plain"),
    "byte order mark": (lambda d: table(d, "time [s],mass [mm],base [mm]", ",", end="\r\n"), "utf-8-sig", "plain"),
    "old mac": (lambda d: table(d, "time [s],mass [mm],base [mm]", ",", end="\r"), "utf-8", "plain"),
    "padded names": (lambda d: table(d, " time (s) , mass (mm) , base (mm) ", ","), "utf-8", "plain"),
    "units row": (lambda d: table(d, "time;mass;base\ns;mm;mm", ";"), "utf-8", "units-row"),
    "trailing comma": (lambda d: table(d, "time [s],mass [mm],base [mm]", ",", end=",\n"), "utf-8", "plain"),
    "ni": (ni, "utf-8", "NI"),
    "ni, one time": (lambda d: ni(d, own_times=False), "utf-8", "NI"),
    "servo": (servo, "utf-8", "plain"),
    "labview": (labview, "cp1252", "LabVIEW lvm"),
    "labview, no time": (lambda d: labview(d, columns="No"), "cp1252", "LabVIEW lvm"),
    "labview, two segments": (lambda d: labview(d, segments=2), "cp1252", "LabVIEW lvm"),
    "labview, own times": (lambda d: labview(d, columns="Multi"), "cp1252", "LabVIEW lvm"),
    "picoscope": (picoscope, "utf-8", "PicoScope"),
    "catman": (catman, "latin-1", "catman ASCII"),
}  # fmt: skip
