#!/usr/bin/env python3
"""Measures live pages in headless Chromium: pictures a second, the time of a step and of an equilibrium, and when the first picture comes.

    browser_frames.py PAGES_PROGRAM [--seconds 10]

Of a torus of 1,144 nodes that bounces and of a block of 1,764 tetrahedra that a ball presses. Chromium draws by software where there is
no graphics card, so pictures are measured twice: as drawn, and by a page that draws nothing, which is what the simulation itself allows."""
import argparse
import pathlib
import subprocess
import tempfile
import time

from browser_test import Browser

# Collects when pictures are made of a new state; what a page without WebGL does instead of drawing counts as one.
WATCH = """(() => { let last = null, then = null; window.frameTimes = []; const tick = () => { const s = pliantLive.state;
  if (s && s !== last) { const now = performance.now(); if (then !== null) frameTimes.push(now - then); then = now; last = s; } requestAnimationFrame(tick); }; tick(); })()"""


def quantiles(times):
    times = sorted(times)
    return times[len(times) // 2], times[int(0.95 * len(times))]


def watched(browser, seconds):
    browser.js(WATCH)
    time.sleep(seconds)
    return quantiles(browser.js("frameTimes"))


def moving(browser, page, seconds):
    begin = time.time()
    browser.open(page)
    browser.wait("pliantLive.state")
    first = time.time() - begin
    browser.wait("pliantLive.state.time > 0.1")
    browser.js("document.getElementById('throw').click()")
    frame = watched(browser, seconds)
    about = browser.js("document.getElementById('about').textContent")
    return (f"{about}: first picture after {first:.2f} s, frame {frame[0]:.1f} ms (95 %: {frame[1]:.1f}), step {browser.js('pliantLive.state.cost'):.2f} ms, "
            f"{browser.js('pliantLive.ratio'):.2f} x real time, quality {browser.js('pliantLive.quality')}")


def pressed(browser, page, seconds):
    browser.open(page)
    browser.wait("pliantLive.state && pliantLive.state.settled")
    x, y = browser.js("pliantLive.project([0.06, 0.025, 0])")
    browser.mouse("mousePressed", x, y)
    browser.js(WATCH)
    begin, costs = time.time(), []
    while time.time() - begin < seconds:  # up and down by a third of the block
        part = (time.time() - begin) % 4.0 / 2.0
        browser.mouse("mouseMoved", x, y + 60 * (part if part < 1.0 else 2.0 - part))
        costs.append(browser.js("pliantLive.state.cost"))
    frame = quantiles(browser.js("frameTimes"))
    cost = quantiles(costs)
    browser.mouse("mouseReleased", x, y)
    about = browser.js("document.getElementById('about').textContent")
    return f"{about}: frame {frame[0]:.1f} ms (95 %: {frame[1]:.1f}), equilibrium {cost[0]:.1f} ms (95 %: {cost[1]:.1f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--seconds", type=float, default=10.0)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        subprocess.run([arguments.program, folder, "--sizes"], check=True)
        for name, flags in (("drawn", ()), ("not drawn", ("--disable-gpu", "--disable-3d-apis"))):
            browser = Browser(*flags)
            try:
                print(f"{name}: {moving(browser, folder / 'torus.html', arguments.seconds)}", flush=True)
                print(f"{name}: {pressed(browser, folder / 'block.html', arguments.seconds)}", flush=True)
            finally:
                browser.close()


if __name__ == "__main__":
    main()
