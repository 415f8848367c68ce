"""What the report of a large plan costs: bytes, seconds to write, seconds until it is ready, frames a second.

    blossom make MESH --budget 15 -o DIR        # a bundle of some 350 faces, once
    python -m benchmarks.report_page DIR        # prints the figures

Needs Playwright and a Chromium; the picture is drawn by the processor (SwiftShader).
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

from studio.bundle_check import open_manifest
from studio.bundle_summary import bundle_summary, step_settings, validation_values
from studio.motion_glb import motion_glb
from studio.report import report_html
from studio.report_rooms import step_rooms
from studio.workspace import Workspace
from tests.studio.browser import open_browser

REPEATS = 3
FRAMES = 120
DRAG = """async (frames) => {
  const slider = document.getElementById('time'), last = window.blossom.steps;
  const gl = document.getElementById('view').getContext('webgl2'), pixel = new Uint8Array(4);
  const begin = performance.now();
  for (let i = 0; i < frames; i++) {
    slider.value = (last * i) / frames;
    slider.dispatchEvent(new Event('input'));
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    await new Promise(requestAnimationFrame);
  }
  return (1000 * frames) / (performance.now() - begin);
}"""


def main() -> None:
    """Print the figures of one bundle."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("bundle", type=Path)
    bundle = parser.parse_args().bundle
    ws = Workspace(bundle, open_manifest(bundle))
    start = time.perf_counter()
    ws.process  # noqa: B018  known from the stages before when a whole run writes the report
    ws.job  # noqa: B018
    known_s = time.perf_counter() - start
    page, wrote_s, used_s = b"", [], []
    for _ in range(REPEATS):
        start, used = time.perf_counter(), time.process_time()
        motion_glb(ws.plan)
        page = report_html(
            ws.plan, bundle_summary(ws), ws.manifest, settings=step_settings(ws), rooms=step_rooms(ws),
            validation=validation_values(ws),
        )  # fmt: skip
        wrote_s.append(time.perf_counter() - start)
        used_s.append(time.process_time() - used)
    print(f"faces          {len(ws.net.faces)}, {len(ws.plan.steps)} steps")
    print(f"size           {len(page) / 1e6:.2f} MB")
    told = " ".join(f"{s:.2f}" for s in wrote_s)
    print(
        f"page written   {statistics.median(wrote_s):.2f} s (median of {told}), animation included; "
        f"{statistics.median(used_s):.2f} s of them at work"
    )
    print(
        f"read before    {known_s:.2f} s: process and job, which `blossom report` makes again from the plan"
    )
    with tempfile.TemporaryDirectory() as folder, open_browser() as browser:
        file = Path(folder) / "report.html"
        file.write_bytes(page)
        ready_s, frames_s = [], []
        for _ in range(REPEATS):
            tab = browser.new_page(viewport={"width": 1300, "height": 900})
            start = time.perf_counter()
            tab.goto(file.as_uri())
            tab.wait_for_selector("html[data-ready]", timeout=120_000)
            ready_s.append(time.perf_counter() - start)
            frames_s.append(tab.evaluate(DRAG, FRAMES))
            tab.close()
    print(f"ready          {statistics.median(ready_s):.2f} s (median of {REPEATS})")
    rate = statistics.median(frames_s)
    print(f"slider         {rate:.1f} frames/s (median of {REPEATS}, {FRAMES} frames each)")


if __name__ == "__main__":
    main()
