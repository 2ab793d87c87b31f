//! A population's file: a scene whose values may be drawn.

use super::draw::{Draw, Drawn};
use super::read::{DrawReader, Wrong};
use super::{Counted, Population};
use crate::key::{Key, Kind};
use crate::metrics;
use crate::registry;
use crate::scene::error::{SceneError, SceneErrors, alike};
use crate::scene::tables::{EXPECT, ROOT, SCRIPT, TABLES};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml_edit::{ArrayOfTables, Document, DocumentMut, Item, Table, TableLike};

/// What a population's file has beside what a scene has.
const OWN: [&str; 4] = ["extends", "magnitude", "draw", "count"];

/// Where the populations lie that come with the project.
pub fn folder() -> PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/sim/populations")
}

/// A population by its path or by its name in the library.
///
/// # Errors
/// There is none, or it is not one; the text is for people.
pub fn load(name: &str) -> Result<Population, String> {
    let named = folder().join(name).with_extension("toml");
    let path = if Path::new(name).is_file() || !named.is_file() { PathBuf::from(name) } else { named };
    let text = fs::read_to_string(&path).map_err(|error| {
        let known: Vec<String> = fs::read_dir(folder())
            .into_iter()
            .flatten()
            .flatten()
            .filter_map(|entry| Some(entry.path().file_stem()?.to_string_lossy().into_owned()))
            .collect();
        let meant = alike(name, known.iter().map(String::as_str));
        let meant = meant.map_or(String::new(), |meant| format!("; did you mean `{meant}`?"));
        format!("no population {name}: {error}{meant}\n  those that come with the project: {}", known.join(", "))
    })?;
    let file = path.to_string_lossy();
    let document: DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| format!("{file}: this is not TOML: {error}"))?;
    let Some(base) = document.get("extends") else { return read(&file, &text).map_err(|errors| errors.to_string()) };
    let base = base.as_str().ok_or_else(|| format!("{file}: `extends` names a population, such as \"ordinary\""))?;
    let beside = path.with_file_name(base).with_extension("toml");
    let base = load(if beside.is_file() { beside.to_str().unwrap_or(base) } else { base })
        .map_err(|error| format!("{file} extends {base}: {error}"))?;
    let mut whole: DocumentMut = base.text.parse().map_err(|_| format!("{file}: what it extends is not TOML"))?;
    overlay(whole.as_table_mut(), document.as_table());
    let label = format!("{file} over {}", base.name);
    let mut population = read(&label, &whole.to_string()).map_err(|errors| errors.to_string())?;
    population.name = stem(&file);
    Ok(population)
}

/// Puts what a file says over what it extends: value by value, bounds by their metric, a script as a whole.
fn overlay(base: &mut Table, over: &Table) {
    for (name, item) in over.iter().filter(|(name, _)| *name != "extends") {
        match (base.get_mut(name), item) {
            (Some(Item::Table(base)), Item::Table(over)) => overlay(base, over),
            (Some(Item::ArrayOfTables(base)), Item::ArrayOfTables(over)) if name != SCRIPT.name => bounds(base, over),
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

fn stem(file: &str) -> String {
    Path::new(file).file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}

/// Reads a population that extends nothing any more.
///
/// # Errors
/// Everything in the text that is not a population.
pub fn read(file: &str, text: &str) -> Result<Population, SceneErrors> {
    let error = |(at, message, allowed): Wrong| SceneError::new(file, text, at, message, allowed);
    let document = Document::parse(text).map_err(|failure| {
        let message = format!("this is not TOML: {}", failure.message().trim().replace('\n', "; "));
        SceneErrors(vec![error((failure.span().unwrap_or(0..0), message, String::new()))])
    })?;
    let root = document.as_table();
    let mut wrong: Vec<Wrong> = Vec::new();
    let magnitude = root.get("magnitude").map_or(Some(1.0), number).filter(|magnitude| *magnitude > 0.0);
    if magnitude.is_none() {
        wrong.push((
            item_span(root, "magnitude"),
            "`magnitude` is a number above 0".into(),
            "1 is as the file says".into(),
        ));
    }
    let mut parts = Parts { magnitude: magnitude.unwrap_or(1.0), text, variables: Vec::new(), keys: Vec::new(), wrong };
    parts.variables(root);
    parts.keys("", root);
    let counted = parts.counted(root);
    for name in OWN {
        if root.contains_key(name) {
            let blanks = parts.whole(root, name);
            parts.keys.extend(blanks.into_iter().map(|at| Place { at, key: String::new(), whole: false, draw: None }));
        }
    }
    let Parts { variables, mut keys, wrong, .. } = parts;
    if !wrong.is_empty() {
        let mut errors: Vec<SceneError> = wrong.into_iter().map(error).collect();
        errors.sort_by_key(|error| (error.line, error.column));
        return Err(SceneErrors(errors));
    }
    keys.sort_by_key(|place: &Place| place.at.start);
    let about = root.get("about").and_then(Item::as_str).unwrap_or_default().to_owned();
    let population =
        Population { name: stem(file), file: file.into(), about, text: text.into(), variables, places: keys, counted };
    // What is wrong in it as a scene is told as it stands there: its lines are the same.
    population.finger(1, 0)?;
    Ok(population)
}

/// A place in the text, and what stands there in a finger's scene: a drawn value, or nothing.
#[derive(Clone, Debug)]
pub struct Place {
    /// In the population's text.
    pub at: Range<usize>,
    /// `table.key`.
    pub key: String,
    /// Whether it takes whole numbers only.
    pub whole: bool,
    /// How it is drawn; none where the scene has nothing.
    pub draw: Option<Draw>,
}

struct Parts<'a> {
    magnitude: f64,
    text: &'a str,
    variables: Vec<(String, Draw)>,
    keys: Vec<Place>,
    wrong: Vec<Wrong>,
}

impl Parts<'_> {
    fn variables(&mut self, root: &Table) {
        let Some(item) = root.get("draw") else { return };
        let Some(table) = item.as_table() else {
            self.wrong.push((key_span(root, "draw"), "`draw` is a table".into(), "[draw], once".into()));
            return;
        };
        for (name, item) in table.iter() {
            let Some(value) = item.as_value() else {
                self.wrong.push((key_span(table, name), format!("`{name}` is no draw"), "a value or a draw".into()));
                continue;
            };
            match (DrawReader { magnitude: self.magnitude, variables: &self.variables }).draw(value) {
                Ok(draw) => self.variables.push((name.into(), draw)),
                Err(wrong) => self.wrong.push(wrong),
            }
        }
    }

    /// The drawn keys of a table and of the tables in it.
    fn keys(&mut self, path: &str, table: &dyn TableLike) {
        for (name, item) in table.iter().filter(|(name, _)| !path.is_empty() || !OWN.contains(name)) {
            let key = if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
            match item {
                Item::Table(inner) => self.keys(&key, inner),
                Item::ArrayOfTables(tables) => {
                    tables.iter().enumerate().for_each(|(place, table)| self.keys(&format!("{key}.{place}"), table));
                }
                Item::Value(value) if value.is_inline_table() && !is_table(&key) => self.key(key, value),
                Item::Value(value) => {
                    if let Some(inner) = value.as_inline_table() {
                        self.keys(&key, inner);
                    }
                }
                Item::None => {}
            }
        }
    }

    fn key(&mut self, key: String, value: &toml_edit::Value) {
        let at = value.span().unwrap_or(0..0);
        let draw = match (DrawReader { magnitude: self.magnitude, variables: &self.variables }).draw(value) {
            Ok(draw) => draw,
            Err(wrong) => return self.wrong.push(wrong),
        };
        let described = described(&key);
        if let (Some(described), Some([low, high])) = (described, draw.range(&|name| self.range(name)))
            && let Some([min, max]) = numbers(described)
            && (low < min || high > max)
        {
            let [low, high] =
                [low, high].map(|end| format!("{end:.6}").trim_end_matches('0').trim_end_matches('.').to_owned());
            let magnitude =
                if self.magnitude == 1.0 { String::new() } else { format!(" at a magnitude of {}", self.magnitude) };
            let message = format!("`{key}` is drawn from {low} to {high}{magnitude}");
            self.wrong.push((at.clone(), message, described.allowed()));
        }
        let whole =
            described.is_some_and(|key| matches!(key.kind, Kind::Whole { .. } | Kind::Optional { whole: true, .. }));
        self.keys.push(Place { at, key, whole, draw: Some(draw) });
    }

    fn range(&self, name: &str) -> Option<[f64; 2]> {
        let place = self.variables.iter().position(|(known, _)| known == name)?;
        // A variable knows those before it only, so this ends.
        self.variables[place].1.range(&|name| self.range(name))
    }

    fn counted(&mut self, root: &Table) -> Vec<Counted> {
        let tables = root.get("count").and_then(Item::as_array_of_tables);
        let mut counted = Vec::new();
        for table in tables.into_iter().flatten() {
            let metric = table.get("metric").and_then(Item::as_str).unwrap_or_default();
            let above = table.get("above").and_then(number);
            let known = metrics::names().contains(&metric);
            match above.filter(|_| known && table.len() == 2) {
                Some(above) => counted.push(Counted { metric: metric.into(), above }),
                None => {
                    let meant = alike(metric, metrics::names());
                    let meant =
                        meant.filter(|_| !known).map_or(String::new(), |meant| format!("; did you mean `{meant}`?"));
                    let message = format!("[[count]] is a metric and a number{meant}");
                    self.wrong.push((
                        table.span().unwrap_or(0..0),
                        message,
                        "metric = \"rest_duty_percent\", above = 2.0".into(),
                    ));
                }
            }
        }
        counted
    }

    /// All of the text that says something of the population's own: a key with its value, or tables.
    fn whole(&self, root: &Table, name: &str) -> Vec<Range<usize>> {
        let tables: Vec<Range<usize>> = match root.get(name) {
            Some(Item::Table(table)) => table.span().into_iter().collect(),
            Some(Item::ArrayOfTables(tables)) => tables.iter().filter_map(Table::span).collect(),
            Some(Item::Value(value)) => {
                return value.span().map(|at| key_span(root, name).start..at.end).into_iter().collect();
            }
            _ => Vec::new(),
        };
        // To where the next table begins.
        let end = |start: usize| {
            let lines = self.text[start + 1..].match_indices("\n[");
            lines.map(|(at, _)| start + 2 + at).next().unwrap_or(self.text.len())
        };
        tables.into_iter().map(|at| at.start..end(at.start)).collect()
    }
}

fn is_table(key: &str) -> bool {
    match key.split_once('.') {
        None => key == "effects" || TABLES.iter().any(|table| table.name == key),
        Some((table, effect)) => table == "effects" && !effect.contains('.'),
    }
}

/// What a key of a scene is, by its path.
fn described(path: &str) -> Option<&'static Key> {
    let (table, name) = path.rsplit_once('.').unwrap_or(("", path));
    let table = table.split_once('.').map_or(table, |(first, second)| if first == "effects" { second } else { first });
    let keys = match table {
        "" => ROOT.keys,
        "script" => SCRIPT.keys,
        "expect" => EXPECT.keys,
        name => match TABLES.iter().find(|table| table.name == name) {
            Some(table) => table.keys,
            None => registry::all().find(|effect| effect.name == name)?.keys,
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

fn number(item: &Item) -> Option<f64> {
    item.as_float().or_else(|| item.as_integer().map(|whole| whole as f64)).filter(|number| number.is_finite())
}

fn key_span(table: &Table, name: &str) -> Range<usize> {
    table.key(name).and_then(toml_edit::Key::span).unwrap_or(0..0)
}

fn item_span(table: &Table, name: &str) -> Range<usize> {
    table.get(name).and_then(Item::span).unwrap_or(0..0)
}

/// A value as a scene's text has it.
pub fn written(value: &Drawn, whole: bool) -> String {
    match value {
        Drawn::Number(number) if whole => format!("{number:.0}"),
        Drawn::Number(number) => format!("{number:?}"),
        Drawn::Word(word) => toml_edit::Value::from(word.as_str()).to_string(),
    }
}
