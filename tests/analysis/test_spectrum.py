import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.fft import next_fast_len

from frictionlab.analysis.spectrum import amplitude_spectrum, fast_length, hann, strongest_tone
from frictionlab.errors import AnalysisError
from tests.analysis import naive


def line(
    frequency: float, amplitude: float = 1.0, phase: float = 0.3, n: int = 4000, step: float = 0.004
) -> np.ndarray:
    return np.asarray(amplitude * np.cos(2 * math.pi * frequency * step * np.arange(n) + phase))


@pytest.mark.parametrize("padding", [1, 4, 16])
def test_amplitudes_do_not_depend_on_the_padding(padding: int) -> None:
    spectrum = amplitude_spectrum(line(10.0, amplitude=2.5), 0.004, padding=padding)  # a whole number of periods
    assert spectrum.amplitude.max() == pytest.approx(2.5, rel=1e-3)


def test_spectrum_against_the_sum_itself() -> None:
    signal = line(3.3, n=300) + 0.2 * line(7.1, n=300)
    spectrum = amplitude_spectrum(signal, 0.004, padding=3)
    for k in (5, 12, 30):
        assert spectrum.amplitude[k] == pytest.approx(
            naive.dft_amplitude(signal, 0.004, spectrum.frequency[k]), rel=1e-9
        )


def test_parseval() -> None:
    signal = np.random.default_rng(3).standard_normal(1000)
    windowed = (signal - signal.mean()) * hann(1000)
    amplitude = amplitude_spectrum(signal, 1.0, padding=1).amplitude * 1000 / 4
    power = (amplitude[0] ** 2 + 2 * (amplitude[1:-1] ** 2).sum() + amplitude[-1] ** 2) / 1000
    assert power == pytest.approx((windowed**2).sum(), rel=1e-10)


@settings(max_examples=40, deadline=None)
@given(st.floats(1.0, 100.0), st.floats(0.0, 6.28), st.floats(1e-6, 1e3))
def test_a_clean_line_is_found_wherever_it_lies(frequency: float, phase: float, amplitude: float) -> None:
    tone = strongest_tone(amplitude_spectrum(line(frequency, amplitude, phase), 0.004))
    assert tone.frequency == pytest.approx(frequency, abs=0.003 / 16)  # 3 thousandths of a bin
    assert tone.amplitude == pytest.approx(amplitude, rel=2e-3)


def test_error_at_default_padding_is_within_twice_the_cramer_rao_bound() -> None:
    generator = np.random.default_rng(11)
    n, step, frequency, noise = 70_000 // 10, 0.01, 0.94321, 0.01
    bound = math.sqrt(6 / (n * (n**2 - 1))) * noise / (math.pi * step)  # [Rife and Boorstyn 1974]
    found = [
        strongest_tone(
            amplitude_spectrum(line(frequency, phase=p, n=n, step=step) + noise * generator.standard_normal(n), step)
        )
        for p in generator.uniform(0, 6.28, 200)
    ]
    errors = np.array([tone.frequency - frequency for tone in found])
    assert math.sqrt(np.mean(errors**2)) < 2 * bound


def test_what_holds_no_line_is_refused() -> None:
    with pytest.raises(AnalysisError, match="stands still"):
        strongest_tone(amplitude_spectrum(np.ones(100), 0.01))
    with pytest.raises(AnalysisError, match="at least 8 samples; got 5"):
        amplitude_spectrum(np.arange(5.0), 0.01)


@given(st.integers(1, 10**9))
def test_a_fast_length_is_scipys(least: int) -> None:
    assert fast_length(least) == next_fast_len(least, real=True)


def test_a_long_record_is_padded_less(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frictionlab.analysis.spectrum.LONGEST", 9000)
    assert len(amplitude_spectrum(line(10.0), 0.004).amplitude) == 4001
    monkeypatch.setattr("frictionlab.analysis.spectrum.LONGEST", 1000)
    assert len(amplitude_spectrum(line(10.0), 0.004).amplitude) == 2001
