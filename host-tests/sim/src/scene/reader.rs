//! Reader of scenes. It is strict: everything that is not described is an error. It reports all errors of a text
//! together.

use crate::effects::{self, NamedEffect};
use crate::events::{EVENT, Event, KINDS};
use crate::metrics;
use crate::scene::tables::{EXPECT, Key, Kind, MANY, ROOT, SCRIPT, TABLES, Table, Value, Values};
use crate::scene::{Bound, Goal, Scene};
use fingertip::shipped::{Config, ROWS};
use std::fmt;
use std::ops::Range;
use std::path::Path;
use toml_edit::{Document, Item, TableLike};

/// Range of bytes of a text.
pub(crate) type Span = Range<usize>;

/// Reads a scene. Errors name the file `file`.
pub fn read(file: &str, text: &str) -> Result<Scene, SceneErrors> {
    let (mut reader, document) = Reader::of(file, text)?;
    let scene = reader.scene(document.as_table());
    reader.finish(scene)
}

pub(crate) struct Reader<'a> {
    file: &'a str,
    text: &'a str,
    pub errors: Vec<SceneError>,
}

impl<'a> Reader<'a> {
    /// Parses a text. Places in the document are those of the text.
    pub fn of(file: &'a str, text: &'a str) -> Result<(Self, Document<&'a str>), SceneErrors> {
        let mut reader = Self { file, text, errors: Vec::new() };
        match Document::parse(text) {
            Ok(document) => Ok((reader, document)),
            Err(error) => {
                let message = format!("this is not TOML: {}", error.message().trim().replace('\n', "; "));
                reader.error(error.span().unwrap_or(0..0), message, "");
                Err(SceneErrors(reader.errors))
            }
        }
    }

    /// Returns what was read, or all errors in the order of the text.
    pub fn finish<T>(mut self, read: Option<T>) -> Result<T, SceneErrors> {
        self.errors.sort_by_key(|error| (error.line, error.column));
        read.filter(|_| self.errors.is_empty()).ok_or(SceneErrors(self.errors))
    }

    pub fn error(&mut self, at: Span, message: impl Into<String>, allowed: impl Into<String>) {
        self.mistaken(at, message, allowed, None);
    }

    /// Reports a mistake with the word that was probably meant.
    fn mistaken(&mut self, at: Span, message: impl Into<String>, allowed: impl Into<String>, meant: Option<&str>) {
        let mut error = SceneError::new(self.file, self.text, at, &message.into(), &allowed.into());
        if let Some(meant) = meant {
            error.text += &format!("\n  did you mean `{meant}`?");
        }
        self.errors.push(error);
    }

    /// Reports an unknown word, with the known ones.
    pub fn unknown<'w>(&mut self, what: &str, given: &str, at: Span, words: impl Iterator<Item = &'w str> + Clone) {
        let allowed = words.clone().collect::<Vec<_>>().join(", ");
        self.mistaken(at, format!("unknown {what}"), allowed, alike(given, words));
    }

    /// Returns the metric that a table names. Refuses an unknown one.
    pub fn metric(&mut self, given: &dyn TableLike, values: &Values) -> String {
        let (metric, known) = (values.text("metric"), metrics::names());
        if !known.contains(&metric) {
            // The metrics of single fingers repeat those of the scene.
            let words = known.iter().copied().filter(|known| !known.contains('.'));
            self.unknown(&format!("metric `{metric}`"), metric, item_span(given, "metric"), words);
        }
        metric.to_owned()
    }

    /// Returns none if a required part is missing. Its error is among the others.
    fn scene(&mut self, root: &dyn TableLike) -> Option<Scene> {
        let tables = || TABLES.iter().map(|table| table.name).chain(MANY).chain(["effects"]);
        let known = |name: &str| ROOT.keys.iter().any(|key| key.name == name) || tables().any(|table| table == name);
        for (name, item) in root.iter().filter(|(name, _)| !known(name)) {
            let at = key_span(root, name);
            match item.is_table_like() || item.is_array_of_tables() {
                true => self.unknown(&format!("table [{name}]"), name, at, tables()),
                false => self.unknown_key(&ROOT, name, at),
            }
        }
        let head = self.values(&ROOT, root, 0..0, true);
        let tables = TABLES.iter().map(|table| (table.name, self.table(table, root))).collect();
        let duration_s = head.as_ref().map_or(f64::INFINITY, |head| head.number("duration_s"));
        let script = self.script(root, duration_s);
        let effects = self.effects(root);
        let events = self.events(root, duration_s, &effects);
        let bounds = self.bounds(root);
        let head = head?;
        let scene = Scene {
            name: stem(self.file),
            text: self.text.to_owned(),
            set: Vec::new(),
            about: head.text("about").to_owned(),
            seed: head.whole("seed") as u64,
            duration_s: head.number("duration_s"),
            tables,
            script,
            events,
            effects,
            bounds,
        };
        if self.errors.is_empty()
            && let Err(error) = Config::shipped(&scene.params())
        {
            let at = root.get("controller").map_or(0..0, |_| key_span(root, "controller"));
            self.error(at, format!("the controller refuses its parameters: {error}"), "");
        }
        Some(scene)
    }

    /// Reads a table that occurs at most once.
    fn table(&mut self, table: &Table, root: &dyn TableLike) -> Values {
        let at = key_span(root, table.name);
        let values = match root.get(table.name).map(Item::as_table_like) {
            Some(Some(given)) => self.values(table, given, at, false),
            Some(None) => {
                self.error(at, format!("`{}` is a table", table.name), format!("[{}], once", table.name));
                None
            }
            None => None,
        };
        values.unwrap_or_else(|| Values::defaults(table.keys))
    }

    /// Returns the tables of a `[[name]]`, each with its place.
    pub fn many<'i>(&mut self, table: &Table, root: &'i dyn TableLike) -> Vec<(&'i dyn TableLike, Span)> {
        let Some(item) = root.get(table.name) else { return Vec::new() };
        let at = key_span(root, table.name);
        if let Some(tables) = item.as_array_of_tables() {
            return tables.iter().map(|given| (given as &dyn TableLike, given.span().unwrap_or(at.clone()))).collect();
        }
        let array = item.as_array().map(|array| array.iter().map(|value| (value.as_inline_table(), value.span())));
        let inline = array.and_then(|tables| {
            tables.map(|(given, span)| Some((given? as &dyn TableLike, span.unwrap_or(at.clone())))).collect()
        });
        inline.unwrap_or_else(|| {
            let message = format!("`{}` is a list of tables", table.name);
            self.error(at, message, format!("[[{}]], any number of times", table.name));
            Vec::new()
        })
    }

    /// Refuses a time that is out of order or beyond the end of the scene.
    fn time(&mut self, what: &str, given: &dyn TableLike, at_s: f64, before_s: Option<f64>, duration_s: f64) {
        let at = || item_span(given, "at_s");
        if let Some(before_s) = before_s.filter(|before_s| *before_s > at_s) {
            let message = format!("{what} not in order of time: {at_s} s after {before_s} s");
            self.error(at(), message, format!("at_s of {before_s} or later"));
        }
        if at_s > duration_s {
            let message = format!("this never happens: the scene ends at {duration_s} s");
            self.error(at(), message, format!("at_s of 0 to {duration_s}"));
        }
    }

    fn script(&mut self, root: &dyn TableLike, duration_s: f64) -> Vec<Goal> {
        let mut script: Vec<Goal> = Vec::new();
        for (given, at) in self.many(&SCRIPT, root) {
            let Some(values) = self.values(&SCRIPT, given, at, false) else { continue };
            let goal = Goal { at_s: values.number("at_s"), goal_n: values.number("goal_n") };
            self.time("the script is", given, goal.at_s, script.last().map(|before| before.at_s), duration_s);
            script.push(goal);
        }
        script
    }

    fn events(&mut self, root: &dyn TableLike, duration_s: f64, effects: &[NamedEffect]) -> Vec<Event> {
        let mut events: Vec<Event> = Vec::new();
        let massive = |named: &NamedEffect| named.effect.name == "object_mass" && named.values.number("mass_g") > 0.0;
        let movable = effects.iter().any(massive);
        for (given, at) in self.many(&EVENT, root) {
            let Some(head) = self.values(&EVENT, given, at.clone(), true) else { continue };
            let name = head.text("kind");
            let Some(kind) = KINDS.iter().find(|kind| kind.name == name) else {
                let names = KINDS.iter().map(|kind| kind.name);
                self.unknown(&format!("kind of event `{name}`"), name, item_span(given, "kind"), names);
                continue;
            };
            let Some(values) = self.values(kind, given, at, false) else { continue };
            let event = Event::new(kind, values);
            self.time("the events are", given, event.at_s, events.last().map(|before| before.at_s), duration_s);
            if movable && event.moves_object() {
                let message = format!("`{}` cannot act on an object that the fingers move", kind.name);
                self.error(item_span(given, "kind"), message, "without a mass in [effects.object_mass]");
            }
            events.push(event);
        }
        events
    }

    fn effects(&mut self, root: &dyn TableLike) -> Vec<NamedEffect> {
        let Some(item) = root.get("effects") else { return Vec::new() };
        let Some(given) = item.as_table_like() else {
            self.error(key_span(root, "effects"), "`effects` is a table of tables", "[effects.NAME] for each effect");
            return Vec::new();
        };
        for (name, _) in given.iter().filter(|(name, _)| effects::all().all(|effect| effect.name != *name)) {
            let names: Vec<_> = effects::all().map(|effect| effect.name).collect();
            self.unknown(&format!("effect `{name}`"), name, key_span(given, name), names.iter().copied());
        }
        let mut named = Vec::new();
        for effect in effects::all() {
            let Some(item) = given.get(effect.name) else { continue };
            let at = key_span(given, effect.name);
            let Some(table) = item.as_table_like() else {
                let allowed = format!("[effects.{}]", effect.name);
                self.error(at, format!("the effect `{}` is a table", effect.name), allowed);
                continue;
            };
            let described = Table { name: effect.name, about: effect.about, keys: effect.keys };
            named.extend(self.values(&described, table, at, false).map(|values| NamedEffect { effect, values }));
        }
        named
    }

    fn bounds(&mut self, root: &dyn TableLike) -> Vec<Bound> {
        let mut bounds: Vec<Bound> = Vec::new();
        for (given, place) in self.many(&EXPECT, root) {
            let Some(values) = self.values(&EXPECT, given, place.clone(), false) else { continue };
            let bound = Bound {
                metric: self.metric(given, &values),
                min: values.optional("min"),
                max: values.optional("max"),
                max_per_goal_n: values.optional("max_per_goal_n"),
            };
            if bounds.iter().any(|before| before.metric == bound.metric) {
                let message = format!("bounds of `{}` for the second time", bound.metric);
                self.error(item_span(given, "metric"), message, "one [[expect]] a metric, with min, max or both");
            }
            let by_goal = metrics::BY_GOAL.iter().map(|(name, _)| *name);
            if bound.max_per_goal_n.is_some() {
                let name = bound.metric.rsplit('.').next().unwrap_or_default();
                let message = if by_goal.clone().all(|known| known != name) {
                    Some(format!("`{}` has no value for each goal", bound.metric))
                } else {
                    bound.max.is_none().then(|| "`max_per_goal_n` without `max`".into())
                };
                if let Some(message) = message {
                    let allowed = format!("with max, and of {}", by_goal.collect::<Vec<_>>().join(", "));
                    self.error(item_span(given, "max_per_goal_n"), message, allowed);
                }
            }
            match (bound.min, bound.max) {
                (None, None) => {
                    self.error(place, format!("`{}` without a bound", bound.metric), "min, max or both");
                }
                (Some(min), Some(max)) if min > max => {
                    self.error(item_span(given, "min"), format!("min of {min} is above max of {max}"), "min <= max");
                }
                _ => {}
            }
            bounds.push(bound);
        }
        bounds
    }
}

impl Reader<'_> {
    /// Returns the checked values of a table; none if one is wrong or missing. `open` accepts unknown keys.
    pub fn values(&mut self, table: &Table, given: &dyn TableLike, place: Span, open: bool) -> Option<Values> {
        let errors = self.errors.len();
        let strange = |name: &str| !open && table.keys.iter().all(|key| key.name != name);
        for (name, _) in given.iter().filter(|(name, _)| strange(name)) {
            self.unknown_key(table, name, key_span(given, name));
        }
        let mut values = Values::default();
        for key in table.keys {
            let value = match given.get(key.name) {
                Some(item) => self.value(key, item, item_span(given, key.name)),
                None if matches!(key.kind, Kind::Optional { .. }) => continue,
                None => key.default().or_else(|| {
                    // A key with a wrong name is reported already.
                    let mistaken = given.iter().any(|(name, _)| alike(name, [key.name]).is_some() && strange(name));
                    if !mistaken {
                        let message = format!("{} lacks `{}`", table.title(), key.name);
                        self.error(place.clone(), message, format!("{}: {}", key.name, key.allowed()));
                    }
                    None
                }),
            };
            if let Some(value) = value {
                values.insert(key.name, value);
            }
        }
        let has = |key: &Key| values.iter().any(|(name, _)| name == key.name);
        let complete = table.keys.iter().all(|key| matches!(key.kind, Kind::Optional { .. }) || has(key));
        (complete && self.errors.len() == errors).then_some(values)
    }

    fn unknown_key(&mut self, table: &Table, name: &str, at: Span) {
        let words = table.keys.iter().map(|key| key.name);
        let suggestion = alike(name, words.clone());
        let meant = suggestion.and_then(|word| table.keys.iter().find(|key| key.name == word));
        let message = match meant {
            Some(Key { name: full, .. }) if full.rsplit_once('_').is_some_and(|(stem, _)| stem == name) => {
                format!("`{name}` lacks its unit in {}", table.title())
            }
            _ => format!("unknown key `{name}` in {}", table.title()),
        };
        let allowed = match meant {
            Some(key) => format!("{}: {}", key.name, key.allowed()),
            None => words.collect::<Vec<_>>().join(", "),
        };
        self.mistaken(at, message, allowed, suggestion);
    }

    fn value(&mut self, key: &Key, item: &Item, at: Span) -> Option<Value> {
        let name = key.name;
        let number = item.as_float().or_else(|| item.as_integer().map(|whole| whole as f64));
        // Adding 0 turns -0 into 0.
        let within = |min: f64, max: f64| number.filter(|n| (min..=max).contains(n)).map(|n| n + 0.0);
        let value = match key.kind {
            Kind::Number { min, max, .. } => within(min, max).map(Value::Number),
            Kind::Optional { whole: true, .. } if item.as_integer().is_none() => None,
            Kind::Optional { min, max, .. } => within(min, max).map(Value::Number),
            Kind::Whole { min, max, .. } => {
                item.as_integer().filter(|whole| (min..=max).contains(whole)).map(Value::Whole)
            }
            Kind::Text => item.as_str().filter(|text| !text.contains('\n')).map(|text| Value::Text(text.to_owned())),
            Kind::Word { words, .. } => match item.as_str() {
                Some(given) if !words.contains(&given) => {
                    let message = format!("`{name}` does not know \"{given}\"");
                    self.mistaken(at, message, key.allowed(), alike(given, words.iter().copied()));
                    return None;
                }
                given => words.iter().find(|word| Some(**word) == given).map(|word| Value::Word(word)),
            },
            Kind::Taxels => pairs(item, ROWS as i64).map(Value::Pairs),
        };
        if value.is_none() {
            let given = self.text.get(at.clone()).unwrap_or("that").to_owned();
            let given = given.lines().next().unwrap_or("that");
            let right_type = match key.kind {
                Kind::Number { .. } | Kind::Optional { whole: false, .. } => number.is_some(),
                Kind::Whole { .. } | Kind::Optional { .. } => item.as_integer().is_some(),
                _ => false,
            };
            let message = match right_type {
                true => format!("`{name}` of {given} is out of its range"),
                false => format!("`{name}` cannot be {given}"),
            };
            self.error(at, message, key.allowed());
        }
        value
    }
}

/// Reads pairs of numbers from 0, each pair once.
fn pairs(item: &Item, below: i64) -> Option<Vec<[i64; 2]>> {
    let mut pairs = Vec::new();
    for pair in item.as_array()? {
        let pair = pair.as_array()?;
        let at = |place| pair.get(place)?.as_integer().filter(|number| (0..below).contains(number));
        let pair = [at(0)?, at(1).filter(|_| pair.len() == 2)?];
        if pairs.contains(&pair) {
            return None;
        }
        pairs.push(pair);
    }
    Some(pairs)
}

/// Name of a file without its ending.
pub(crate) fn stem(file: &str) -> String {
    Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Range of a key in the text.
pub(crate) fn key_span(table: &dyn TableLike, name: &str) -> Span {
    table.get_key_value(name).and_then(|(key, _)| key.span()).unwrap_or(0..0)
}

/// Range of the value of a key in the text.
pub(crate) fn item_span(table: &dyn TableLike, name: &str) -> Span {
    table.get(name).and_then(Item::span).unwrap_or_else(|| key_span(table, name))
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Place, message, marked line, allowed values, and the word that was probably meant.
    pub text: String,
}

impl SceneError {
    /// Creates an error at a range of bytes of a text.
    pub fn new(file: &str, text: &str, at: Span, message: &str, allowed: &str) -> Self {
        let start = (0..=at.start.min(text.len())).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
        let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let source_line = text[line_start..].lines().next().unwrap_or("");
        let line = text[..line_start].matches('\n').count() + 1;
        let column = text[line_start..start].chars().count() + 1;
        let meant = text.get(start..at.end).and_then(|meant| meant.lines().next()).unwrap_or("");
        let marks = "^".repeat(meant.chars().count().max(1));
        let margin = " ".repeat(line.to_string().len());
        // Tabs remain, so that the marks are below the marked text.
        let before: String = source_line.chars().take(column - 1).map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        let mut text =
            format!("{file}:{line}:{column}: {message}\n  {line} | {source_line}\n  {margin} | {before}{marks}");
        if !allowed.is_empty() {
            text += &format!("\n  allowed: {allowed}");
        }
        Self { line, column, text }
    }
}

/// All mistakes, in the order of the text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneErrors(pub Vec<SceneError>);

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let errors: Vec<&str> = self.0.iter().map(|error| error.text.as_str()).collect();
        f.write_str(&errors.join("\n\n"))
    }
}

impl std::error::Error for SceneErrors {}

/// Returns the word that was probably meant: one that differs only by its unit, else the most similar.
pub fn alike<'a>(given: &str, words: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let stem = |word: &str| word.rsplit_once('_').map_or(word.to_owned(), |(stem, _)| stem.to_owned());
    let score = |word: &str| {
        if stem(word) == given || (given.contains('_') && stem(word) == stem(given)) {
            2.0
        } else {
            strsim::jaro_winkler(given, word)
        }
    };
    let best = words.into_iter().map(|word| (score(word), word)).max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    (best.0 > 0.8).then_some(best.1)
}

/// Returns the question that ends a message about a word that is close to a known one, else nothing.
pub fn did_you_mean<'a>(given: &str, words: impl IntoIterator<Item = &'a str>) -> String {
    alike(given, words).map_or(String::new(), |meant| format!("; did you mean `{meant}`?"))
}
