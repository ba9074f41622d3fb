"""What each step of the model buys on the real recordings in ../shared/data, and what the residual then shows.

Run: ``python -m tests.benchmarks.model_ladder``; the result goes to results/model_ladder.txt.
"""

import sys
from pathlib import Path

from frictionlab.analysis.measure import measure
from frictionlab.comparison import loop_friction_ratio
from frictionlab.comparison.ladder import climb, sliding_force, stop_motions
from frictionlab.logs import read_log
from frictionlab.scene import read_scene

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
RESULT = Path(__file__).parent / "results" / "model_ladder.txt"


def table(name: str) -> list[str]:
    """One recording: the measurement, the rungs, the motion in the stops."""
    scene = read_scene(ROOT / "configs" / "frame.toml")
    m = measure(read_log(DATA / name, scene.log), scene)
    rungs = climb(m, scene)
    head = (
        f"{name}: r = {m.frequency_ratio:.5f}, energy {m.energy_per_cycle:.4f} +- {m.energy_per_cycle_se:.4f} k Y^2,"
        f" amplitude {m.response_amplitude:.4f} Y, {m.stops_per_cycle:g} stops a cycle, {m.cycles} cycles;"
        f" friction ratio by the loop {loop_friction_ratio(m):.4f}"
    )
    titles = ("beta", "se", "mu", "nrmse %", "directions %", "E / 4 beta X", "s")
    lines = [head, f"{'model':46s}" + "".join(t.rjust(w) for t, w in zip(titles, (8, 8, 7, 9, 14, 14, 6), strict=True))]
    for rung in rungs:
        four = m.energy_per_cycle / (4 * rung.friction_ratio * m.response_amplitude)
        error = "-" if rung.friction_ratio_se is None else f"{rung.friction_ratio_se:.4f}"
        lines.append(
            f"{rung.model:46s}{rung.friction_ratio:8.4f}{error:>8s}{rung.static_ratio:7.3f}{100 * rung.nrmse:9.2f}"
            f"{100 * rung.direction_share:14.0f}{four:14.3f}{rung.seconds:6.1f}"
        )
    force = sliding_force(m, scene.rig.damping_ratio or 0.0)
    lines.append(
        f"force of the contact while sliding, over k Y: {force.rising:.3f} rising, {force.falling:.3f} falling,"
        f" {force.slow:.3f} slow, {force.fast:.3f} fast, standard deviation {force.spread:.3f}"
    )
    lines.extend(
        f"stop from tau = {stop.begin:.2f} to {stop.end:.2f}: moves by {stop.moved:+.5f} +- {stop.moved_se:.5f} Y in"
        f" the direction it came, {stop.early:+.5f} of it in its first half"
        for stop in stop_motions(m)
    )
    return lines


def main() -> None:
    """Write the tables."""
    if not DATA.is_dir():
        raise SystemExit(f"{DATA} is not there")
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n\n".join("\n".join(table(name)) for name in ("frame_250g.csv", "frame_450g.csv")) + "\n")
    sys.stdout.write(RESULT.read_text())


if __name__ == "__main__":
    main()
