"""Fits the firmware's model of a real sensor to recordings: characteristic or creep (`fit`), gains (`gains`).

`cargo xtask sensor` runs this script. docs/sensor.md describes the recordings, the methods and the results.
"""

import argparse
import csv
import json
import re
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

CYCLES = ["set", "sample", "force_N", "conductance_mS"]
HOLDS = ["run", "weight_kg", "t_s", "conductance_mS"]


class Refusal(Exception):
    """File, line, reason and remedy of a recording that cannot be used."""


class Table:
    """A recording: rows of a CSV file, whose columns are found by name."""

    def __init__(self, path):
        self.path, self.lines, rows = path, [], []
        try:
            text = Path(path).read_bytes().decode("utf-8-sig")
        except OSError as error:
            raise Refusal(f"{path}: cannot be read ({error.strerror}): name a CSV file that exists") from None
        except UnicodeDecodeError as error:
            line = error.object[: error.start].count(b"\n") + 1
            raise Refusal(f"{path}, line {line}: not text in UTF-8: save the recording as CSV in UTF-8") from None
        reader = csv.reader(text.splitlines())
        self.header = [name.strip() for name in next(reader, [])]
        for row in filter(None, reader):
            why = f"{len(row)} fields where the header has {len(self.header)}: complete the line or remove it"
            self.check(len(row) == len(self.header), reader.line_num, why)
            self.lines.append(reader.line_num)
            rows.append([field.strip() for field in row])
        self.columns = dict(zip(self.header, zip(*rows)))

    def check(self, good, line, why):
        """Refuses a line of the file if it is not good."""
        if not good:
            raise Refusal(f"{self.path}, line {line}: {why}")

    def require(self, names):
        """Refuses a file without rows, or without exactly one column of each name."""
        for name in names:
            why = f"{self.header.count(name)} columns are named {name}: name the columns {','.join(names)}"
            self.check(self.header.count(name) == 1, 1, f"{why}, with commas between them")
        self.check(self.lines, 2, "no rows after the header: give a recording")

    def numbers(self, name, low=-1e7, high=1e7):
        """Returns a column of numbers; no load cell, weight, clock or taxel shows more than 1e7."""
        for line, text in zip(self.lines, self.columns[name]):
            try:
                why = f"{name} is {text}, not within {low:g} to {high:g}: correct the unit or remove the row"
                self.check(low <= float(text) <= high, line, why)
            except ValueError:
                why = f'{name} is "{text}", not a number: write it with a decimal point or remove the row'
                self.check(False, line, why)
        return np.array(self.columns[name], float)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


# The characteristic: force F in N over conductance G in mS.

# Force, and ranges of the parameters after a for the largest conductance. The firmware has the first two forms.
FORMS = {
    "line": (lambda g, a: a * g, lambda top: []),
    "curve": (lambda g, a, c: a * g * (1 + c * g), lambda top: [(0, 8 / top)]),
    "series": (lambda g, a, b: a * g / np.maximum(1 - b * g, 0.01), lambda top: [(0, 0.95 / top)]),
    "power": (lambda g, a, n: a * np.maximum(g, 0) ** n, lambda top: [(0.2, 4)]),
    "cubic": (lambda g, a, b, c: g * (a + g * (b + g * c)), lambda top: [(-1e9, 1e9)] * 2),
}


def sets(table, ends):
    """Yields name, line, readings, number of readings left out and converter's end of each set.

    `ends` has the ends that another recording by the same converter has shown.
    """
    table.require(CYCLES)
    sample, force, conductance = (table.numbers(name) for name in CYCLES[1:])
    names = np.array(table.columns["set"])
    for name in dict.fromkeys(table.columns["set"]):
        at = np.flatnonzero(names == name)
        for before, row in zip(at, at[1:]):
            why = f"sample {sample[row]:g} of {name} after {sample[before]:g}: sort the rows by time"
            table.check(sample[row] > sample[before], table.lines[row], why)
        line, f, g = table.lines[at[0]], force[at], conductance[at]
        table.check(len(f) >= 20, line, f"{name}: {len(f)} readings, 20 are needed: record some cycles of pressing")
        why = f"{name}: force of {f.min():g} to {f.max():g} N: record from no force to the largest, which is positive"
        table.check(np.ptp(f) >= 0.5 * f.max() > 0, line, why)
        (f_square, product), (_, g_square) = np.cov(f, g)
        why = f"{name}: the conductance does not grow with the force: check the columns, conductance is 1/R of a taxel"
        table.check(product > 0.5 * np.sqrt(f_square * g_square) and f @ g > 0, line, why)
        # At the converter's end many readings are alike while the force changes.
        end = 0.995 * g.max()
        top = f[g >= end]
        at_end = len(top) >= max(5, 0.02 * len(f)) and np.ptp(top) >= 0.1 * f.max()
        end = min(end if at_end else np.inf, ends.get(name, np.inf))
        kept = g < end
        why = f"{name}: {kept.sum()} readings are below the converter's end, 20 are needed"
        table.check(kept.sum() >= 20, line, f"{why}: press less, or read through a smaller resistor")
        yield name, line, f[kept], g[kept], int((~kept).sum()), end


def cycles(force):
    """Returns the part of each reading for the cross-validation: its cycle of pressing, or a fifth of the time."""
    up, cycle, parts = False, 0, []
    for share in force / force.max():
        up |= share > 0.4
        if up and share < 0.1:
            up, cycle = False, cycle + 1
        parts.append(cycle)
    return np.array(parts) if cycle >= 2 else np.arange(len(force)) * 5 // len(force)


def fit_form(name, f, g):
    """Returns the parameters of least squares."""
    force, ranges = FORMS[name][0], FORMS[name][1](g.max())
    start = [f @ g / (g @ g), *map(np.mean, ranges)]
    bounds = np.array([(-np.inf, np.inf), *ranges]).T
    return least_squares(lambda x: force(g, *x) - f, start, bounds=bounds, x_scale="jac", ftol=1e-12, xtol=1e-12).x


def try_form(name, f, g, parts):
    """Returns a form's row of the report, and the mean square of the force's error on each part left out."""

    def error(at, fitted):
        return FORMS[name][0](g[at], *fit_form(name, f[fitted], g[fitted])) - f[at]

    every, outs = parts >= 0, [parts == part for part in range(parts.max() + 1)]
    squares = np.array([np.mean(error(out, ~out) ** 2) for out in outs])
    return {
        "form": name,
        "in_firmware": name in ("line", "curve"),
        "parameters": fit_form(name, f, g).tolist(),
        "fitted_percent": 100 * rms(error(every, every)) / f.max(),
        "unseen_percent": 100 * np.sqrt(squares @ np.bincount(parts) / len(f)) / f.max(),
        "worst_part_percent": 100 * np.sqrt(squares.max()) / f.max(),
    }, squares


def fit_characteristic(table, other):
    found, ends = {}, {}
    for name, _, f, g, left_out, end in sets(table, {}):
        parts = cycles(f)
        forms, (line, *others) = zip(*(try_form(form, f, g, parts) for form in FORMS))
        better = [(squares < line).mean() > 0.5 and squares.mean() < 0.95 * line.mean() for squares in others]
        for form, supported in zip(forms, [True, *better]):
            form["supported"] = bool(supported)
        chosen = forms[int(forms[1]["supported"])]
        ends[name] = end
        found[name] = {
            "set": name,
            "readings": len(f),
            "left_out": left_out,
            "largest_force_n": f.max(),
            "largest_conductance_ms": g.max(),
            "chosen": chosen["form"],
            "force_per_conductance_n_per_ms": chosen["parameters"][0],
            "growth_per_ms": [*chosen["parameters"], 0.0][1],
            "forms": list(forms),
            "judged": None,
        }
    for name, line, f, g, left_out, _ in sets(other, ends) if other else []:
        other.check(name in found, line, f"the set {name} is not in {table.path}: add it there, or remove it here")
        fit = found[name]
        error = rms(FORMS["curve"][0](g, fit["force_per_conductance_n_per_ms"], fit["growth_per_ms"]) - f)
        fit["judged"] = {
            "readings": len(f),
            "left_out": left_out,
            "largest_force_n": f.max(),
            "rms_n": error,
            "rms_percent": 100 * error / f.max(),
        }
    return {"characteristic": {"sets": list(found.values())}}


# The creep: conductance under a held weight, G = G_0 (1 + sum of k_i f_i(t)).

CREEPS = [
    {"form": "none"},
    *({"form": "lag", "time_constant_s": tau} for tau in (2.0, 5.0, 10.0, 20.0, 50.0, 100.0)),
    *({"form": "two_lags", "time_constant_s": tau} for tau in (10.0, 20.0, 50.0)),
    {"form": "logarithm"},
]


def grown(t, form, time_constant_s=1.0):
    """Returns f_i of the time in s."""
    slow, quick = (1 - np.exp(-t / constant) for constant in (time_constant_s, time_constant_s / 10))
    return {"none": [], "lag": [slow], "two_lags": [slow, quick], "logarithm": [np.log1p(t)]}[form]


def holds(table):
    """Returns run, weight, times and conductances of each hold, and the number of holds without a weight."""
    table.require(HOLDS)
    weight, time = (table.numbers(name, low=0) for name in HOLDS[1:3])
    g, runs, starts = table.numbers(HOLDS[3]), table.columns["run"], [0]
    for row in range(1, len(runs)):
        # The time restarts when the same weight is put down again.
        if (runs[row], weight[row]) != (runs[row - 1], weight[row - 1]) or time[row] <= time[starts[-1]]:
            starts.append(row)
        else:
            why = f"t_s of {time[row]:g} after {time[row - 1]:g}: sort the rows by run, weight and time"
            table.check(time[row] > time[row - 1], table.lines[row], why)
    found = []
    for start, end in zip(starts, [*starts[1:], len(runs)]):
        if weight[start] > 0:
            t, name = time[start:end], f"{weight[start]:g} kg of {runs[start]}"
            why = f"{name}: {len(t)} readings in {np.ptp(t):.1f} s, 10 in 3 s are needed: sort the rows, or hold longer"
            table.check(len(t) >= 10 and np.ptp(t) >= 3, table.lines[start], why)
            row = start + g[start:end].argmin()
            why = f"{name}: a conductance of {g[row]:g} mS: a taxel under a weight conducts, check the columns"
            table.check(g[row] > 0, table.lines[row], why)
            found.append((runs[start], weight[start], t, g[start:end]))
    table.check(len(found) >= 3, 2, f"{len(found)} holds under a weight, 3 are needed: hold more weights")
    return found, len(starts) - len(found)


def rates(form, t, g):
    """Returns k_i of one hold by least squares."""
    fit = np.linalg.lstsq(np.stack([np.ones_like(t), *grown(t, **form)], axis=1), g)[0]
    return fit[1:] / fit[0]


def trimmed_mean(values):
    """Returns the mean without the lowest and the highest fifth: a hold that went wrong does not move it."""
    cut = len(values) // 5
    return np.sort(values, axis=0)[cut : len(values) - cut].mean(axis=0)


def correct(form, rate, t, g):
    """Returns the conductance of a hold without its creep."""
    return g / np.maximum(1 + sum(k * f for k, f in zip(rate, grown(t, **form))), 0.1)


def drift_percent(g):
    return 100 * (g[-1] / g[0] - 1)


def try_creep(form, found, parts):
    """Returns a form's row of the report."""
    each = np.array([rates(form, t, g) for _, _, t, g in found])
    left, ripple, better = [], [], 0
    for (_, _, t, g), part in zip(found, parts):
        corrected = correct(form, trimmed_mean(each[parts != part]), t, g)
        left.append(abs(drift_percent(corrected)))
        ripple.append(100 * rms(corrected / corrected.mean() - 1))
        better += int(left[-1] < abs(drift_percent(g)))
    return {
        **form,
        "in_firmware": form["form"] in ("none", "lag"),
        "rates": [*trimmed_mean(each).tolist(), 0.0, 0.0][:2],
        "unseen_drift_percent": np.median(left),
        "unseen_rms_percent": np.median(ripple),
        "better_holds": better,
        # Half of the holds become better by chance; this is more by two standard deviations.
        "supported": better > len(found) / 2 + len(found) ** 0.5,
    }


def fit_creep(table, other):
    found, left_out = holds(table)
    runs = [hold[0] for hold in found]
    by_run = len(set(runs)) > 1
    parts = np.array([runs.index(run) for run in runs] if by_run else np.arange(len(runs)) % 5)
    forms = [try_creep(form, found, parts) for form in CREEPS]
    lags = [row for row in forms if row["form"] == "lag" and row["supported"] and row["rates"][0] > 0]
    best = min((row["unseen_rms_percent"] for row in lags), default=0)
    # Time constants within 5 % of the best are indistinguishable: the shortest extrapolates least beyond the recording.
    chosen = next((row for row in lags if row["unseen_rms_percent"] <= 1.05 * best), forms[0])
    form, rate, judged = CREEPS[forms.index(chosen)], chosen["rates"], None
    if other:
        judged_holds, bare = holds(other)
        keys = "run", "weight_kg", "drift_percent", "drift_left_percent"
        corrected = [correct(form, rate, *hold[2:]) for hold in judged_holds]
        rows = [(*hold[:2], drift_percent(hold[3]), drift_percent(left)) for hold, left in zip(judged_holds, corrected)]
        judged = {"holds": [dict(zip(keys, row)) for row in rows], "left_out": bare}
        judged |= {key: np.median([abs(hold[key]) for hold in judged["holds"]]) for key in keys[2:]}
    figures = {"holds": len(found), "left_out": left_out, "parts": "run" if by_run else "fifth of the holds"}
    return {"creep": {**figures, "chosen": form, "rate": rate[0], "forms": forms, "judged": judged}}


# Gains of the taxels and the scale: F = a sum(g_i u_i) for codes u above tare.

# Strengths with which gains are drawn to 1, as shares of the mean information about a taxel; the last fits no gains.
PULLS = [1e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 1.0, np.inf]
CODE_MAX, PITCH_MM, GAIN_ONE = 4095, 1.5, 16_384


def presses(table):
    """Returns shape of the array, forces, codes above tare, parts, and number of rows left out."""
    places = [match.groups() for match in (re.fullmatch(r"r(\d+)c(\d+)", name) for name in table.header) if match]
    shape = rows, columns = tuple(np.array(places or [(-1, -1)], int).max(axis=0) + 1)
    why = f"{rows} x {columns} taxels: name the columns r0c0 to r9c9, say; 3 x 3 to 16 x 32 fit"
    table.check(3 <= rows <= 16 and 3 <= columns <= 32, 1, why)
    taxels = [f"r{row}c{column}" for row in range(rows) for column in range(columns)]
    table.require(["force_N", *taxels])
    force = table.numbers("force_N")
    codes = np.stack([table.numbers(name, 0, CODE_MAX) for name in taxels], axis=1)
    row = force.argmin()
    why = f"force_N is {force[row]:g}: zero the load cell free of the tip, pushing is above 0"
    table.check(force[row] >= -0.02 * force.max() - 0.02, table.lines[row], why)
    free = force <= 0.002 * force.max()
    table.check(free.sum() >= 3, 2, f"{free.sum()} rows without a force, 3 are needed: they give the tare")
    kept = ~free & (codes < CODE_MAX).all(axis=1)
    count = int(kept.sum())
    why = f"{count} rows with a force, 30 are needed: press at several places, with up to the force that is to be held"
    table.check(count >= 30, 2, why)
    parts = np.arange(count) * 5 // count
    if "press" in table.header:
        parts = np.unique(np.array(table.columns["press"])[kept], return_inverse=True)[1]
    table.check(parts.max() >= 2, 2, f"{parts.max() + 1} presses, 3 are needed: press at different places")
    return shape, force[kept], codes[kept] - codes[free].mean(axis=0), parts, int((~free).sum()) - count


def ridge(force, codes, pull):
    """Returns newtons for a code, gains, the share of each gain that stays unknown, and the pull in N^2."""
    total = codes.sum(axis=1)
    per_code, ones = total @ force / (total @ total), np.ones(codes.shape[1])
    if np.isinf(pull):
        return per_code, ones, ones, np.inf
    readings = per_code * codes
    normal = readings.T @ readings
    strength = pull * np.trace(normal) / len(ones)
    inverse = np.linalg.inv(normal + strength * np.eye(len(ones)))
    gains = 1 + inverse @ readings.T @ (force - per_code * total)
    return per_code, gains, np.sqrt(inverse.diagonal() * strength), strength


def unseen(force, codes, parts, pull):
    """Returns the root mean square of the force's error with each part left out in turn."""
    errors = []
    for part in range(parts.max() + 1):
        out = parts == part
        per_code, gains, *_ = ridge(force[~out], codes[~out], pull)
        errors.append(per_code * codes[out] @ gains - force[out])
    return rms(np.concatenate(errors))


def fit_gains(table, other):
    shape, force, codes, parts, left_out = presses(table)
    plain = ridge(force, codes, np.inf)
    why = "the codes do not grow with the force: is force_N of the same instant as the codes?"
    table.check(plain[0] > 0, 2, why)
    errors = [unseen(force, codes, parts, pull) for pull in PULLS]
    supported = bool(min(errors) < 0.9 * errors[-1])
    best = int(np.argmin(errors)) if supported else -1
    per_code, gains, left, strength = ridge(force, codes, PULLS[best])
    known = left < 0.95
    # What the known gains have in common belongs to the scale.
    mean = gains[known].mean() if known.any() else 1.0
    per_code, gains = per_code * mean, np.where(known, np.clip(gains / mean, 0.5, 32_767 / GAIN_ONE), 1)
    scale = round(PITCH_MM**2 / per_code)
    why = f"codes_per_kpa_milli of {scale} is not within 1000 to 200000: is force_N in newtons, of the whole contact?"
    table.check(1_000 <= scale <= 200_000, 2, why)
    judged = None
    if other:
        other_shape, f, u, *_ = presses(other)
        why = f"{other_shape} taxels, not {shape}: judge on a recording of the same array"
        other.check(other_shape == shape, 1, why)
        judged = {
            "file": other.path,
            "readings": len(f),
            "without_percent": 100 * rms(plain[0] * u @ plain[1] - f) / f.max(),
            "with_percent": 100 * rms(per_code * u @ gains - f) / f.max(),
        }
    sigmas = left * errors[best] / np.sqrt(strength)
    return {
        "rows": int(shape[0]),
        "columns": int(shape[1]),
        "readings": len(force),
        "left_out": left_out,
        "parts": int(parts.max()) + 1,
        "largest_force_n": force.max(),
        "without_percent": 100 * errors[-1] / force.max(),
        "with_percent": 100 * errors[best] / force.max(),
        "supported": supported,
        "gains": gains.tolist(),
        "relative_sigmas": [float(sigma) if ok else None for sigma, ok in zip(sigmas, known)],
        "codes_per_kpa_milli": scale,
        "judged": judged,
    }


def parameters(found):
    """Returns gains and scale as `fingertip params restore` reads them."""
    text = f"# From {found['readings']} readings under a load cell, by `cargo xtask sensor gains`.\n\n"
    text += f"[parameters]\ncodes_per_kpa_milli = {found['codes_per_kpa_milli']}\n\n[gains]\n"
    for row, gains in enumerate(np.array(found["gains"]).reshape(found["rows"], -1)):
        text += f"row_{row} = [{', '.join(str(round(gain * GAIN_ONE)) for gain in gains)}]\n"
    return text


def report(answer, indent=""):
    """Yields the lines of an answer as text, with the keys of the JSON file."""
    for key, value in answer.items():
        many = isinstance(value, list)
        if isinstance(value, dict):
            yield f"{indent}{key}:"
            yield from report(value, indent + "  ")
        elif key == "sets":
            for row in value:
                yield from report(row, indent)
        elif many and isinstance(value[0], dict):
            keys = list(max(value, key=len))
            cells = [keys, *([short(row.get(key)) for key in keys] for row in value)]
            widths = [max(map(len, column)) for column in zip(*cells)]
            yield f"{indent}{key}:"
            yield from (f"{indent}  " + "  ".join(map(str.rjust, row, widths)) for row in cells)
        elif many:
            yield f"{indent}{key}:"
            for row in np.array(value).reshape(answer["rows"], -1):
                yield f"{indent}  " + " ".join(f"{short(cell):>7}" for cell in row)
        else:
            yield f"{indent}{key}: {short(value)}"


def short(value):
    if isinstance(value, list):
        return "  ".join(map(short, value))
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "-"}[value]
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def run(options):
    """Fits; returns the answer, and the text of each output file."""
    table = Table(options.fit)
    other = Table(options.judge) if options.judge else None
    if options.command == "gains":
        answer = fit_gains(table, other)
        return answer, {options.json: json.dumps(answer, indent=2) + "\n", options.parameters: parameters(answer)}
    # The columns identify the kind of the recording.
    creep = len({*HOLDS} & {*table.header}) > len({*CYCLES} & {*table.header})
    found = (fit_creep if creep else fit_characteristic)(table, other)
    answer = {"fitted": options.fit, "judged_on": options.judge, **found}
    return answer, {options.json: json.dumps(answer, indent=2) + "\n"}


def main():
    parser = argparse.ArgumentParser(
        prog="cargo xtask sensor",
        description="Fits what the firmware knows of a sensor to recordings; docs/sensor.md has columns and methods.",
        epilog="Exits with 0, or with 2 where a file cannot be used: nothing is written then.",
    )
    commands = parser.add_subparsers(dest="command", required=True)
    for name, about in ("fit", "characteristic or creep, by the columns"), ("gains", "gains of the taxels, and scale"):
        command = commands.add_parser(name, help=about)
        command.add_argument("fit", metavar="FIT.csv", help="recording to fit to")
        command.add_argument("--judge", metavar="JUDGE.csv", help="recording of the same sensor to judge on")
        command.add_argument("--json", metavar="FILE", help="writes every figure, its unit in the key's name")
    command.add_argument("--parameters", metavar="FILE", help="writes what `fingertip params restore` reads")
    try:
        answer, files = run(parser.parse_args())
        for path in filter(None, files):
            Path(path).write_text(files[path], encoding="utf-8")
    except OSError as error:
        sys.exit(print(f"error: {error.filename} cannot be written ({error.strerror})", file=sys.stderr) or 2)
    except Refusal as refusal:
        sys.exit(print(f"error: {refusal}", file=sys.stderr) or 2)
    print("\n".join(report(answer)))


if __name__ == "__main__":
    main()
