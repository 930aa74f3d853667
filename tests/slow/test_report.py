"""The report of an assessment in a browser: on a desk and on a telephone."""

import gearchaos as gc
from gearchaos.datasheet.report import Report, report_html
from tests.branches import PAIR
from tests.slow.browser import NEEDED, SIZES


@NEEDED
def test_nothing_is_wider_than_the_screen_and_nothing_is_loaded(chromium, tmp_path):
    path = tmp_path / "report.html"
    found = gc.assess(PAIR, "10300:10400:2", [50, 80], starts=0)
    reports = [Report(found, name) for name in ("one.toml", "two.toml")]
    path.write_text(report_html(*reports), encoding="utf-8")
    for size in ("desk", "phone"):
        width, height = SIZES[size]
        page, asked, said = chromium.new_page(viewport={"width": width, "height": height}), [], []
        page.on("request", lambda request, asked=asked: asked.append(request.url))
        page.on("console", lambda message, said=said: said.append(message.text))
        page.goto(path.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") == width
        assert asked == [path.as_uri()] and not said
        left, right = (page.locator(".decision > section").nth(k).bounding_box() for k in (0, 1))
        assert (right["x"] > left["x"]) == (size == "desk") and (right["y"] > left["y"]) == (size == "phone")
        page.close()
