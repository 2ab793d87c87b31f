"""Recordings with a known truth: the fit finds it, with honest uncertainties, and refuses unusable recordings."""

import contextlib
import io
import json
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import fit
import numpy as np


def csv_text(names, *columns):
    return "\n".join([names, *(",".join(map(str, row)) for row in zip(*columns))]) + "\n"


def pressed(a=40.0, c=0.0, noise=0.1, end=np.inf, seed=1):
    """Five cycles of pressing by F = a G (1 + c G)."""
    random, g = np.random.default_rng(seed), 0.3 * (1 - abs(2 * (np.arange(200) / 40 % 1) - 1))
    force = a * g * (1 + c * g) + noise * random.standard_normal(200)
    shown = np.minimum(g, end - 0.0002 * random.random(200))
    return csv_text("set,sample,force_N,conductance_mS", ["a"] * 200, range(200), force, shown)


def held(runs, rate=0.07, seed=1):
    """Recording of 0 to 12 weights, each held for 15 s in each run; the creep has a time constant of 10 s."""
    random, rows = np.random.default_rng(seed), []
    for run in runs:
        for kg in range(13):
            k = rate * (1 + 0.3 * random.standard_normal())
            for t in np.arange(0.1, 15, 0.2):
                noise = 1 + 0.002 * random.standard_normal()
                rows.append((run, kg, round(t, 3), (1 + 10 * kg) * (1 + k * (1 - np.exp(-t / 10))) * noise))
    return csv_text("run,weight_kg,t_s,conductance_mS", *zip(*rows))


def array(spread=0.2, noise_n=0.005, presses=24, seed=2):
    """Presses by a cap of pressure at random places of a 10 x 10 array with 24 codes for a kPa, and its true gains."""
    gains = 1 / np.clip(1 + spread * np.random.default_rng(77).standard_normal(100), 0.6, 1.6)
    random, rows = np.random.default_rng(seed), []
    middle = (np.arange(10) - 4.5) * 1.5
    for press in range(presses):
        x, y = np.meshgrid(middle - 5 * (random.random() - 0.5), middle - 5 * (random.random() - 0.5))
        for step in range(20):
            kpa = np.maximum(2.4 * step * (1 - (x * x + y * y) / (2 + 2 * step)), 0).ravel()
            codes = np.rint(np.clip(40 + 24 * kpa / gains + 2 * random.standard_normal(100), 0, 4095)).astype(int)
            force = max(kpa.sum() * 2.25e-3 + noise_n * random.standard_normal(), 0.01) if step else 0.0
            rows.append((press, f"{force:.4f}", *codes))
    names = [f"r{row}c{column}" for row in range(10) for column in range(10)]
    return csv_text("press,force_N," + ",".join(names), *zip(*rows)), gains


class Fit(unittest.TestCase):
    def run_script(self, command, text, judge=None):
        """Returns the exit code, the answer of the JSON file or None, and the printed output."""
        with tempfile.TemporaryDirectory() as folder:
            paths = [Path(folder) / name for name in ("fit.csv", "judge.csv", "out.json", "array.toml")]
            paths[0].write_bytes(text if isinstance(text, bytes) else text.encode())
            words = [command, str(paths[0]), "--json", str(paths[2])]
            if judge is not None:
                paths[1].write_text(judge)
                words += ["--judge", str(paths[1])]
            if command == "gains":
                words += ["--parameters", str(paths[3])]
            printed, code = io.StringIO(), 0
            redirects = contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed)
            with redirects[0], redirects[1], mock.patch.object(sys, "argv", ["fit.py", *words]):
                try:
                    fit.main()
                except SystemExit as left:
                    code = left.code
            self.parameters = paths[3].read_text() if paths[3].exists() else ""
            return code, json.loads(paths[2].read_text()) if paths[2].exists() else None, printed.getvalue()

    def test_characteristic(self):
        _, answer, printed = self.run_script("fit", pressed(24, 7, 0.2), pressed(24, 7, 0.2, seed=2))
        found = answer["characteristic"]["sets"][0]
        self.assertEqual(found["chosen"], "curve")
        self.assertAlmostEqual(found["force_per_conductance_n_per_ms"], 24, delta=1.2)
        self.assertAlmostEqual(found["growth_per_ms"], 7, delta=0.7)
        self.assertAlmostEqual(found["judged"]["rms_n"], 0.2, delta=0.05)
        self.assertIn("chosen: curve", printed)
        # Conductance that grows faster than the force must not get a curve: it would turn back.
        for seed in range(10):
            _, answer, _ = self.run_script("fit", pressed(c=0 if seed else -1, noise=0.5, seed=seed))
            found = answer["characteristic"]["sets"][0]
            self.assertEqual((found["chosen"], found["growth_per_ms"]), ("line", 0), seed)

    def test_converter_end(self):
        # The end that the first recording shows counts for the second one, too.
        _, answer, _ = self.run_script("fit", pressed(c=2, end=0.2), pressed(c=2, seed=9))
        found = answer["characteristic"]["sets"][0]
        self.assertGreater(min(found["left_out"], found["judged"]["left_out"]), 20)
        self.assertLess(found["judged"]["rms_n"], 0.15)

    def test_creep(self):
        wrong = "".join(f"x,{kg}.5,{t},{10 + t}\n" for kg in range(1, 4) for t in range(12))
        for more in ("", wrong):
            _, answer, _ = self.run_script("fit", held("ab") + more, held("c", seed=7))
            found = answer["creep"]
            self.assertAlmostEqual(found["rate"] / 0.07, 1, delta=0.25)
            self.assertGreater(found["judged"]["drift_percent"], 4.5)
            self.assertLess(found["judged"]["drift_left_percent"], 2)
            self.assertEqual((len(found["judged"]["holds"]), found["judged"]["left_out"]), (12, 1))
        for seed in range(10):
            _, answer, _ = self.run_script("fit", held("abc", rate=0, seed=seed))
            self.assertEqual((answer["creep"]["chosen"], answer["creep"]["rate"]), ({"form": "none"}, 0), seed)

    def test_gains(self):
        # docs/sensor.md has these errors without and with gains, as percent of the largest force.
        for spread, without, with_gains in (0.05, 0.34, 0.19), (0.1, 0.62, 0.20), (0.2, 1.19, 0.20):
            text, gains = array(spread)
            _, answer, _ = self.run_script("gains", text, array(spread, seed=3, presses=8)[0])
            sigmas = np.array(answer["relative_sigmas"], float)
            known = sigmas > 0
            ratios, sigmas = np.array(answer["gains"])[known] / gains[known], sigmas[known]
            off = abs(ratios / ratios.mean() - 1)
            self.assertGreater(known.sum(), 40)
            # The force is a sum of some forty taxels: it determines the gain of a single taxel poorly.
            self.assertLess(fit.rms(off), 0.9 * spread)
            self.assertGreater((off < 2 * sigmas).mean(), 0.75)
            self.assertAlmostEqual(answer["judged"]["without_percent"], without, delta=0.01)
            self.assertAlmostEqual(answer["judged"]["with_percent"], with_gains, delta=0.01)
            self.assertAlmostEqual(answer["codes_per_kpa_milli"] / 24_000, 1, delta=0.05)
            self.assertEqual(self.parameters.count("\nrow_"), 10)
        for text in array(spread=0)[0], array(noise_n=0.5)[0]:
            _, answer, _ = self.run_script("gains", text)
            self.assertEqual((answer["supported"], set(answer["gains"])), (False, {1.0}))

    def test_refusals(self):
        cycles, weights, presses = pressed(), held("a"), array(presses=4)[0]
        header = cycles.splitlines()[0] + "\n"

        def line(number, text, to):
            lines = text.splitlines()
            return "\n".join([*lines[: number - 1], to, *lines[number:]])

        def rows(force, conductance):
            return header + "".join(f"a,{at},{force(at)},{conductance(at)}\n" for at in range(50))

        for command, text, *words in [
            ("fit", "", "line 1", "name the columns"),
            ("fit", header, "line 2", "no rows"),
            ("fit", cycles.encode() + b"\xff", "line 202", "not text"),
            ("fit", cycles.replace(",", ";"), "line 1", "with commas"),
            ("fit", cycles.replace("set", "sample", 1), "line 1", "0 columns are named set"),
            ("fit", cycles.replace("set", "set,set", 1).replace("a,", "a,a,"), "line 1", "2 columns are named set"),
            ("fit", line(7, cycles, "a,5,NaN,0.1"), "line 7", "force_N is NaN"),
            ("fit", line(7, cycles, 'a,5,"1,5",0.1'), "line 7", "decimal point"),
            ("fit", line(7, cycles, "a,5,1e300,0.1"), "line 7", "unit"),
            ("fit", line(7, cycles, "a,5,1.0"), "line 7", "3 fields where the header has 4"),
            ("fit", line(7, cycles, "a,3,1.0,0.1"), "line 7", "sample 3 of a after 4"),
            ("fit", header + "a,0,1,2\n", "line 2", "1 readings"),
            ("fit", rows(lambda at: at, lambda at: 50 - at), "line 2", "does not grow"),
            ("fit", rows(lambda at: at, lambda at: 0), "line 2", "does not grow"),
            ("fit", rows(lambda at: 5, lambda at: at), "line 2", "record from no force"),
            ("fit", rows(lambda at: -at, lambda at: -at), "line 2", "record from no force"),
            ("fit", rows(lambda at: at, lambda at: min(at, 10)), "line 2", "10 readings are below"),
            ("fit", line(100, weights, "a,1,0.5,12"), "line 100", "t_s of 0.5 after"),
            ("fit", line(100, weights, "a,-1,0.5,12"), "line 100", "weight_kg is -1"),
            ("fit", line(100, weights, "a,1,4.8,0"), "line 100", "0 mS"),
            ("fit", "\n".join(weights.splitlines()[:80]), "line 77", "4 readings"),
            ("fit", "\n".join(weights.splitlines()[:226]), "line 2", "2 holds"),
            ("gains", presses.replace("r4c4", "other"), "line 1", "r4c4"),
            ("gains", presses.replace(",40,", ",5000,", 1), "0 to 4095"),
            ("gains", presses.replace("\n1,0.", "\n1,-9.", 1), "zero the load cell"),
            ("gains", presses.replace(",0.0000,", ",1.0,"), "0 rows without a force"),
            ("gains", array(presses=2)[0] + "\n".join(presses.splitlines()[1:2] * 3), "2 presses"),
        ]:
            code, answer, printed = self.run_script(command, text)
            self.assertEqual((code, answer), (2, None), words)
            for word in [*words, "fit.csv"]:
                self.assertIn(word, printed)
        for judge, word in (cycles.replace("\na,", "\nb,"), "the set b is not in"), (weights, "columns are named set"):
            code, answer, printed = self.run_script("fit", cycles, judge)
            self.assertEqual((code, answer), (2, None))
            self.assertIn(word, printed)

    def test_byte_order_mark_and_line_ends(self):
        plain = self.run_script("fit", pressed())[1]
        marked = self.run_script("fit", b"\xef\xbb\xbf" + pressed().replace("\n", "\r\n").encode())[1]
        self.assertEqual(plain["characteristic"], marked["characteristic"])


if __name__ == "__main__":
    unittest.main()
