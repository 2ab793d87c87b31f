"""Reports in a real browser, light and dark, on a screen and on a phone, at rest and in use.

`cargo xtask test` installs the browser and starts this. The state of the page is judged, never the time. The pictures
of the pages lie in `target/tmp/report`.
"""

import os
import re
import shutil
import subprocess
import unittest
from pathlib import Path

from playwright.sync_api import sync_playwright

HERE = Path(__file__).parent
SCENES = HERE.parent / "sim/tests/files"
QUESTIONS, SAID = ((HERE / f"{name}.js").read_text() for name in ("questions", "said"))
FOLDER = Path(os.environ["FINGERTIP_REPORTS"])

# A silence after which the browser counts as hung, ms; the slowest machine needs a small part of it.
HUNG_MS = 7_200_000
# Frames after which a wait for a page fails: some minutes, more on a slow machine.
FRAMES = 10_000
SCREEN = {"viewport": {"width": 1280, "height": 900}}
PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}
# Parts that a report has.
SECTIONS = ["bounds", "plots", "metrics", "ledger", "scene"]
# Characters of a page that is not empty, at least.
LETTERS = 500

WHOLE = "document.getElementById('whole').disabled"
OVER = ".plot .u-over"
OTHERS = """[...document.querySelectorAll('.u-legend .u-label')]
    .filter(label => label.textContent.includes('other run')).length"""
NOTE = "document.getElementById('over-note').textContent"


def setUpModule():
    global browser
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    driver = sync_playwright().start()
    unittest.addModuleCleanup(driver.stop)
    # What the browser would leave in the user's home goes to the folder.
    home = {**os.environ, "HOME": str(FOLDER), "XDG_CONFIG_HOME": str(FOLDER), "XDG_CACHE_HOME": str(FOLDER)}
    program = os.environ["FINGERTIP_CHROMIUM"]
    browser = driver.chromium.launch(executable_path=program, args=["--no-sandbox"], env=home, timeout=HUNG_MS)
    unittest.addModuleCleanup(browser.close)


def report(scene, *options, name=None, **changes):
    """Runs a scene of the tests, under another name and with some lines changed; returns the path of its report."""
    text = (SCENES / f"{scene}.toml").read_text()
    for key, line in changes.items():
        text = re.sub(f"(?m)^{key} = .*", lambda _: f"{key} = {line}", text)
    folder = FOLDER / (name or scene).replace("/", "-")
    folder.mkdir(exist_ok=True)
    file = folder / f"{name or scene}.toml"
    file.write_text(text)
    subprocess.run([os.environ["FINGERTIP_SIM"], file, "--out", folder, *options], check=True, capture_output=True)
    return folder / "report.html"


class Page:
    """A page, with the errors on its console and what it fetches beside itself."""

    def __init__(self, test, path, dark=False, scripts=True, **device):
        scheme = "dark" if dark else "light"
        context = browser.new_context(**(device or SCREEN), color_scheme=scheme, java_script_enabled=scripts)
        test.addCleanup(context.close)
        context.set_default_timeout(HUNG_MS)
        self.page, self.events = context.new_page(), []
        self.page.on("pageerror", lambda error: self.events.append(f"exception: {error}"))
        self.page.on("console", self.said_on_console)
        self.page.on("request", lambda request: self.fetches(request.url))
        self.address = path.as_uri()
        self.page.goto(self.address)
        self.evaluate = self.page.evaluate

    def said_on_console(self, message):
        if message.type in ("error", "warning", "assert"):
            self.events.append(f"console: {message.text}")

    def fetches(self, url):
        if url != self.address and not url.startswith("data:"):
            self.events.append(f"fetches {url}")

    def until(self, holds):
        """Waits until an expression holds, evaluated with each frame that the page draws."""
        look = f"({holds}) ? kept() : left-- > 0 ? requestAnimationFrame(look) : broken('it never holds')"
        caught = f"() => {{ try {{ {look}; }} catch (error) {{ broken(error); }} }}"
        self.evaluate(f"let left = {FRAMES}; new Promise((kept, broken) => {{ const look = {caught}; look(); }})")

    def state(self):
        return self.evaluate(SAID)

    def range(self):
        """The range that all plots and bars show, s."""
        state = self.state()
        numbers = lambda text: [float(part) for part in text.split()]
        [plot], [bar] = ([numbers(text) for text in state[several]] for several in ("ranges", "bars"))
        # A bar's whole width, 1000, is the run.
        assert abs(bar[0] / bar[2] - plot[0] / (plot[1] - plot[0])) < 1e-6, state
        return plot

    def place(self, selector, right=0.5):
        """Scrolls an element into view. Returns the point at a share of its width, and at half of its height, px."""
        element = self.page.locator(selector).first
        element.evaluate("it => it.scrollIntoView({ block: 'center', behavior: 'instant' })")
        box = element.bounding_box()
        return box["x"] + right * box["width"], box["y"] + box["height"] / 2

    def drag(self, left=0.25, right=0.75):
        start, end = self.place(OVER, left), self.place(OVER, right)
        self.page.mouse.move(*start)
        self.page.mouse.down()
        self.page.mouse.move(*end, steps=5)
        self.page.mouse.up()

    def swipe(self, start, end):
        """Draws a finger over the glass."""
        session = self.page.context.new_cdp_session(self.page)
        points = [tuple(a + n / 5 * (b - a) for a, b in zip(start, end)) for n in range(6)]
        for n, (x, y) in enumerate(points):
            kind = "touchMove" if n else "touchStart"
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y}]})
        session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def slide(self, to):
        """Moves the slider to a position in thousandths of the shown range."""
        slider = "time => { time.value = %d; time.dispatchEvent(new Event('input')); }" % to
        self.page.locator("#time").evaluate(slider)
        return self.state()

    def shoot(self, name):
        picture = FOLDER / f"{name}.png"
        self.page.screenshot(path=picture, full_page=True)
        return picture

    def complaints(self, dark=False, scripts=True):
        """All that is wrong with the page."""
        found = self.evaluate(QUESTIONS)
        least = {"bars": 2, "letters": LETTERS} | ({"charts": 4, "maps": 2, "scales": 1, "controls": 2} if scripts else {})
        parts = {name: found[name] >= count for name, count in least.items()}
        if not scripts:
            # Plots need a script: a note says so, and no control is shown that does nothing.
            parts |= {"note": found["note"], "controls": found["controls"] == 0}
        parts |= {name: found[name] == 0 for name in ("cut", "nameless")}
        parts |= {"title": found["title"] != "", "simulated": found["simulated"]}
        parts |= {"overflow": found["overflow"] <= 0}
        parts |= {f"section {name}": name in found["sections"] for name in SECTIONS}
        paper, ink = (brightness(found[name]) for name in ("page", "text"))
        parts |= {"colours": paper < 0.2 and ink > 0.7 if dark else paper > 0.8 and ink < 0.3}
        wrong = [name for name, right in parts.items() if not right]
        return [f"{name}: {found.get(name)}" for name in wrong] + self.events


def brightness(colour):
    """Brightness of `rgb(r, g, b)`, 0 to 1; NaN of anything else, such as a page without a colour of its own."""
    found = re.fullmatch(r"rgb\((\d+), (\d+), (\d+)\)", colour)
    return sum(map(int, found.groups())) / 765 if found else float("nan")


class AtRest(unittest.TestCase):
    def nothing_is_wrong(self, path, name):
        for device, dark, scripts in [
            (SCREEN, False, True),
            (SCREEN, True, True),
            (PHONE, False, True),
            (PHONE, True, True),
            (SCREEN, False, False),
            (PHONE, True, False),
        ]:
            look = ("phone" if device is PHONE else "screen") + "-dark" * dark + "-still" * (not scripts)
            with self.subTest(look):
                page = Page(self, path, dark, scripts, **device)
                self.assertEqual(page.complaints(dark, scripts), [])
                picture = page.shoot(f"{name}-{look}")
                self.assertGreater(picture.stat().st_size, 20_000, "it shows next to nothing")

    def test_a_report_of_one_finger_has_nothing_wrong(self):
        # The longest name of a metric must fit a phone.
        longest = {"metric": '"over_force_defective_mn"', "min": "0", "max": "1e6"}
        self.nothing_is_wrong(report("wall", "--ablate", name="one", **longest), "one")

    def test_a_report_of_two_fingers_has_nothing_wrong(self):
        self.nothing_is_wrong(report("grasp", "--ablate"), "two")

    def test_whatever_is_wrong_is_found(self):
        def found(text, **look):
            path = FOLDER / "wrong.html"
            path.write_text(f"<!doctype html>{text}")
            return "\n".join(Page(self, path, **look).complaints(**look))

        empty = found("<title></title>")
        for part in ["title: ", "letters: 0", "simulated", "section plots", "charts: 0", "maps: 0"]:
            self.assertIn(part, empty)
        self.assertIn("overflow: ", found("<title>t</title><div style='width:3000px'>x</div>"))
        script = found("<script>console.error('one'); missing()</script>")
        self.assertIn("console: one", script)
        self.assertIn("exception: ", script)
        self.assertIn("fetches file://", found("<img src='nowhere.png'>"))
        self.assertIn("colours", found("<style>body { background: #fff; color: #000 }</style>x", dark=True))
        self.assertIn("nameless: 1", found("<div role='img'></div>"))
        # A canvas with nothing on it is no plot.
        blank = "<div class=plot><div class=drawn><canvas></canvas></div></div><div id=player>x</div>"
        self.assertIn("charts: 0", found(blank))
        still = found(blank, scripts=False)
        self.assertIn("controls: 1", still)
        self.assertIn("note: False", still)


class InUse(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.path = report("wall")

    def open(self, path=None, **device):
        page = Page(self, path or self.path, **device)
        page.until("document.documentElement.dataset.ready")
        return page

    def is_range(self, page, start, end, slack):
        for value, expected in zip(page.range(), (start, end)):
            self.assertAlmostEqual(value, expected, delta=slack)

    def test_a_drag_zooms_all_plots_and_a_double_click_shows_the_whole_run(self):
        page = self.open()
        before = page.state()
        # It opens where the array is pressed, and a dashed line is dashed in the legend.
        self.assertGreater(before["maps"][0][2], 10, "kPa")
        markers = "[...document.querySelectorAll('.u-marker')]"
        self.assertEqual(page.evaluate(markers + ".filter(mark => mark.style.borderStyle === 'dashed').length"), 1)
        start, end = page.range()
        self.assertTrue(start == 0 and end > 0.3 and before["whole"], before)
        page.drag()
        page.until(f"!{WHOLE}")
        self.is_range(page, 0.25 * end, 0.75 * end, 0.01 * end)
        self.assertEqual(len(page.state()["cursors"]), 1)
        page.shoot("zoomed")
        # A drag within the zoomed range zooms further; a double click or a button shows all again.
        zoomed, _ = page.range()
        page.drag()
        page.until(f"Number(document.querySelector('.plot').dataset.from) > {zoomed}")
        self.is_range(page, 0.375 * end, 0.625 * end, 0.01 * end)
        page.page.mouse.dblclick(*page.place(OVER, 0.25))
        page.until(WHOLE)
        self.assertEqual(page.range(), [0, end])
        page.drag()
        page.until(f"!{WHOLE}")
        page.page.click("#whole")
        page.until(WHOLE)
        self.assertEqual(page.range(), [0, end])
        self.assertEqual(page.events, [])

    def test_the_slider_moves_one_cursor_with_values_and_maps(self):
        page = self.open()
        last_s = page.range()[1]
        start, end = page.slide(0), page.slide(1000)
        for state, now_s, slider in [(start, 0, 0), (end, last_s, 1000)]:
            self.assertAlmostEqual(state["now"], now_s, delta=1e-3)
            self.assertEqual((state["slider"], len(state["cursors"]), len(state["times"])), (slider, 1, 1))
            for _, time_s, _ in state["maps"]:
                self.assertAlmostEqual(time_s, now_s, delta=last_s / 100)
        self.assertIn("mode approach", start["states"])
        self.assertIn("mode force", end["states"])
        self.assertEqual([kind for kind, _, _ in start["maps"][:2]], ["true", "codes"])
        [pressed, codes] = [peak for _, _, peak in end["maps"][:2]]
        self.assertTrue(start["maps"][0][2] == 0 and pressed > 10 and codes > 100, end)
        # The values are those of the last stretch: 1 N is held.
        self.assertTrue(any(value.startswith("1 N") for value in end["values"]), end)
        page.shoot("slid")
        # A key does the same.
        page.page.press("#time", "Home")
        page.until("parseFloat(document.getElementById('now').textContent) === 0")

    def test_a_play_moves_the_cursor_and_stops(self):
        page = self.open()
        page.page.click("#play")
        page.until("parseFloat(document.getElementById('now').textContent) > 0.01")
        self.assertEqual(len(page.state()["cursors"]), 1)
        self.assertEqual(page.page.text_content("#play"), "Stop")
        stopped = "document.getElementById('play').textContent === 'Play'"
        page.page.click("#play")
        page.until(stopped)
        # From near the end it plays to the end and stops there.
        page.slide(990)
        page.page.click("#play")
        page.until("document.getElementById('time').value === '1000'")
        page.until(stopped)

    def test_a_finger_on_the_glass_zooms(self):
        page = self.open(**PHONE)
        end = page.range()[1]
        left, right = page.place(OVER, 0.25), page.place(OVER, 0.75)
        page.swipe(left, right)
        page.until(f"!{WHOLE}")
        self.is_range(page, 0.25 * end, 0.75 * end, 0.02 * end)
        page.shoot("touched")
        # Up and down scrolls the page, and zooms nothing.
        before = page.range()
        page.swipe((left[0], left[1] + 40), (left[0] + 4, left[1] - 160))
        self.assertEqual(page.range(), before)
        self.assertEqual(page.events, [])

    def test_another_run_is_laid_over_this_one(self):
        page = self.open()
        plots = page.evaluate("document.querySelectorAll('.plot .drawn').length")
        self.assertEqual(page.evaluate(OTHERS), 0)
        hostile = "<img src=x onerror=\"document.title='taken'\">"
        about = "</script><script>document.title='taken'</script>" + hostile
        other = report("wall", name=hostile, about=f"'''{about}'''")
        page.page.set_input_files("#other", other)
        page.until(NOTE + ".includes('Dotted')")
        self.assertEqual(page.evaluate(OTHERS), plots)
        self.assertEqual(page.state()["maps"][2][0], "over")
        metric = page.evaluate("document.querySelector('[data-metric=peak_force_n] .other-value')?.textContent")
        self.assertTrue(metric and metric.startswith("1"), metric)
        self.assertEqual(page.page.title(), "wall: simulated run")
        page.shoot("laid")
        # The other report can be removed again, and a file that is not a report is refused.
        page.evaluate("document.getElementById('alone').click()")
        self.assertEqual(page.evaluate(OTHERS), 0)
        text, wrong = other.read_text(), FOLDER / "wrong.html"
        for broken, why in [
            ("<p>no report</p>", "no report"),
            (text.replace('"format":1,', '"format":99,'), "format 99"),
            (text.replace('id="run">{', 'id="run">{{'), "wrong.html: "),
            ('<script type="application/json" id="run">{"format":1}</script>', "wrong.html: "),
        ]:
            wrong.write_text(broken)
            page.evaluate(NOTE + " = ''")
            page.page.set_input_files("#other", wrong)
            page.until(NOTE)
            self.assertIn(why, page.evaluate(NOTE))
            self.assertEqual(page.evaluate(OTHERS), 0)
        # One that the page has in itself is there from the start.
        both = self.open(report("wall", "--over", other, name=f"{hostile} again", about=f"'''{about}'''"))
        self.assertEqual(both.evaluate(OTHERS), plots)
        self.assertEqual(both.page.title(), f"{hostile} again: simulated run")
        self.assertEqual(page.events + both.events, [])


if __name__ == "__main__":
    unittest.main()
