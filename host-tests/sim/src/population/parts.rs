//! From a population's text to what is drawn in it.

use super::draw::{Draw, Drawn};
use super::read::stem;
use super::read::{DrawReader, Wrong, number};
use super::{Counted, Events, Place, Population};
use crate::events::{EVENT, KINDS, own_keys};
use crate::key::{Key, Kind};
use crate::metrics;
use crate::registry;
use crate::scene::error::{SceneError, SceneErrors, alike};
use crate::scene::reader::{item_span, key_span};
use crate::scene::tables::{EXPECT, ROOT, SCRIPT, TABLES};
use std::ops::Range;
use toml_edit::{Document, Item, Table, TableLike};

/// What a population's file has beside what a scene has, once it extends nothing any more.
const OWN: [&str; 4] = ["magnitude", "draw", "events", "count"];

/// Reads a population that extends nothing any more.
pub fn read(file: &str, text: &str) -> Result<Population, SceneErrors> {
    let error = |(at, message, allowed): Wrong| SceneError::new(file, text, at, message, allowed);
    let document = Document::parse(text).map_err(|failure| {
        let message = format!("this is not TOML: {}", failure.message().trim().replace('\n', "; "));
        SceneErrors(vec![error((failure.span().unwrap_or(0..0), message, String::new()))])
    })?;
    let root = document.as_table();
    let mut wrong: Vec<Wrong> = Vec::new();
    let magnitude =
        root.get("magnitude").map_or(Some(1.0), |item| number(item.as_value()?)).filter(|magnitude| *magnitude > 0.0);
    if magnitude.is_none() {
        wrong.push((
            item_span(root, "magnitude"),
            "`magnitude` is a number above 0".into(),
            "1 is as the file says".into(),
        ));
    }
    let mut parts = Parts { magnitude: magnitude.unwrap_or(1.0), variables: Vec::new(), keys: Vec::new(), wrong };
    parts.variables(root);
    parts.keys("", root);
    let events = parts.events(root);
    parts.unused(root);
    let counted = parts.counted(root);
    for name in OWN {
        if root.contains_key(name) {
            let blanks = own_text(root, name);
            parts.keys.extend(blanks.into_iter().map(|at| Place { at, key: String::new(), whole: false, draw: None }));
        }
    }
    let Parts { variables, mut keys, wrong, .. } = parts;
    if !wrong.is_empty() {
        let mut errors: Vec<SceneError> = wrong.into_iter().map(error).collect();
        errors.sort_by_key(|error| (error.line, error.column));
        return Err(SceneErrors(errors));
    }
    // Their draws stand in no scene as they are: each event has some of its own.
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
    // What is wrong in it as a scene is told as it stands there: its lines are the same.
    population.finger(1, 0)?;
    Ok(population)
}

struct Parts {
    magnitude: f64,
    variables: Vec<(String, Draw)>,
    keys: Vec<Place>,
    wrong: Vec<Wrong>,
}

impl Parts {
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

    /// What is drawn of events: `[events]` with `count` and `at_s`, `[events.KIND]` with `weight` and the kind's keys.
    fn events(&mut self, root: &Table) -> Option<Events> {
        let table = root.get("events")?.as_table()?;
        let own = ["count", "at_s"];
        let (mut kinds, mut all) = (Vec::new(), Vec::new());
        for (name, item) in table.iter().filter(|(name, _)| !own.contains(name)) {
            let known = KINDS.iter().find(|kind| kind.name == name);
            let (Some(kind), Some(given)) = (known, item.as_table()) else {
                let names = KINDS.iter().map(|kind| kind.name);
                let meant =
                    alike(name, names.clone()).map_or(String::new(), |name| format!("; did you mean `{name}`?"));
                let allowed = format!("count, at_s, and a table for each of {}", names.collect::<Vec<_>>().join(", "));
                self.wrong.push((key_span(table, name), format!("`{name}` is no kind of event{meant}"), allowed));
                continue;
            };
            let keys = own_keys(kind);
            for (name, _) in
                given.iter().filter(|(name, _)| *name != "weight" && keys.iter().all(|key| key.name != *name))
            {
                let allowed = keys.iter().map(|key| key.name).chain(["weight"]).collect::<Vec<_>>().join(", ");
                let message = format!("unknown key `{name}` in [events.{}]", kind.name);
                self.wrong.push((key_span(given, name), message, allowed));
            }
            for key in keys {
                let place = self.drawn(given, key.name, &format!("events.{}", kind.name));
                all.extend(place.map(|place| (kind.name, place)));
            }
            let weight = given.get("weight").map_or(Some(1.0), |item| number(item.as_value()?));
            kinds.push((weight.unwrap_or(0.0), Draw::Always(Drawn::Word(kind.name.into()))));
        }
        if kinds.is_empty() {
            let at = table.span().unwrap_or(0..0);
            self.wrong.push((at, "[events] names no kind".into(), "[events.tare] and the like".into()));
        }
        let [count, at_s] = own.map(|name| self.drawn(table, name, "events"));
        let kind = Place { at: 0..0, key: "kind".into(), whole: false, draw: Some(Draw::Choice(kinds)) };
        Some(Events { count: count?, at_s: at_s?, kind, keys: all })
    }

    /// The draw of a key that must be there.
    fn drawn(&mut self, table: &Table, name: &str, path: &str) -> Option<Place> {
        let Some(value) = table.get(name).and_then(Item::as_value) else {
            let at = table.span().unwrap_or(0..0);
            self.wrong.push((at, format!("[{path}] lacks `{name}`"), "a value or a draw".into()));
            return None;
        };
        let known = self.keys.len();
        self.key(format!("{path}.{name}"), value);
        self.keys.get(known).cloned()
    }

    /// A variable that nothing uses is a mistake.
    fn unused(&mut self, root: &Table) {
        let draws =
            self.variables.iter().map(|(_, draw)| draw).chain(self.keys.iter().filter_map(|key| key.draw.as_ref()));
        let used: Vec<&str> = draws.flat_map(Draw::uses).collect();
        let unused = self.variables.iter().filter(|(name, _)| !used.contains(&name.as_str()));
        let table = root.get("draw").and_then(Item::as_table);
        let unused: Vec<(Range<usize>, String)> =
            unused.map(|(name, _)| (table.map_or(0..0, |table| key_span(table, name)), name.clone())).collect();
        // Where a draw is wrong, what it uses is not known.
        let sound = self.wrong.is_empty();
        for (at, name) in unused.into_iter().filter(|_| sound) {
            let allowed = format!("{{ is = \"{name}\" }} or {{ by = \"{name}\", ... }} at a key of the scene");
            self.wrong.push((at, format!("`{name}` is drawn, and nothing uses it"), allowed));
        }
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
            let above = table.get("above").and_then(Item::as_value).and_then(number);
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
}

/// All of the text that says something of the population's own: a key with its value, or tables from head to last
/// value.
fn own_text(root: &Table, name: &str) -> Vec<Range<usize>> {
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

/// How many events a finger has.
const COUNT: Key = Key { name: "count", about: "", kind: Kind::Whole { min: 0, max: 100, default: None } };

fn is_table(key: &str) -> bool {
    match key.split_once('.') {
        None => key == "effects" || TABLES.iter().any(|table| table.name == key),
        Some((table, effect)) => table == "effects" && !effect.contains('.'),
    }
}

/// What a key of a scene is, by its path.
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
