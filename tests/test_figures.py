# SPDX-License-Identifier: MIT
"""What the figures of docs/accuracy-and-speed.md rest on: their scenes, their baseline, their independent real half."""
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.special import erfc

from oracle import mobilityMatrix

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT/"benchmarks"/"figures"
pytestmark = pytest.mark.skipif(not FOLDER.exists(), reason="benchmarks are not part of the source distribution")


@pytest.fixture(scope="module")
def figures():
    """The module make.py with all others."""
    sys.path[:0] = [str(FOLDER), str(FOLDER.parent)]
    try:
        spec = importlib.util.spec_from_file_location("make", FOLDER/"make.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        yield module
    finally:
        for path in (FOLDER, FOLDER.parent):
            sys.path.remove(str(path))


def testSuspensionsHaveNoOverlaps(figures):
    scenes = figures.common.scenes
    for number, phi in ((2000, 0.4), (1000, 0.05)):
        x, length = scenes.suspension(number, phi)
        assert x.shape == (number, 3) and number*4*np.pi/3/length**3 == pytest.approx(phi)
        assert scenes.contacts(x, length, 2.5)[3].min() > 1.998
        y, edge = scenes.lattice(number, phi)
        assert edge == length and scenes.contacts(y, edge, 2.5)[3].min() >= 2 - 1e-9


def testGelsAreOneClusterOfFractalDimensionTwo(figures):
    scenes = figures.common.scenes
    x, length = scenes.gel(2000, 0.02)
    assert 2000*4*np.pi/3/length**3 == pytest.approx(0.02)
    i, j, _, distance = scenes.contacts(x, length, 2.11)
    assert distance.min() > 2 - 1e-9  # no overlaps
    _, foreign = scenes._joined(np.arange(2000), i, j, distance - 2, 0.1001)
    assert not foreign.any()
    graph = scenes._joined(np.arange(2000), i, j, distance - 2, 0.1001)[0]
    assert graph.max() == 0  # all bonded
    assert 1.7 < scenes.fractalDimension(x, length, 3.0, 10.0) < 2.1
    assert 1.7 < scenes.fractalDimension(x, length, 5.0, 15.0) < 2.2
    random, edge = scenes.suspension(2000, 0.02)
    assert scenes.fractalDimension(random, edge, 5.0, 15.0) > 2.5
    again = scenes.gel.__wrapped__(2000, 0.02)[0]
    assert np.array_equal(x, again)  # deterministic
    big, twice = scenes.gel(16000, 0.02)
    assert big.shape == (16000, 3) and twice == 2*length and scenes.contacts(big, twice, 2.11)[3].min() > 2 - 1e-9


def testBaselineIsTheSquareRoot(figures):
    import lanczos

    rng = np.random.default_rng(1)
    basis, _ = np.linalg.qr(rng.normal(size=(60, 60)))
    values = np.geomspace(1e-2, 3, 60)
    M, z = (basis*values) @ basis.T, rng.normal(size=60)
    exact = (basis*np.sqrt(values)) @ basis.T @ z
    counts = []
    for tolerance in (1e-2, 1e-4, 1e-8):
        root, iterations, left = lanczos.squareRoot(lambda v: M @ v, z, tolerance)
        assert np.linalg.norm(root - exact) < 3*tolerance*np.linalg.norm(exact) and left < tolerance
        counts.append(iterations)
    assert counts == sorted(counts) and counts[0] < counts[2] <= 60
    root, iterations, _ = lanczos.squareRoot(lambda v: 4*v, z, 1e-10)
    assert iterations == 1 and np.allclose(root, 2*z, rtol=1e-14)
    with pytest.raises(ValueError, match="no convergence.*loosen"):
        lanczos.squareRoot(lambda v: M @ v, z, 1e-8, most=5)


def testRealHalfIsThatOfThePaper(figures):
    """Self term against the closed form PSE (A4); a whole matrix against the dense mobility less its waves."""
    import realhalf

    for xi in (0.3, 0.7, 1.2):
        exact = (1 - np.exp(-4*xi**2))/(4*np.sqrt(np.pi)*xi) + erfc(2*xi)
        assert realhalf.scalars(realhalf.hasimoto(xi), np.array([0.0]))[0][0] == pytest.approx(exact, abs=1e-7)
    x, length = figures.common.scenes.suspension(30, 0.1)
    eta = 1/(6*np.pi)
    full = mobilityMatrix(x, np.eye(3)*length, 1.0, eta)
    xi = 1.0
    waves = np.zeros_like(full)
    most = int(np.ceil(13*xi*length/(2*np.pi)))
    n = np.stack(np.meshgrid(*[np.arange(-most, most + 1)]*3, indexing="ij"), -1).reshape(-1, 3)
    n = n[np.any(n, axis=1) & (np.sum(n**2, axis=1) <= most**2)]
    k = 2*np.pi*n/length
    k2 = np.sum(k**2, axis=1)
    q = k2/(4*xi**2)
    D = np.sinc(np.sqrt(k2)/np.pi)**2*(1 + q)*np.exp(-q)/(k2*eta*length**3)
    for wave, square, factor in zip(k[D > 1e-12], k2[D > 1e-12], D[D > 1e-12]):
        phase = np.exp(1j*(x @ wave))
        waves += np.kron(factor*np.real(np.outer(phase, phase.conj())), np.eye(3) - np.outer(wave, wave)/square)
    real = realhalf.matrix(x, length, realhalf.hasimoto(xi)).toarray()
    assert abs(real - (full - waves)).max() < 2*realhalf.SMALLEST
    low, high = realhalf.extremes(realhalf.matrix(x, length, realhalf.hasimoto(xi)))
    values = np.linalg.eigvalsh(real)
    assert (low, high) == pytest.approx((values[0], values[-1]), rel=5e-3)


def testProlateHalfVanishesBeyondItsRange(figures):
    import realhalf

    quadrature = realhalf.prolate(14.0, 5.0)
    F, G = realhalf.scalars(quadrature, np.array([5.0, 6.0, 8.0]))
    assert max(abs(F).max(), abs(G).max()) < 1e-5  # what is dropped beyond the first zero of w, for bandwidth 14
    k, _, w = quadrature
    assert np.all(w <= np.sinc(k/np.pi)**2 + 1e-9) and np.all(w >= -1e-9)
    assert np.allclose(w[:20], 1 - k[:20]**2/3, atol=2*k[19]**4)


def testCutoffsOfFcmAndPse(figures):
    """Against the closed bound (28) of the paper for PSE, and erfc for FCM."""
    from scipy.special import erfc as complement

    grid = figures.grid
    for tolerance in (1e-2, 1e-3, 1e-5):
        assert complement(grid.cutoffOfFcm(tolerance)/np.sqrt(np.pi)) == pytest.approx(tolerance, rel=1e-9)
        for xi in (0.3, 0.5):
            k = grid.cutoffOfPse(tolerance, xi)
            bound = (4/k*np.exp(-(k/(2*xi))**2) - np.sqrt(np.pi)/xi*complement(k/(2*xi)))/(2*np.pi)
            assert 0.1*bound < tolerance <= bound*1.01
    assert (grid.cutoffOfFcm(1e-3)/grid.cutoffOfPse(1e-3, 0.5))**3 == pytest.approx(10, rel=0.4)  # seed: about 10


def testNumbersSurviveTheFileAndFillTheText(figures, tmp_path):
    rows = [{"what": "a, b", "particles": 1000, "ms_per_step": 1.25, "over_forces_alone": 2.0},
            {"what": "+ noise", "particles": 1000, "ms_per_step": 1e-7/3, "over_forces_alone": 1.0}]
    path = tmp_path/"effects.csv"
    figures.common.writeRows(path, rows)
    read = figures.common.readRows(path)
    assert read[0] == {"what": "a, b", "particles": 1000.0, "ms_per_step": 1.25, "over_forces_alone": 2.0}
    text = tmp_path/"text.md"
    text.write_text("before\n<!-- begin effects -->\nold\n<!-- end effects -->\nafter\n")
    for _ in range(2):
        figures.fill(text, "effects", read)
    lines = text.read_text().splitlines()
    assert lines[0] == "before" and lines[-1] == "after" and "old" not in lines
    assert lines[4] == "| a, b | 1.25 | 2 |" and len(lines) == 8
    text.write_text("nothing")
    with pytest.raises(ValueError, match="<!-- begin effects -->"):
        figures.fill(text, "effects", read)


def testTextAndNumbersInTheRepositoryBelongTogether(figures, tmp_path):
    """Every figure has its numbers, its picture and its place; the tables are those of the numbers."""
    text = (ROOT/"docs"/"accuracy-and-speed.md").read_text(encoding="utf-8")
    copy = tmp_path/"copy.md"
    copy.write_text(text, encoding="utf-8")
    for name in figures.FIGURES:
        assert f"(figures/{name}.png)" in text
        picture = ROOT/"docs"/"figures"/f"{name}.png"
        assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size <= figures.common.LARGEST_PICTURE
        figures.fill(copy, name, figures.common.readRows(picture.with_suffix(".csv")))
    assert copy.read_text(encoding="utf-8") == text


def testDriverMeasuresAndDraws(figures, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(figures.grid, "COUNT", 300)
    assert figures.main(["grid", "--quick", "--threads", "1", "--output", str(tmp_path)]) == 0
    assert (tmp_path/"grid.png").exists() and (tmp_path/"grid.csv").exists() and (tmp_path/"grid.txt").exists()
    assert figures.main(["grid", "--redraw", "--output", str(tmp_path)]) == 0
    with pytest.raises(SystemExit):
        figures.main(["pie", "--quick"])
    assert "unknown figure 'pie'" in capsys.readouterr().err

    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(figures.grid, "measure", interrupted)
    assert figures.main(["grid", "--quick", "--output", str(tmp_path)]) == 130
