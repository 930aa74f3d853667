"""Response times of the explorer, measured in a headless browser, and its memory over time.

    python benchmarks/explorer.py                 click to motion, slider to portrait, maps
    python benchmarks/explorer.py --steps         at rest: click to each stage of the answer, slider to each map
    python benchmarks/explorer.py --minutes 30    random clicks and drags, with the memory of the server

Times are measured in the page, from the event to the end of the first frame after the answer is in the document and all
its figures are painted.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count, pairwise

import psutil
from playwright.sync_api import Page, TimeoutError, sync_playwright

from gearchaos.studies.core.warmup import warmup

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
KINDS = {"torsional": "kind=torsional", "full": "kind=full"}
_CANCELLED_AFTER = 5
"""Seconds after which the computations of a page that was closed have ended."""

MAP = "x=omega=0.2:3.0&y=eps1=0.0:0.3"

_STOPWATCH = """
window.measured = new Promise((done) => {
  const html = () => document.querySelector(PLACE).innerHTML
  let began, before
  document.addEventListener(EVENT, () => { began = performance.now(); before = html() }, {capture: true, once: true})
  const look = () => {
    if (began && html() !== before && document.querySelector(ANSWER)) setTimeout(() => done(performance.now() - began))
    else requestAnimationFrame(look)
  }
  requestAnimationFrame(look)
})
0
"""


def watch(page: Page, event: str, place: str, answer: str) -> None:
    """Set ``window.measured`` to a promise of the milliseconds from an event until the answer is painted.

    ``place`` and ``answer`` are selectors: the answer is there when the HTML of the place has changed and an element
    matches ``answer``.
    """
    page.evaluate(_filled(_STOPWATCH, EVENT=event, PLACE=place, ANSWER=answer))


def _filled(script: str, **values: str) -> str:
    """A script with strings in the place of names."""
    for name, value in values.items():
        script = script.replace(name, json.dumps(value))
    return script


@contextmanager
def served():
    """The address of a server and its process."""
    command = (sys.executable, "-c", "from gearchaos.cli import main; main()", "explore", "--no-open", "--port", "0")
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        for line in process.stderr:
            if found := re.search(r"http://[^/\s]+/", line):
                break
        yield found[0], psutil.Process(process.pid)
    finally:
        process.terminate()
        process.wait()


@contextmanager
def browser():
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


def opened(chromium, url: str, errors: list[str] | None = None) -> Page:
    """A page with its first motion; errors of its script are appended to ``errors``."""
    page = chromium.new_page(viewport={"width": 1366, "height": 768})
    if errors is not None:
        page.on("pageerror", lambda e: errors.append(str(e)))
        page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
    page.goto(url)
    page.wait_for_selector(".verdict[data-final='1']")
    if message := page.locator("#message").inner_text():  # of an address that is refused; another page is shown
        raise RuntimeError(message)
    return page


def inside(page: Page) -> dict[str, float]:
    """A rectangle on the screen inside the frame of the map."""
    box = page.locator("#map-figure").bounding_box()
    return {"left": box["x"] + 75, "top": box["y"] + 45, "width": box["width"] - 125, "height": box["height"] - 105}


_LOG = """
window.stages = []
{
  const place = document.querySelector(PLACE)
  let began = null
  document.addEventListener(EVENT, () => { began = performance.now() }, {capture: true, once: true})
  window.watching?.disconnect()
  window.watching = new MutationObserver(() => {
    if (began === null) return
    const {...seen} = (place.querySelector(ANSWER) ?? place).dataset
    requestAnimationFrame(() => setTimeout(() => window.stages.push([performance.now() - began, seen])))
  })
  window.watching.observe(place, {childList: true, subtree: true})
}
0
"""
"""Appends to ``window.stages`` the milliseconds from an event to each answer's frame, and the data of the answer."""


def stages_of_clicks(chromium, url: str, kind: str, count: int) -> dict[str, list[dict[str, float]]]:
    """Milliseconds from clicks at rest to the stages of their answers, ``count`` regular and chaotic motions or more.

    ``verdict`` is the first verdict in words, ``panels`` all figures of the motion, ``final`` the final verdict.
    """
    page, chance = opened(chromium, f"{url}?{KINDS[kind]}&{MAP}"), random.Random(3)
    page.wait_for_timeout(3000)
    frame, out = inside(page), {"regular": [], "chaotic": []}
    while min(map(len, out.values())) < count:
        _wait_for_rest(page, True)
        page.evaluate(_filled(_LOG, PLACE="#verdict", EVENT="pointerdown", ANSWER=".verdict"))
        page.mouse.click(frame["left"] + chance.random() * frame["width"],
                         frame["top"] + chance.random() * frame["height"])
        page.wait_for_function("stages.some(([_, seen]) => seen.final === '1' && seen.stage === 'complete')")
        stages = page.evaluate("stages")
        first = {name: next(ms for ms, seen in stages if holds(seen)) for name, holds in _STAGES.items()}
        out["chaotic" if stages[-1][1]["label"] == "chaotic" else "regular"].append(first)
    page.close()
    return out


_STAGES = {
    "verdict": lambda seen: True, "panels": lambda seen: seen["stage"] != "verdict" or seen["label"] == "diverged",
    "final": lambda seen: seen["final"] == "1" and seen["stage"] == "complete",
}


def map_steps(chromium, url: str, count: int) -> dict[str, object]:
    """Milliseconds from a move of the slider of the damping to the maps that follow, and between them."""
    page = opened(chromium, f"{url}?{KINDS['torsional']}&{MAP}&at=1.0,0.2")
    slider, first, gaps = page.locator(".field-zeta input[type=range]"), [], {}
    for i in range(count):
        page.wait_for_timeout(1000)
        _wait_for_rest(page, True)
        page.evaluate(_filled(_LOG, PLACE="#legend", EVENT="input", ANSWER="[data-stride]"))
        box = slider.bounding_box()
        page.mouse.click(box["x"] + box["width"] * (0.1 + 0.5 * (0.382 * i % 1)), box["y"] + box["height"] / 2)
        page.wait_for_function("stages.some(([_, seen]) => seen.share === '1.0000')", timeout=120_000)
        stages = page.evaluate("stages")
        first.append(stages[0][0])
        for (before, _), (after, seen) in pairwise(stages):
            gaps.setdefault(f"to stride {seen['stride']}", []).append(after - before)
    page.close()
    spread = {name: {**_spread(found), "steps per move": len(found) / count} for name, found in gaps.items()}
    return {"first map": _spread(first), **spread}


def steps(count: int) -> Iterator[tuple[str, object]]:
    """The stages of answers at rest: name and statistics."""
    with served() as (url, _), browser() as chromium:
        opened(chromium, url).close()
        for kind in KINDS:
            for motions, found in stages_of_clicks(chromium, url, kind, count).items():
                for stage in _STAGES:
                    yield (f"click to {stage}, {kind}, {motions}, ms",
                           {**_spread([each[stage] for each in found]), "points": len(found)})
        yield "slider to maps, ms", map_steps(chromium, url, max(3, count // 5))


def _wait_for_rest(page: Page, rest: bool) -> None:
    """Wait until all computations have ended; without ``rest``, only for a short time."""
    if rest:
        page.wait_for_selector(".busy.idle", timeout=120_000)
    page.wait_for_timeout(300 if rest else 900)


def clicks(chromium, url: str, kind: str, count: int, rest: bool) -> list[tuple[str, float]]:
    """Milliseconds from the click to the complete motion, with its verdict, of random points."""
    page, chance = opened(chromium, f"{url}?{KINDS[kind]}&{MAP}"), random.Random(1)
    page.wait_for_timeout(3000)
    frame, out = inside(page), []
    for _ in range(count):
        _wait_for_rest(page, rest)
        watch(page, "pointerdown", "#verdict", ".verdict:not([data-stage='verdict'])")
        page.mouse.click(frame["left"] + chance.random() * frame["width"],
                         frame["top"] + chance.random() * frame["height"])
        spent = page.evaluate("window.measured")
        out.append((page.locator(".verdict").get_attribute("data-label"), spent))
    page.close()
    return out


def slider_moves(chromium, url: str, count: int, rest: bool) -> list[float]:
    """Milliseconds from a move of the slider to the redrawn portrait."""
    page, out = opened(chromium, f"{url}?{KINDS['torsional']}&{MAP}&at=1.0,0.2"), []
    page.wait_for_timeout(3000)
    box = page.locator(".field-omega input[type=range]").bounding_box()
    for i in range(count):
        _wait_for_rest(page, rest)
        watch(page, "pointerdown", "#verdict", ".verdict")
        share = 0.1 + 0.8 * (0.382 * i % 1)  # far from the handle, since a click on the handle does not move it
        page.mouse.click(box["x"] + box["width"] * share, box["y"] + box["height"] / 2)
        out.append(page.evaluate("window.measured"))
    page.close()
    return out


def maps(chromium, url: str, kind: str, timeout: float) -> dict[str, float]:
    """Seconds from opening a page to its coarse map, its fine map and its complete map; ``timeout`` for each."""
    time.sleep(_CANCELLED_AFTER)
    page, began = chromium.new_page(viewport={"width": 1366, "height": 768}), time.perf_counter()
    page.goto(f"{url}?{KINDS[kind]}&{MAP}&at=1.3,0.21")
    out = {"opened": time.perf_counter() - began}
    for name, condition in (("coarse", "stride <= 8"), ("fine", "stride <= 1"), ("all", "share >= 1")):
        try:
            page.wait_for_function(_MAP_PROGRESS.replace("CONDITION", condition), timeout=1000 * timeout)
        except TimeoutError:
            break
        out[name] = time.perf_counter() - began
    page.close()
    return out


def first_maps(chromium, url: str, count: int) -> list[float]:
    """Seconds from a change of the damping to the first map with it, while the previous map is being computed."""
    page, out = opened(chromium, f"{url}?{KINDS['torsional']}&{MAP}"), []
    for i in range(count):
        page.wait_for_timeout(3000)
        watch(page, "change", "#legend", "#legend [data-stride='16'], #legend [data-stride='8']")
        field = page.locator(".field-zeta input[type=text]")
        field.fill(f"{0.026 + 0.002 * i:g}")
        field.press("Enter")
        out.append(page.evaluate("window.measured") / 1000)
    page.close()
    return out


_MAP_PROGRESS = """() => {
  const {stride, share} = document.querySelector("[data-stride]")?.dataset ?? {stride: Infinity, share: 0}
  return CONDITION
}"""


def endurance(minutes: float) -> Iterator[tuple[str, object]]:
    """Random clicks, drags, zooms, sliders and keys, with a check after every 20 that the page still answers.

    Memory is reported every minute: a final value alone would not distinguish a leak from caches that have filled.
    """
    errors: list[str] = []
    with served() as (url, process), browser() as chromium:
        page, chance, done, waits = opened(chromium, url, errors), random.Random(2), 0, []
        _act_at_random(page, chance, 60)
        began = time.monotonic()
        for minute in count():
            yield f"memory after {minute} min, MiB", _memory(process, page)
            if minute >= minutes:
                break
            while time.monotonic() < began + 60 * (minute + 1):
                _act_at_random(page, chance, 20)
                waits.append(_wait_for_verdict(page, errors))
                done += 20
        page.wait_for_selector(".busy.idle", timeout=240_000)
        yield "memory at rest, MiB", _memory(process, page)
    yield "summary", {"actions": done, "errors": errors, "longest wait for an answer, s": max(waits)}


def _wait_for_verdict(page: Page, errors: list[str]) -> float:
    """Seconds until the final verdict is that of the point in the address bar."""
    began = time.monotonic()
    page.wait_for_timeout(500)  # until the address is updated
    try:
        page.wait_for_function(_VERDICT_IS_CURRENT, timeout=60_000)
    except TimeoutError as error:
        said = {name: page.locator(name).inner_text() for name in ("#busy", "#message", "#verdict")}
        raise RuntimeError(f"no answer at {page.evaluate('location.search')}: {said}; {errors}") from error
    return time.monotonic() - began


_VERDICT_IS_CURRENT = """() => {
  const verdict = document.querySelector(".verdict[data-final='1'] .label span")
  if (!verdict) return false
  const shown = verdict.innerText.split(", ").map((part) => Number(part.split("= ")[1]))
  const asked = new URLSearchParams(location.search).get("at").split(",").map(Number)
  return asked.every((value, i) => Math.abs(value - shown[i]) <= 1e-5 * Math.max(1, Math.abs(value)))
}"""


def _memory(process: psutil.Process, page: Page) -> dict[str, float]:
    """MiB of the server and of its two worker processes, and of the page's script after garbage collection."""
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    heap = session.send("Runtime.getHeapUsage")["usedSize"]
    session.detach()
    sizes = {"server": process.memory_info().rss, "page": heap}
    for name, child in zip(("points", "maps"), process.children(), strict=True):
        sizes[name] = child.memory_info().rss
    return {name: round(size / 2**20, 1) for name, size in sizes.items()}


def _act_at_random(page: Page, chance: random.Random, count: int) -> None:
    """Perform ``count`` random actions of a visitor."""
    frame = inside(page)

    def random_point() -> tuple[float, float]:
        return (frame["left"] + chance.random() * frame["width"], frame["top"] + chance.random() * frame["height"])

    for _ in range(count):
        what = chance.choice(("click", "click", "click", "drag", "wheel", "slide", "key", "reset"))
        if what == "click":
            page.mouse.click(*random_point())
        elif what == "drag":
            page.mouse.move(*random_point())
            page.mouse.down()
            page.mouse.move(*random_point(), steps=5)
            page.mouse.up()
        elif what == "wheel":
            page.mouse.move(*random_point())
            page.mouse.wheel(0, chance.choice((-200, 200)))
        elif what == "slide":
            slider = page.locator(f".field-{chance.choice(('omega', 'q0'))} input[type=range]")
            if (box := slider.bounding_box()) is not None:  # None while its form is replaced
                page.mouse.click(box["x"] + box["width"] * chance.random(), box["y"] + box["height"] / 2)
        elif what == "key":
            page.mouse.click(*random_point())
            page.keyboard.press(chance.choice(("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown")))
        else:
            page.locator("select[name=select-preset]").select_option(index=chance.randrange(1, 4))
        page.wait_for_timeout(chance.choice((50, 200, 800)))


def _summary(found: list[tuple[str, float]]) -> dict[str, object]:
    """Statistics of times (label of the motion, ms), for all and by kind of motion."""
    chaotic = [ms for label, ms in found if label == "chaotic"]
    others = [ms for label, ms in found if label != "chaotic"]
    return {
        **_spread([ms for _, ms in found]),
        "chaotic": chaotic and statistics.median(chaotic), "others": others and statistics.median(others),
        "points": len(found), "chaotic points": len(chaotic),
    }


def measure(points: int, timeout: float) -> Iterator[tuple[str, object]]:
    """All response times: name and statistics."""
    with served() as (url, _), browser() as chromium:
        opened(chromium, url).close()
        for rest, when in ((True, "at rest"), (False, "while others compute")):
            for kind in KINDS:
                yield f"click to motion, {kind}, {when}, ms", _summary(clicks(chromium, url, kind, points, rest))
            yield f"slider to portrait, {when}, ms", _spread(slider_moves(chromium, url, points, rest))
        yield "first map with another damping, s", _spread(first_maps(chromium, url, points))
        for kind in KINDS:
            yield f"map, {kind}, s", maps(chromium, url, kind, timeout)


def _spread(found: list[float]) -> dict[str, float]:
    """Median and maximum."""
    return {"median": statistics.median(found), "most": max(found)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, help="instead, act at random for this time")
    parser.add_argument("--steps", action="store_true", help="instead, the stages of answers at rest")
    parser.add_argument("--count", type=int, default=20, help="clicks and slider moves")
    parser.add_argument("--timeout", type=float, default=60, help="for each stage of a map, s")
    chosen = parser.parse_args()
    list(warmup())
    answers = steps(chosen.count) if chosen.steps else measure(chosen.count, chosen.timeout)
    for name, found in endurance(chosen.minutes) if chosen.minutes else answers:
        print(f"{name}: {json.dumps(found)}", flush=True)


if __name__ == "__main__":
    main()
