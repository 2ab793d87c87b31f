//! Reader of populations and of their draws, such as `{ uniform = [1, 10] }`.

use crate::events::{EVENT, KINDS, own_keys};
use crate::population::draw::{self, Draw, Drawn};
use crate::population::{Counted, Events, Place, Population};
use crate::scene::reader::{Reader, SceneErrors, Span, did_you_mean, item_span, key_span, stem};
use crate::scene::tables::{self, EXPECT, Key, Kind, ROOT, SCRIPT, TABLES};
use crate::{effects, metrics, scene};
use std::fs;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, InlineTable, Item, Table, TableLike, Value};

/// Place and text of a mistake, and allowed values.
pub type Wrong = (Span, String, String);

pub const WAYS: [&str; 6] = ["uniform", "log_uniform", "normal", "choice", "is", "by"];
const EXAMPLES: &str = "{ uniform = [1, 10] }, { log_uniform = [0.3, 3] }, { normal = [0, 0.05] } (mean, deviation), \
    { choice = [256, 512], weights = [1, 2] }, { is = \"1000 * modulus_kpa\" }, { by = \"thing\", ball = 0.05, otherwise = 0 }; \
    with follows = \"magnitude\" or \"1 / magnitude\"";

impl Parts<'_> {
    fn draw(&self, value: &Value) -> Result<Draw, Wrong> {
        let number = number(value).map(Drawn::Number);
        match (value.as_inline_table(), number.or_else(|| value.as_str().map(|word| Drawn::Word(word.into())))) {
            (Some(table), _) => self.table(table, at(value)),
            (None, Some(always)) => Ok(Draw::Always(always)),
            (None, None) => Err(wrong(value, "this cannot be drawn", EXAMPLES)),
        }
    }

    fn table(&self, table: &InlineTable, place: Span) -> Result<Draw, Wrong> {
        let mut ways = WAYS.iter().filter_map(|way| Some((*way, table.get(way)?)));
        let (Some((way, value)), None) = (ways.next(), ways.next()) else {
            let mut meant = table.iter().map(|(name, _)| did_you_mean(name, WAYS));
            let meant = meant.find(|meant| !meant.is_empty()).unwrap_or_default();
            return Err((place, format!("a draw has one way to be drawn{meant}"), EXAMPLES.into()));
        };
        let draw = match way {
            "uniform" => Draw::Uniform(ends(value)?),
            "log_uniform" => {
                let ends = ends(value)?;
                let allowed = "[least, largest], both above 0; or `uniform`";
                check(ends[0] > 0.0, value, "a ratio needs ends above 0", allowed)?;
                Draw::LogUniform(ends)
            }
            "normal" => {
                let [mean, deviation] = pair(value)?;
                let message = format!("a deviation of {deviation}");
                check(deviation >= 0.0, value, &message, "[mean, deviation], the deviation 0 or more")?;
                Draw::Normal([mean, deviation])
            }
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
        let Some(followed) = table.get("follows") else { return Ok(draw) };
        check(words == 0, followed, "words follow nothing", "no `follows`")?;
        let factor = match followed.as_str() {
            Some("magnitude") => self.magnitude,
            Some("1 / magnitude") => 1.0 / self.magnitude,
            _ => return Err(wrong(followed, "nothing else can be followed", "\"magnitude\" or \"1 / magnitude\"")),
        };
        Ok(Draw::Times(factor, Box::new(draw)))
    }

    fn choice(&self, value: &Value, weights: Option<&Value>) -> Result<Draw, Wrong> {
        let given: Vec<&Value> = value.as_array().map(|array| array.iter().collect()).unwrap_or_default();
        check(!given.is_empty(), value, "there is nothing to choose from", "choice = [256, 512, 1024]")?;
        let draws = given.into_iter().map(|value| self.draw(value)).collect::<Result<Vec<_>, _>>()?;
        let shares = match weights {
            None => vec![1.0; draws.len()],
            Some(weights) => {
                let all: Vec<f64> =
                    weights.as_array().map(|array| array.iter().filter_map(number).collect()).unwrap_or_default();
                let sound = all.len() == draws.len() && all.iter().all(|w| *w >= 0.0) && all.iter().any(|w| *w > 0.0);
                let allowed = format!("{} numbers, none below 0 and one above", draws.len());
                check(sound, weights, "these are no weights of the choice", &allowed)?;
                all
            }
        };
        Ok(Draw::Choice(shares.into_iter().zip(draws).collect()))
    }

    fn expression(&self, value: &Value) -> Result<String, Wrong> {
        let allowed = "+ - * / and ( ) with numbers and variables of [draw], such as \"1000 * modulus_kpa\"";
        let text = value.as_str().ok_or_else(|| wrong(value, "an expression is a text", allowed))?;
        draw::range(text, &mut |_| Some([1.0; 2])).map_err(|error| wrong(value, &error, allowed))?;
        for name in draw::variables(text) {
            let message = format!("`{name}` is a word, and cannot be reckoned with");
            check(self.known(name, value)?.words().is_empty(), value, &message, allowed)?;
        }
        Ok(text.to_owned())
    }

    fn by(&self, table: &InlineTable, value: &Value) -> Result<Draw, Wrong> {
        let name = value.as_str().ok_or_else(|| wrong(value, "`by` names a variable", EXAMPLES))?;
        let words = self.known(name, value)?.words();
        let allowed = "a variable that is a choice of words";
        check(!words.is_empty(), value, &format!("`{name}` is a number"), allowed)?;
        let (mut given, mut otherwise) = (Vec::new(), None);
        for (case, value) in table.iter().filter(|(case, _)| !["by", "follows"].contains(case)) {
            let draw = self.draw(value)?;
            if case == "otherwise" {
                otherwise = Some(draw);
            } else {
                check(words.contains(&case), value, &format!("`{name}` is never \"{case}\""), &words.join(", "))?;
                given.push((case, draw));
            }
        }
        let case = |word: &&str| {
            let draw = given.iter().find(|(case, _)| case == word).map(|(_, draw)| draw).or(otherwise.as_ref());
            let message = format!("nothing is said for \"{word}\"");
            let missing = || wrong(value, &message, "a value for each, or `otherwise`");
            Ok((word.to_string(), draw.ok_or_else(missing)?.clone()))
        };
        Ok(Draw::By(name.into(), words.iter().map(case).collect::<Result<_, Wrong>>()?))
    }

    fn known(&self, name: &str, value: &Value) -> Result<&Draw, Wrong> {
        let found = self.variables.iter().find(|(known, _)| known == name).map(|(_, draw)| draw);
        found.ok_or_else(|| {
            let names: Vec<&str> = self.variables.iter().map(|(name, _)| name.as_str()).collect();
            let meant = did_you_mean(name, names.iter().copied());
            wrong(value, &format!("no earlier variable `{name}` in [draw]{meant}"), &names.join(", "))
        })
    }
}

fn pair(value: &Value) -> Result<[f64; 2], Wrong> {
    let numbers: Option<Vec<f64>> = value.as_array().map(|array| array.iter().filter_map(number).collect());
    numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| wrong(value, "needs two numbers", EXAMPLES))
}

fn ends(value: &Value) -> Result<[f64; 2], Wrong> {
    let [low, high] = pair(value)?;
    let message = format!("the least, {low}, is above the largest, {high}");
    check(low <= high, value, &message, "[least, largest]")?;
    Ok([low, high])
}

pub fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64)).filter(|number| number.is_finite())
}

fn at(value: &Value) -> Span {
    value.span().unwrap_or(0..0)
}

fn wrong(value: &Value, message: &str, allowed: &str) -> Wrong {
    (at(value), message.into(), allowed.into())
}

fn check(sound: bool, value: &Value, message: &str, allowed: &str) -> Result<(), Wrong> {
    if sound { Ok(()) } else { Err(wrong(value, message, allowed)) }
}

pub fn folder() -> PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/sim/populations")
}

/// Loads a population by its path, or by its name in the project. The error is for people.
pub fn load(name: &str) -> Result<Population, String> {
    let (path, text) = scene::find(&folder(), "population", name)?;
    let file = path.to_string_lossy();
    let over: DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| format!("{file}: this is not TOML: {error}"))?;
    let Some(base) = over.get("extends") else { return read(&file, &text).map_err(|errors| errors.to_string()) };
    let base = base.as_str().ok_or_else(|| format!("{file}: `extends` names a population, such as \"ordinary\""))?;
    let beside = path.with_file_name(base).with_extension("toml");
    let found = if beside.is_file() { beside } else { folder().join(base).with_extension("toml") };
    let told = |why: String| format!("{file} extends {base}: {why}");
    let unknown = |error| told(scene::unknown(&folder(), "population", base, &error));
    let text = fs::read_to_string(&found).map_err(unknown)?;
    let whole: Result<DocumentMut, toml_edit::TomlError> = text.parse();
    if whole.as_ref().is_ok_and(|whole| whole.contains_key("extends")) {
        return Err(told(format!("{base} extends another itself; extend that one, or none")));
    }
    // Reports mistakes of the base at their place in its file.
    let known = read(&found.to_string_lossy(), &text).map_err(|errors| told(errors.to_string()))?;
    let mut whole = whole.map_err(|error| told(error.to_string()))?;
    overlay(whole.as_table_mut(), over.as_table());
    let label = format!("{file} over {}", known.name);
    let population = read(&label, &whole.to_string()).map_err(|errors| errors.to_string())?;
    Ok(Population { name: stem(&file), ..population })
}

/// Puts a file over the one it extends: value by value, bounds by metric, a script as a whole. Counts are added.
fn overlay(base: &mut Table, over: &Table) {
    for (name, item) in over.iter().filter(|(name, _)| *name != "extends") {
        match (base.get_mut(name), item) {
            (Some(Item::Table(base)), Item::Table(over)) => overlay(base, over),
            (Some(Item::ArrayOfTables(base)), Item::ArrayOfTables(over)) if name != SCRIPT.name => {
                let metric = |table: &Table| table.get("metric").and_then(Item::as_str).map(str::to_owned);
                for table in over {
                    let same = |known: &&mut Table| name == EXPECT.name && metric(known) == metric(table);
                    let known = base.iter_mut().find(same);
                    match known {
                        Some(known) => overlay(known, table),
                        None => base.push(table.clone()),
                    }
                }
            }
            (Some(known), item) => *known = item.clone(),
            (None, item) => {
                base.insert(name, item.clone());
            }
        }
    }
}

/// Keys of a population that a scene does not have, except `extends`.
const OWN: [&str; 4] = ["magnitude", "draw", "events", "count"];

/// Reads the text of a population without `extends`.
pub fn read(file: &str, text: &str) -> Result<Population, SceneErrors> {
    let (mut reader, document) = Reader::of(file, text)?;
    let root = document.as_table();
    let magnitude =
        root.get("magnitude").map_or(Some(1.0), |item| number(item.as_value()?)).filter(|magnitude| *magnitude > 0.0);
    if magnitude.is_none() {
        reader.error(item_span(root, "magnitude"), "`magnitude` is a number above 0", "1 is as the file says");
    }
    let mut parts = Parts { reader, magnitude: magnitude.unwrap_or(1.0), variables: Vec::new(), keys: Vec::new() };
    parts.variables(root);
    parts.keys("", root);
    let events = parts.events(root);
    parts.unused(root);
    let counted = parts.counted(root);
    let blanks = OWN.iter().flat_map(|name| own_text(root, name));
    parts.keys.extend(blanks.map(|at| Place { at, key: String::new(), whole: false, draw: None }));
    let Parts { variables, mut keys, reader, .. } = parts;
    reader.finish(Some(()))?;
    // Draws of events are not in the scene: each event has its own.
    keys.retain(|place: &Place| !place.key.starts_with("events."));
    keys.sort_by_key(|place: &Place| place.at.start);
    let about = root.get("about").and_then(Item::as_str).unwrap_or_default().to_owned();
    let population = Population {
        name: stem(file),
        file: file.into(),
        about,
        text: text.into(),
        variables,
        places: keys,
        events,
        counted,
    };
    // Reports mistakes of the scene at their place in the file: its lines are the same.
    population.finger(1, 0)?;
    Ok(population)
}

struct Parts<'a> {
    reader: Reader<'a>,
    magnitude: f64,
    variables: Vec<(String, Draw)>,
    keys: Vec<Place>,
}

impl Parts<'_> {
    /// Reads the description of a random value; none, with an error noted, if it is invalid.
    fn read(&mut self, value: &Value) -> Option<Draw> {
        self.draw(value).map_err(|(at, message, allowed)| self.reader.error(at, message, allowed)).ok()
    }

    fn variables(&mut self, root: &Table) {
        let Some(item) = root.get("draw") else { return };
        let Some(table) = item.as_table() else {
            return self.reader.error(key_span(root, "draw"), "`draw` is a table", "[draw], once");
        };
        for (name, item) in table.iter() {
            let Some(value) = item.as_value() else {
                self.reader.error(key_span(table, name), format!("`{name}` is no draw"), "a value or a draw");
                continue;
            };
            let draw = self.read(value);
            self.variables.extend(draw.map(|draw| (name.into(), draw)));
        }
    }

    /// Reads the drawn keys of a table and of the tables in it.
    fn keys(&mut self, path: &str, table: &dyn TableLike) {
        for (name, item) in table.iter().filter(|(name, _)| !path.is_empty() || !OWN.contains(name)) {
            let key = if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
            if let Some(tables) = item.as_array_of_tables() {
                tables.iter().enumerate().for_each(|(place, table)| self.keys(&format!("{key}.{place}"), table));
            } else if let Some(inner) = item.as_table_like().filter(|_| item.is_table() || is_table(&key)) {
                self.keys(&key, inner);
            } else if let Some(value) = item.as_value().filter(|value| value.is_inline_table()) {
                self.key(key, value);
            }
        }
    }

    fn key(&mut self, key: String, value: &Value) {
        let at = at(value);
        let Some(draw) = self.read(value) else { return };
        let described = described(&key);
        if let (Some(described), Some([low, high])) = (described, draw.range(&|name| self.range(name)))
            && let Some([min, max]) = numbers(described)
            && (low < min || high > max)
        {
            let [low, high] = [low, high].map(|end| metrics::shown(Some(end)));
            let magnitude =
                if self.magnitude == 1.0 { String::new() } else { format!(" at a magnitude of {}", self.magnitude) };
            let message = format!("`{key}` is drawn from {low} to {high}{magnitude}");
            self.reader.error(at.clone(), message, described.allowed());
        }
        let whole =
            described.is_some_and(|key| matches!(key.kind, Kind::Whole { .. } | Kind::Optional { whole: true, .. }));
        self.keys.push(Place { at, key, whole, draw: Some(draw) });
    }

    /// Reads the draws of events: `count` and `at_s`, and for each kind a table with `weight` and its keys.
    fn events(&mut self, root: &Table) -> Option<Events> {
        let table = root.get("events")?.as_table()?;
        let own = ["count", "at_s"];
        let (mut kinds, mut all) = (Vec::new(), Vec::new());
        for (name, item) in table.iter().filter(|(name, _)| !own.contains(name)) {
            let known = KINDS.iter().find(|kind| kind.name == name);
            let (Some(kind), Some(given)) = (known, item.as_table()) else {
                let names = own.into_iter().chain(KINDS.iter().map(|kind| kind.name));
                self.reader.unknown(&format!("key `{name}` in [events]"), name, key_span(table, name), names);
                continue;
            };
            let keys = own_keys(kind);
            let words = keys.iter().map(|key| key.name).chain(["weight"]);
            for (name, _) in given.iter().filter(|(name, _)| words.clone().all(|word| word != *name)) {
                let what = format!("key `{name}` in [events.{}]", kind.name);
                self.reader.unknown(&what, name, key_span(given, name), words.clone());
            }
            for key in keys {
                let place = self.drawn(given, key.name, &format!("events.{}", kind.name));
                all.extend(place.map(|place| (kind.name, place)));
            }
            let weight = given.get("weight").map_or(Some(1.0), |item| number(item.as_value()?));
            kinds.push((weight.unwrap_or(0.0), Draw::Always(Drawn::Word(kind.name.into()))));
        }
        if kinds.is_empty() {
            self.reader.error(table.span().unwrap_or(0..0), "[events] names no kind", "[events.tare] and the like");
        }
        let [count, at_s] = own.map(|name| self.drawn(table, name, "events"));
        let kind = Place { at: 0..0, key: "kind".into(), whole: false, draw: Some(Draw::Choice(kinds)) };
        Some(Events { count: count?, at_s: at_s?, kind, keys: all })
    }

    /// Reads a required draw.
    fn drawn(&mut self, table: &Table, name: &str, path: &str) -> Option<Place> {
        let Some(value) = table.get(name).and_then(Item::as_value) else {
            self.reader.error(table.span().unwrap_or(0..0), format!("[{path}] lacks `{name}`"), "a value or a draw");
            return None;
        };
        let known = self.keys.len();
        self.key(format!("{path}.{name}"), value);
        self.keys.get(known).cloned()
    }

    /// Refuses variables that nothing uses.
    fn unused(&mut self, root: &Table) {
        // The variables of a wrong draw are unknown.
        let Some(table) = root.get("draw").and_then(Item::as_table).filter(|_| self.reader.errors.is_empty()) else {
            return;
        };
        let draws =
            self.variables.iter().map(|(_, draw)| draw).chain(self.keys.iter().filter_map(|key| key.draw.as_ref()));
        let used: Vec<&str> = draws.flat_map(Draw::uses).collect();
        for (name, _) in table.iter().filter(|(name, _)| !used.contains(name)) {
            let allowed = format!("{{ is = \"{name}\" }} or {{ by = \"{name}\", ... }} at a key of the scene");
            self.reader.error(key_span(table, name), format!("`{name}` is drawn, and nothing uses it"), allowed);
        }
    }

    fn range(&self, name: &str) -> Option<[f64; 2]> {
        let place = self.variables.iter().position(|(known, _)| known == name)?;
        // A variable uses only earlier ones, so the recursion ends.
        self.variables[place].1.range(&|name| self.range(name))
    }

    fn counted(&mut self, root: &Table) -> Vec<Counted> {
        let mut counted = Vec::new();
        for (given, at) in self.reader.many(&tables::COUNT, root) {
            if let Some(values) = self.reader.values(&tables::COUNT, given, at, false) {
                counted.push(Counted { metric: self.reader.metric(given, &values), above: values.number("above") });
            }
        }
        counted
    }
}

/// Returns the ranges of the text that only a population has: a key with its value, or tables from head to last value.
fn own_text(root: &Table, name: &str) -> Vec<Span> {
    let whole = |table: &Table| {
        let head = table.span()?;
        let ends = table.iter().filter(|(_, item)| !item.is_table()).filter_map(|(_, item)| Some(item.span()?.end));
        Some(head.start..ends.fold(head.end, usize::max))
    };
    match root.get(name) {
        Some(Item::Table(table)) => {
            let inner = table.iter().filter_map(|(_, item)| item.as_table());
            core::iter::once(table).chain(inner).filter_map(whole).collect()
        }
        Some(Item::ArrayOfTables(tables)) => tables.iter().filter_map(whole).collect(),
        Some(Item::Value(value)) => value.span().map(|at| key_span(root, name).start..at.end).into_iter().collect(),
        _ => Vec::new(),
    }
}

const COUNT: Key = Key::new("count", "", Kind::Whole { min: 0, max: 100, default: None });

fn is_table(key: &str) -> bool {
    match key.split_once('.') {
        None => key == "effects" || TABLES.iter().any(|table| table.name == key),
        Some((table, effect)) => table == "effects" && !effect.contains('.'),
    }
}

fn described(path: &str) -> Option<&'static Key> {
    let (table, name) = path.rsplit_once('.').unwrap_or(("", path));
    let table = table
        .split_once('.')
        .map_or(table, |(first, second)| if ["effects", "events"].contains(&first) { second } else { first });
    let keys = match table {
        "" => ROOT.keys,
        "script" => SCRIPT.keys,
        "expect" => EXPECT.keys,
        "events" if name == "count" => return Some(&COUNT),
        "event" | "events" => EVENT.keys,
        name => match TABLES.iter().chain(&KINDS).find(|table| table.name == name) {
            Some(table) => table.keys,
            None => effects::all().find(|effect| effect.name == name)?.keys,
        },
    };
    keys.iter().find(|key| key.name == name)
}

fn numbers(key: &Key) -> Option<[f64; 2]> {
    match key.kind {
        Kind::Number { min, max, .. } | Kind::Optional { min, max, .. } => Some([min, max]),
        Kind::Whole { min, max, .. } => Some([min as f64, max as f64]),
        _ => None,
    }
}
