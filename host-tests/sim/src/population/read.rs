//! A draw from its text: `{ uniform = [1, 10] }`, and the like.

use super::draw::{Draw, Drawn};
use super::expression::Expression;
use super::{Counted, Population, read};
use crate::metrics::shown;
use crate::population::draw::Spread;
use crate::population::report::{Promise, Ran, Report};
use crate::run::asked;
use crate::scene::error::alike;
use crate::scene::library;
use crate::scene::tables::{EXPECT, SCRIPT};
use std::fmt::Write as _;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value};

/// What is wrong, where, and what is allowed.
pub type Wrong = (Range<usize>, String, String);

/// The ways to draw.
pub const WAYS: [&str; 6] = ["uniform", "log_uniform", "normal", "choice", "is", "by"];
const EXAMPLES: &str = "{ uniform = [1, 10] }, { log_uniform = [0.3, 3] }, { normal = [0, 0.05] } (mean, deviation), \
    { choice = [256, 512], weights = [1, 2] }, { is = \"1000 * modulus_kpa\" }, { by = \"thing\", ball = 0.05, otherwise = 0 }; \
    with follows = \"magnitude\" or \"1 / magnitude\"";

/// Reads draws: at one magnitude, with the variables that were read before.
pub struct DrawReader<'a> {
    /// What `follows` multiplies or divides by.
    pub magnitude: f64,
    /// Variables that may be used.
    pub variables: &'a [(String, Draw)],
}

impl DrawReader<'_> {
    /// What a value says: a draw, or always the same.
    pub fn draw(&self, value: &Value) -> Result<Draw, Wrong> {
        let number = number(value).map(Drawn::Number);
        match (value.as_inline_table(), number.or_else(|| value.as_str().map(|word| Drawn::Word(word.into())))) {
            (Some(table), _) => self.table(table, at(value)),
            (None, Some(always)) => Ok(Draw::Always(always)),
            (None, None) => Err(wrong(value, "this cannot be drawn", EXAMPLES)),
        }
    }

    fn table(&self, table: &InlineTable, place: Range<usize>) -> Result<Draw, Wrong> {
        let mut ways = WAYS.iter().filter_map(|way| Some((*way, table.get(way)?)));
        let (Some((way, value)), None) = (ways.next(), ways.next()) else {
            let given: Vec<&str> = table.iter().map(|(name, _)| name).collect();
            let meant = given.iter().find_map(|name| alike(name, WAYS));
            let meant = meant.map_or(String::new(), |way| format!("; did you mean `{way}`?"));
            return Err((place, format!("a draw has one way to be drawn{meant}"), EXAMPLES.into()));
        };
        let draw = match way {
            "uniform" => Draw::Uniform(self.ends(value)?),
            "log_uniform" => Draw::LogUniform(self.positive(value)?),
            "normal" => Draw::Normal(self.mean(value)?),
            "choice" => self.choice(value, table.get("weights"))?,
            "is" => Draw::Is(self.expression(value)?),
            _ => self.by(table, value)?,
        };
        let known =
            |name: &str| name == way || name == "follows" || way == "by" || way == "choice" && name == "weights";
        if let Some((name, value)) = table.iter().find(|(name, _)| !known(name)) {
            return Err(wrong(value, &format!("`{name}` does not go with `{way}`"), EXAMPLES));
        }
        let words = draw.words().len();
        if words > 0 && words < draw.ends().len() {
            return Err(wrong(value, "a draw is of words or of numbers", "all of them words, or none"));
        }
        Ok(match table.get("follows").map(|value| (value, value.as_str())) {
            None => draw,
            Some((value, _)) if words > 0 => return Err(wrong(value, "words follow nothing", "no `follows`")),
            Some((_, Some("magnitude"))) => Draw::Times(self.magnitude, Box::new(draw)),
            Some((_, Some("1 / magnitude"))) => Draw::Times(1.0 / self.magnitude, Box::new(draw)),
            Some((value, _)) => {
                return Err(wrong(value, "nothing else can be followed", "\"magnitude\" or \"1 / magnitude\""));
            }
        })
    }

    fn pair(&self, value: &Value) -> Result<[f64; 2], Wrong> {
        let numbers: Option<Vec<f64>> = value.as_array().map(|array| array.iter().filter_map(number).collect());
        numbers
            .and_then(|numbers| numbers.try_into().ok())
            .ok_or_else(|| wrong(value, "two numbers are asked for", EXAMPLES))
    }

    fn ends(&self, value: &Value) -> Result<[f64; 2], Wrong> {
        let [low, high] = self.pair(value)?;
        if low <= high {
            return Ok([low, high]);
        }
        Err(wrong(value, &format!("the least, {low}, is above the largest, {high}"), "[least, largest]"))
    }

    fn positive(&self, value: &Value) -> Result<[f64; 2], Wrong> {
        let ends = self.ends(value)?;
        if ends[0] > 0.0 {
            return Ok(ends);
        }
        Err(wrong(value, "a ratio needs ends above 0", "[least, largest], both above 0; or `uniform`"))
    }

    fn mean(&self, value: &Value) -> Result<[f64; 2], Wrong> {
        let [mean, deviation] = self.pair(value)?;
        if deviation >= 0.0 {
            return Ok([mean, deviation]);
        }
        Err(wrong(value, &format!("a deviation of {deviation}"), "[mean, deviation], the deviation 0 or more"))
    }

    fn choice(&self, value: &Value, weights: Option<&Value>) -> Result<Draw, Wrong> {
        let given: Vec<&Value> = value.as_array().map(|array| array.iter().collect()).unwrap_or_default();
        if given.is_empty() {
            return Err(wrong(value, "there is nothing to choose from", "choice = [256, 512, 1024]"));
        }
        let draws = given.into_iter().map(|value| self.draw(value)).collect::<Result<Vec<_>, _>>()?;
        let shares = match weights {
            None => vec![1.0; draws.len()],
            Some(weights) => {
                let all: Vec<f64> =
                    weights.as_array().map(|array| array.iter().filter_map(number).collect()).unwrap_or_default();
                let sound = all.len() == draws.len() && all.iter().all(|w| *w >= 0.0) && all.iter().any(|w| *w > 0.0);
                if !sound {
                    let allowed = format!("{} numbers, none below 0 and one above", draws.len());
                    return Err(wrong(weights, "these are no weights of the choice", &allowed));
                }
                all
            }
        };
        Ok(Draw::Choice(shares.into_iter().zip(draws).collect()))
    }

    fn expression(&self, value: &Value) -> Result<Expression, Wrong> {
        let allowed = "+ - * / and ( ) with numbers and variables of [draw], such as \"1000 * modulus_kpa\"";
        let text = value.as_str().ok_or_else(|| wrong(value, "an expression is a text", allowed))?;
        let expression = Expression::read(text).map_err(|error| wrong(value, &error, allowed))?;
        for name in expression.variables() {
            if !self.known(name, value)?.words().is_empty() {
                return Err(wrong(value, &format!("`{name}` is a word, and cannot be reckoned with"), allowed));
            }
        }
        Ok(expression)
    }

    fn by(&self, table: &InlineTable, value: &Value) -> Result<Draw, Wrong> {
        let name = value.as_str().ok_or_else(|| wrong(value, "`by` names a variable", EXAMPLES))?;
        let words = self.known(name, value)?.words();
        if words.is_empty() {
            return Err(wrong(value, &format!("`{name}` is a number"), "a variable that is a choice of words"));
        }
        let (mut cases, mut otherwise) = (Vec::new(), None);
        for (case, value) in table.iter().filter(|(case, _)| !["by", "follows"].contains(case)) {
            let draw = self.draw(value)?;
            if case == "otherwise" {
                otherwise = Some(Box::new(draw));
            } else if words.contains(&case) {
                cases.push((case.to_owned(), draw));
            } else {
                return Err(wrong(value, &format!("`{name}` is never \"{case}\""), &words.join(", ")));
            }
        }
        let missing = words.iter().find(|word| otherwise.is_none() && cases.iter().all(|(case, _)| case != *word));
        if let Some(missing) = missing {
            return Err(wrong(
                value,
                &format!("nothing is said for \"{missing}\""),
                "a value for each, or `otherwise`",
            ));
        }
        Ok(Draw::By(name.into(), cases, otherwise))
    }

    fn known(&self, name: &str, value: &Value) -> Result<&Draw, Wrong> {
        let found = self.variables.iter().find(|(known, _)| known == name).map(|(_, draw)| draw);
        found.ok_or_else(|| {
            let names: Vec<&str> = self.variables.iter().map(|(name, _)| name.as_str()).collect();
            let meant = alike(name, names.iter().copied());
            let meant = meant.map_or(String::new(), |meant| format!("; did you mean `{meant}`?"));
            wrong(value, &format!("no variable `{name}` stands in [draw] before{meant}"), &names.join(", "))
        })
    }
}

/// A number that is finite.
pub fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64)).filter(|number| number.is_finite())
}

fn at(value: &Value) -> Range<usize> {
    value.span().unwrap_or(0..0)
}

fn wrong(value: &Value, message: &str, allowed: &str) -> Wrong {
    (at(value), message.into(), allowed.into())
}

/// Where the populations lie that come with the project.
pub fn folder() -> PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/sim/populations")
}

/// A population by its path or by its name among those that come with the project.
///
/// # Errors
/// There is none, or it is not one; the text is for people.
pub fn load(name: &str) -> Result<Population, String> {
    let (path, text) = library::find(&folder(), "population", name)?;
    let file = path.to_string_lossy();
    let over: DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| format!("{file}: this is not TOML: {error}"))?;
    let Some(base) = over.get("extends") else { return read(&file, &text).map_err(|errors| errors.to_string()) };
    let base = base.as_str().ok_or_else(|| format!("{file}: `extends` names a population, such as \"ordinary\""))?;
    let beside = path.with_file_name(base).with_extension("toml");
    let found = if beside.is_file() { beside } else { folder().join(base).with_extension("toml") };
    let told = |why: String| format!("{file} extends {base}: {why}");
    let unknown = |error| told(library::unknown(&folder(), "population", base, &error));
    let text = fs::read_to_string(&found).map_err(unknown)?;
    let whole: Result<DocumentMut, toml_edit::TomlError> = text.parse();
    if whole.as_ref().is_ok_and(|whole| whole.contains_key("extends")) {
        return Err(told(format!("{base} extends another itself; extend that one, or none")));
    }
    // What is wrong in it is told as it stands there.
    let known = read(&found.to_string_lossy(), &text).map_err(|errors| told(errors.to_string()))?;
    let mut whole = whole.map_err(|error| told(error.to_string()))?;
    overlay(whole.as_table_mut(), over.as_table());
    let label = format!("{file} over {}", known.name);
    let population = read(&label, &whole.to_string()).map_err(|errors| errors.to_string())?;
    Ok(Population { name: stem(&file), ..population })
}

/// Puts what a file says over what it extends: value by value, bounds by their metric, a script as a whole. What is
/// counted is added.
fn overlay(base: &mut Table, over: &Table) {
    for (name, item) in over.iter().filter(|(name, _)| *name != "extends") {
        match (base.get_mut(name), item) {
            (Some(Item::Table(base)), Item::Table(over)) => overlay(base, over),
            (Some(Item::ArrayOfTables(base)), Item::ArrayOfTables(over)) if name == EXPECT.name => bounds(base, over),
            (Some(Item::ArrayOfTables(base)), Item::ArrayOfTables(over)) if name != SCRIPT.name => {
                over.iter().for_each(|table| base.push(table.clone()));
            }
            (Some(known), item) => *known = item.clone(),
            (None, item) => {
                base.insert(name, item.clone());
            }
        }
    }
}

fn bounds(base: &mut ArrayOfTables, over: &ArrayOfTables) {
    let metric = |table: &Table| table.get("metric").and_then(Item::as_str).map(str::to_owned);
    for table in over {
        let place = base.iter().position(|known| metric(known) == metric(table));
        match place.and_then(|place| base.get_mut(place)) {
            Some(known) => table.iter().for_each(|(name, item)| {
                known.insert(name, item.clone());
            }),
            None => base.push(table.clone()),
        }
    }
}

/// A file's name without its ending.
pub fn stem(file: &str) -> String {
    Path::new(file).file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}

/// Fingers that are named each.
const NAMED: usize = 30;

/// The table of promises, the forces' errors, and who broke what.
pub fn text(report: &Report) -> String {
    let Report { population, board, seed, of_fingers, fingers, .. } = report;
    let count = fingers.len();
    let percent = |part: usize| 100.0 * part as f64 / count.max(1) as f64;
    let mut text = format!("{population}: {}\n", report.about);
    // Writing to a string does not fail.
    let _ = writeln!(text, "{count} of {of_fingers} fingers, seed {seed}, board {board}; simulated\n");
    let promises = report.promises();
    let width = promises.iter().map(|row| row.metric.len()).max().unwrap_or(0);
    let _ = writeln!(
        text,
        "  {:width$} {:>8} {:>8} {:>10} {:>10} {:>10}",
        "promise", "broken", "%", "median", "95 %", "worst"
    );
    for row in &promises {
        let [median, most, worst] = values(&row.spread);
        let (broken, share) = (row.broken, percent(row.broken));
        let _ = writeln!(text, "  {:width$} {broken:>8} {share:>8.1} {median:>10} {most:>10} {worst:>10}", row.metric);
    }
    for (Counted { metric, above }, fingers) in report.counted() {
        let _ = writeln!(text, "  {metric} above {above}: {fingers} fingers ({:.1} %)", percent(fingers));
    }
    let [of_goal, mn] = report.errors();
    let _ = writeln!(text, "\n  true force off the goal in {} holds that touched: median, 95 %, worst", of_goal.count);
    for (spread, unit) in [(of_goal, "% of the goal"), (mn, "mN")] {
        let _ = writeln!(text, "  {} {unit}", values(&spread).join(", "));
    }
    let worst: Vec<&Ran> = report.worst().into_iter().filter(|ran| !ran.inside).collect();
    if !worst.is_empty() {
        text += "\n  outside, the worst first:\n";
    }
    worst.iter().take(NAMED).for_each(|ran| text += &format!("  {}\n", judged(ran)));
    if worst.len() > NAMED {
        let _ = writeln!(text, "  and {} more: --json FILE has them all", worst.len() - NAMED);
    }
    let _ = writeln!(
        text,
        "\n{} of {count} fingers inside the envelope ({:.1} %)",
        report.inside(),
        percent(report.inside())
    );
    text
}

/// One line for a finger: the promises that it broke, else the promise with the smallest margin.
pub fn judged(ran: &Ran) -> String {
    let promise = |Promise { metric, value, min, max, .. }: &Promise| {
        format!("{metric} {} ({})", shown(*value), asked(*min, *max))
    };
    let about = match ran.nearest().filter(|_| ran.inside) {
        Some(nearest) => format!("broke no promise, nearest to its bound is {}", promise(nearest)),
        None => ran.broken().map(promise).collect::<Vec<_>>().join("; "),
    };
    format!("finger {}: {about}", ran.finger)
}

fn values(spread: &Spread) -> [String; 3] {
    [spread.median, spread.most, spread.worst].map(shown)
}
