#!/usr/bin/env python3
"""Uses live pages in headless Chromium, through its debugging protocol: positions, energies and pixels are compared with what they must be.

    browser_test.py PAGES_PROGRAM        exits with 77 where no Chromium is installed

Standard library only."""
import base64
import json
import os
import pathlib
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request
import zlib

SKIPPED = 77


class Socket:
    """What a client needs of RFC 6455: text out, text in."""

    def __init__(self, url):
        host, path = url.removeprefix("ws://").split("/", 1)
        name, port = host.split(":")
        self.socket = socket.create_connection((name, int(port)), timeout=120)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f"GET /{path} HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
                            "Sec-WebSocket-Version: 13\r\n\r\n".encode())
        self.stream = self.socket.makefile("rb")
        while self.stream.readline() not in (b"\r\n", b""):
            pass

    def send(self, text):
        data, mask = text.encode(), os.urandom(4)
        size = len(data)
        head = struct.pack("!BB", 0x81, 0x80 | size) if size < 126 else (
            struct.pack("!BBH", 0x81, 0xFE, size) if size < 65536 else struct.pack("!BBQ", 0x81, 0xFF, size))
        self.socket.sendall(head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(data)))

    def receive(self):
        whole = b""
        while True:
            first, size = self.stream.read(2)
            size &= 0x7F
            if size >= 126:
                size = struct.unpack("!H" if size == 126 else "!Q", self.stream.read(2 if size == 126 else 8))[0]
            part = self.stream.read(size)
            if first & 0x0F in (0, 1, 2):
                whole += part
                if first & 0x80:
                    return whole.decode()


class Browser:
    def __init__(self, *flags):
        self.folder = tempfile.mkdtemp()
        self.process = subprocess.Popen(
            [program(), "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--remote-debugging-port=0", "--remote-allow-origins=*",
             "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--window-size=1000,700", f"--user-data-dir={self.folder}", *flags, "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
        port_file = pathlib.Path(self.folder, "DevToolsActivePort")
        until = time.time() + 60
        while not (port_file.exists() and len(port_file.read_text().splitlines()) > 1):
            assert time.time() < until, "Chromium does not start"
            time.sleep(0.05)
        port = port_file.read_text().splitlines()[0]
        pages = json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json"))
        self.socket = Socket(next(p for p in pages if p["type"] == "page")["webSocketDebuggerUrl"])
        self.number, self.errors = 0, []
        self.call("Page.enable")
        self.call("Runtime.enable")

    def call(self, method, **words):
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "method": method, "params": words}))
        while True:
            message = json.loads(self.socket.receive())
            if message.get("method") == "Runtime.exceptionThrown":
                self.errors.append(json.dumps(message)[:600])
            if message.get("id") == self.number:
                assert "error" not in message, message
                return message["result"]

    def js(self, text):
        result = self.call("Runtime.evaluate", expression=text, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in result, json.dumps(result)[:600]
        return result["result"].get("value")

    def wait(self, condition, seconds=60):
        until = time.time() + seconds
        while not self.js(f"!!({condition})"):
            assert time.time() < until, f"not within {seconds} s: {condition}; the page says: {self.js(TROUBLE)}"
            time.sleep(0.05)

    def open(self, page):
        self.call("Page.navigate", url=page.resolve().as_uri())
        self.wait("document.readyState === 'complete' && window.pliantLive")

    def mouse(self, kind, x, y):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=0 if kind == "mouseReleased" else 1, clickCount=1)

    def set(self, slider, value):
        self.js(f"(() => {{ const s = document.getElementById('{slider}'); s.value = {value}; s.dispatchEvent(new Event('input')); }})()")

    def middle(self):
        return self.js("(() => { const p = pliantLive.state.positions, m = [0, 0, 0]; for (let i = 0; i < p.length; ++i) m[i % 3] += 3 * p[i] / p.length; return m; })()")

    def close(self):
        os.killpg(self.process.pid, signal.SIGKILL)  # its helpers too
        self.process.wait(timeout=60)
        shutil.rmtree(self.folder, ignore_errors=True)


TROUBLE = "document.getElementById('trouble').textContent"


def program():
    return next((p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None)


def pixels(png):
    """Rows of red, green and blue of a PNG of 8 bits without interlacing."""
    at, data = 8, b""
    while at < len(png):
        size, kind = struct.unpack("!I4s", png[at:at + 8])
        if kind == b"IHDR":
            width, height, _, colour = struct.unpack("!IIBB", png[at + 8:at + 18])
        if kind == b"IDAT":
            data += png[at + 8:at + 8 + size]
        at += 12 + size
    n = {2: 3, 6: 4}[colour]
    raw, rows, last = zlib.decompress(data), [], bytes(width * n)
    for y in range(height):
        kind, row = raw[y * (width * n + 1)], bytearray(raw[y * (width * n + 1) + 1:(y + 1) * (width * n + 1)])
        for i in range(width * n):
            a, b, c = (row[i - n] if i >= n else 0), last[i], (last[i - n] if i >= n else 0)
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            row[i] = (row[i] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        rows.append(row)
        last = row
    return [[tuple(row[n * x:n * x + 3]) for x in range(width)] for row in rows]


def moves_as_the_program_does(browser, folder):
    browser.open(folder / "free.html")
    browser.wait("pliantLive.state && pliantLive.frames")
    browser.js("pliantLive.tell('run', { on: false }); pliantLive.tell('start'); pliantLive.tell('steps', { count: 100 })")
    browser.wait("pliantLive.last")
    nodes, expected = browser.js("pliantLive.last.nodes"), json.loads((folder / "free.json").read_text())
    worst = max(abs(a - b) for a, b in zip(nodes, expected))
    assert worst < 1e-9 * 0.2, f"nodes differ by {worst} m after 100 steps"
    assert browser.js("pliantLive.frames.length") == 3
    return f"nodes differ from the program's by {worst / 0.2:.1e} of the size after 100 steps"


def is_pulled_and_let_go(browser, folder):
    browser.open(folder / "free.html")
    browser.wait("pliantLive.state && pliantLive.state.time > 0.05")
    browser.js("pliantLive.tell('gravity', { value: [0, 0, 0] }); pliantLive.tell('reset')")
    browser.wait("pliantLive.state.time < 0.05")
    x, y = browser.js("pliantLive.project([0, 0, 0])")
    before = browser.middle()
    browser.mouse("mousePressed", x, y)
    for k in range(10):
        browser.mouse("mouseMoved", x, y - 12 * k)
        time.sleep(0.05)
    browser.wait("pliantLive.state.hand && Math.hypot(...pliantLive.state.hand.slice(0, 3)) > 0.05")
    browser.wait("/pull/.test(document.getElementById('told').textContent)")
    browser.wait(f"(() => {{ const p = pliantLive.state.positions; let m = 0; for (let i = 1; i < p.length; i += 3) m += 3 * p[i] / p.length; return m > {before[1]} + 0.01; }})()")
    browser.mouse("mouseReleased", x, y - 108)
    browser.wait("!pliantLive.state.hand")
    assert browser.js("pliantLive.state.energy") > 0.0, "it leaves the hand without the pull's energy"
    return "a dragged object follows, shows its pull, and leaves with energy"


def wind_and_colours(browser, folder):
    browser.open(folder / "held.html")
    browser.wait("pliantLive.state && pliantLive.state.time > 0.05")
    still = browser.middle()
    browser.js("document.getElementById('field').value = '2'; document.getElementById('field').dispatchEvent(new Event('change'))")
    browser.wait("pliantLive.state.field && document.getElementById('bar').style.display === 'block'")
    browser.set("wind", 20)
    browser.wait(f"(() => {{ const p = pliantLive.state.positions, m = [0, 0, 0]; for (let i = 0; i < p.length; ++i) m[i % 3] += 3 * p[i] / p.length; return Math.hypot(m[0] - {still[0]}, m[2] - {still[2]}) > 1e-5; }})()")
    picture = pixels(base64.b64decode(browser.call("Page.captureScreenshot", format="png")["data"]))
    x, y = browser.js("pliantLive.project([0, 0, 0])")
    r, g, b = picture[int(y)][int(x)]
    assert max(r, g, b) - min(r, g, b) > 20, f"the object is grey, {r} {g} {b}, where stress is shown in colour"
    return "wind moves a held object; stress is coloured"


def is_pressed(browser, folder):
    browser.open(folder / "pressed.html")
    browser.wait("pliantLive.state && pliantLive.state.settled")
    assert browser.js("document.getElementById('wind-row').hidden && document.getElementById('run').hidden"), "what moves alone is shown"
    said = "document.getElementById('told').textContent.includes('extrapolated')"
    assert not browser.js(said), "an object at rest is not strained beyond its fit"
    x, y = browser.js("pliantLive.project([0.06, 0.025, 0])")
    for kind, name in ((0, "a ball"), (1, "a flat end"), (2, "a rod"), (3, "a glued disc")):
        browser.js(f"document.getElementById('probe-kind').value = '{kind}'")
        browser.mouse("mousePressed", x, y)
        for k in range(1, 11):
            browser.mouse("mouseMoved", x, y + 4 * k)
            time.sleep(0.03)
        browser.wait("pliantLive.state.settled && pliantLive.state.probe[4] < -1e-3")
        force = browser.js("pliantLive.state.probe")
        assert force[1] < -0.01, f"{name} presses with {force} N"
        browser.wait(said)
        curve = browser.js("pliantLive.curve.slice()")
        assert len(curve) > 3 and curve[-1][1] > 0.5 * max(f for _, f in curve), f"{name}: a force-displacement curve {curve}"
        if kind == 3:
            for k in range(20):
                browser.mouse("mouseMoved", x, y + 40 - 4 * k)
                time.sleep(0.02)
            browser.wait("pliantLive.state.settled && pliantLive.state.probe[1] > 0.005")
        browser.mouse("mouseReleased", x, y)
        browser.wait("pliantLive.state.settled && Math.hypot(...pliantLive.state.probe.slice(0, 3)) === 0")
    for field in (5, 6):
        browser.js(f"document.getElementById('field').value = '{field}'; document.getElementById('field').dispatchEvent(new Event('change'))")
        browser.wait("pliantLive.state.field && document.getElementById('bar').style.display === 'block'")
        assert browser.js("Math.min(...pliantLive.state.field)") > 0.0
    browser.wait("pliantLive.frames")
    return "presses and pulls by four probes, with force, curve, deviation and the modulus under strain"


def samples_side_by_side(browser, folder):
    ends = []
    for page, count in (("free.html", 3), ("pressed.html", 2)):
        browser.open(folder / page)
        browser.wait("pliantLive.frames")
        browser.js("document.getElementById('aside').value = '2'; document.getElementById('aside').dispatchEvent(new Event('change'))")
        if page == "pressed.html":
            browser.js("document.getElementById('play').click()")  # stops
            browser.set("frame", count - 1)
        browser.wait(f"pliantLive.replays.get(0)?.[{count - 1}] && pliantLive.replays.get(1)?.[{count - 1}] && pliantLive.copies === 2")
        apart = browser.js(f"(() => {{ const a = pliantLive.replays.get(0)[{count - 1}], b = pliantLive.replays.get(1)[{count - 1}]; let m = 0; for (let i = 0; i < a.length; ++i) m = Math.max(m, Math.abs(a[i] - b[i])); return m; }})()")
        assert apart > 1e-5, f"{page}: samples of a fifth or four times the stiffness move alike"
        browser.wait("document.getElementById('told').textContent.includes('samples 1 to 2')")
        ends.append(apart)
    return "samples of the parameters are replayed side by side"


def sleeps(browser, folder):
    """A page behind another tab: time stands still there, and goes on when somebody looks again."""
    seconds = 60
    browser.open(folder / "free.html")
    browser.wait("pliantLive.state && pliantLive.state.time > 0.2")
    own = next(t["targetId"] for t in browser.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
    other = browser.call("Target.createTarget", url="about:blank")["targetId"]
    browser.wait("document.hidden")
    before = browser.js("pliantLive.state.time")
    time.sleep(seconds)
    browser.call("Target.activateTarget", targetId=own)
    browser.call("Target.closeTarget", targetId=other)
    browser.wait(f"!document.hidden && pliantLive.state.time > {before} + 0.2")
    after = browser.js("pliantLive.state.time")
    assert after - before < 0.2 * seconds, f"{after - before} s passed while nobody looked"
    assert not browser.js(TROUBLE), browser.js(TROUBLE)
    assert browser.js("pliantLive.state.positions.every(isFinite)")
    return f"stands still while {seconds} s pass behind another tab, and goes on"


def failures_are_told(browser, folder):
    browser.open(folder / "broken.html")
    browser.wait("document.getElementById('trouble').style.display === 'block'")
    assert "pliant live" in browser.js(TROUBLE) or "cut short" in browser.js(TROUBLE) or "cannot" in browser.js(TROUBLE), browser.js(TROUBLE)
    browser.errors.clear()
    browser.open(folder / "one.html")
    browser.wait("pliantLive.state && pliantLive.state.time > 0.1")
    return "a broken file says so; a body of one element moves"


def without_webgl(folder):
    browser = Browser("--disable-gpu", "--disable-3d-apis")
    try:
        browser.open(folder / "free.html")
        browser.wait("pliantLive.state && pliantLive.state.time > 0.05")
        assert "WebGL" in browser.js(TROUBLE)
    finally:
        browser.close()
    return "without WebGL it says so, and simulates"


def main():
    if not program():
        print("skipped: no Chromium is installed")
        sys.exit(SKIPPED)
    folder = pathlib.Path(tempfile.mkdtemp())
    subprocess.run([sys.argv[1], folder], check=True)
    browser = Browser()
    try:
        for test in (moves_as_the_program_does, is_pulled_and_let_go, wind_and_colours, is_pressed, samples_side_by_side, sleeps, failures_are_told):
            print(test(browser, folder), flush=True)
            assert not browser.errors, browser.errors
    finally:
        browser.close()
    print(without_webgl(folder))
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
