"""The code page of a short header: western letters stand among ASCII ones, another alphabet makes whole words."""

import numpy as np
import pytest
from rigs import arm

from nnhydro.recordings.readers.column_map import parse_column_map
from nnhydro.recordings.readers.encoding import encoding_of
from nnhydro.recordings.readers.files import read_recording

# ruff: noqa: RUF001 - the letters are meant
HEADERS = {
    "German, degrees": ("cp1252", "Zeit [s];Schulter [°];Moment [Nm]"),
    "German, microradians": ("cp1252", "Zeit;Schulter [µrad];Größe"),
    "German, one umlaut": ("cp1252", "Zeit [s];größe;Drehmoment"),
    "French": ("cp1252", "Temps écoulé [s];Angle épaule [°];Couple mesuré [N·m]"),
    "French, capitals": ("cp1252", "Température;Énergie;Côté"),
    "Spanish": ("cp1252", "tiempo;ángulo;señal"),
    "a square metre": ("cp1252", "t_s;Fläche [m²];q"),
    "Polish": ("cp1250", "Czas;Kąt ramienia;Moment siły"),
    "Russian": ("cp1251", "Время [с];Угол [рад];Момент [Нм]"),
    "Russian, a few letters": ("cp1251", "t_s;Угол°;Н·м"),
    "Russian of old Unix": ("koi8_r", "время;угол плеча;момент"),
    "Greek": ("cp1253", "Χρόνος [s];Γωνία [rad];Ροπή [Nm]"),
    "Greek, ISO": ("iso8859_7", "Άξονας [s];Γωνία [°];Ροπή [Nm]"),
    "Japanese": ("shift_jis", "時間;肩角度;トルク"),
}
T = np.arange(40) / 50


@pytest.mark.parametrize("name", HEADERS)
def test_a_header_in_a_code_page_reads_as_it_was_written(name, tmp_path):
    page, header = HEADERS[name]
    rows = "".join(f"{t:.3f};{np.sin(3 * t):.6f};{np.cos(3 * t):.5f}\n" for t in T)
    path = tmp_path / "run.csv"
    path.write_bytes(f"{header}\n{rows}".encode(page))
    found = encoding_of(path)
    assert header.encode(page).decode(found) == header
    time, angle, torque = header.split(";")
    mapping = parse_column_map({"columns": {"t_s": time, "q1_rad": angle, "tau1_Nm": torque}}, "columns.yaml")
    np.testing.assert_allclose(read_recording(path, arm(1), column_map=mapping).q[:, 0], np.sin(3 * T), atol=1e-6)


def test_unicode_is_still_seen_before_any_code_page(tmp_path):
    for page in ("utf-8", "utf-8-sig", "utf-16"):
        (tmp_path / page).write_bytes("Zeit;Größe [°]\n0;1\n".encode(page))
        assert encoding_of(tmp_path / page) == page
