//! From a scene's text to the scene. Strict: whatever is not described is an error, and all errors of a text come
//! together.

mod values;

pub(crate) use values::{item_span, key_span};

use super::error::{SceneError, SceneErrors, alike};
use super::tables::{EXPECT, MANY, ROOT, SCRIPT, TABLES, Table};
use super::{Bound, Goal, Scene, controller};
use crate::events::{EVENT, Event, KINDS};
use crate::key::Values;
use crate::metrics;
use crate::registry::{self, Named};
use fingertip::shipped::Config;
use std::ops::Range;
use std::path::Path;
use toml_edit::{Document, TableLike};

/// Reads a scene. `file` names it in errors; `metrics` are those that `[[expect]]` may name.
pub fn read(file: &str, text: &str, metrics: &[&str]) -> Result<Scene, SceneErrors> {
    let mut reader = Reader { file, text, errors: Vec::new() };
    let scene = match Document::parse(text) {
        Ok(document) => reader.scene(document.as_table(), metrics),
        Err(error) => {
            let message = format!("this is not TOML: {}", error.message().trim().replace('\n', "; "));
            reader.error(error.span().unwrap_or(0..0), message, String::new());
            None
        }
    };
    match scene {
        Some(scene) if reader.errors.is_empty() => Ok(scene),
        _ => {
            reader.errors.sort_by_key(|error| (error.line, error.column));
            Err(SceneErrors(reader.errors))
        }
    }
}

struct Reader<'a> {
    file: &'a str,
    text: &'a str,
    errors: Vec<SceneError>,
}

impl Reader<'_> {
    fn error(&mut self, at: Range<usize>, message: String, allowed: String) -> &mut SceneError {
        self.errors.push(SceneError::new(self.file, self.text, at, message, allowed));
        self.errors.last_mut().expect("one was pushed")
    }

    /// Something that is not described, with the described ones.
    fn unknown<'w>(&mut self, what: &str, given: &str, at: Range<usize>, words: impl Iterator<Item = &'w str> + Clone) {
        let allowed = words.clone().collect::<Vec<_>>().join(", ");
        let suggestion = alike(given, words).map(str::to_owned);
        self.error(at, format!("unknown {what}"), allowed).suggestion = suggestion;
    }

    /// None where a part is missing without which there is no scene; the error is among the others.
    fn scene(&mut self, root: &dyn TableLike, metrics: &[&str]) -> Option<Scene> {
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
        let bounds = self.bounds(root, metrics);
        let head = head?;
        let stem = Path::new(self.file).file_stem().map_or("".into(), |stem| stem.to_string_lossy());
        let scene = Scene {
            name: stem.into_owned(),
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
            && let Err(error) = Config::shipped(&controller::params(&scene))
        {
            let at = root.get("controller").map_or(0..0, |_| key_span(root, "controller"));
            self.error(at, format!("the controller refuses its parameters: {error}"), String::new());
        }
        Some(scene)
    }

    /// A table that stands at most once.
    fn table(&mut self, table: &Table, root: &dyn TableLike) -> Values {
        let Some(item) = root.get(table.name) else {
            return Values::defaults(table.keys);
        };
        let at = key_span(root, table.name);
        match item.as_table_like() {
            Some(given) => self.values(table, given, at, false).unwrap_or_else(|| Values::defaults(table.keys)),
            None => {
                let message = format!("`{}` is a table", table.name);
                self.error(at, message, format!("[{}], once", table.name));
                Values::defaults(table.keys)
            }
        }
    }

    /// The tables of a `[[name]]`, each with its place.
    fn many<'i>(&mut self, table: &Table, root: &'i dyn TableLike) -> Vec<(&'i dyn TableLike, Range<usize>)> {
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

    /// Refuses a time that is not in order or beyond the scene's end.
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

    fn events(&mut self, root: &dyn TableLike, duration_s: f64, effects: &[Named]) -> Vec<Event> {
        let mut events: Vec<Event> = Vec::new();
        let massive = |named: &Named| named.effect.name == "object_mass" && named.values.number("mass_g") > 0.0;
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
                self.error(item_span(given, "kind"), message, "without a mass in [effects.object_mass]".into());
            }
            events.push(event);
        }
        events
    }

    fn effects(&mut self, root: &dyn TableLike) -> Vec<Named> {
        let Some(item) = root.get("effects") else { return Vec::new() };
        let Some(given) = item.as_table_like() else {
            let allowed = "[effects.NAME] for each effect";
            self.error(key_span(root, "effects"), "`effects` is a table of tables".into(), allowed.into());
            return Vec::new();
        };
        for (name, _) in given.iter().filter(|(name, _)| registry::all().all(|effect| effect.name != *name)) {
            let names: Vec<_> = registry::all().map(|effect| effect.name).collect();
            self.unknown(&format!("effect `{name}`"), name, key_span(given, name), names.iter().copied());
        }
        let mut named = Vec::new();
        for effect in registry::all() {
            let Some(item) = given.get(effect.name) else { continue };
            let at = key_span(given, effect.name);
            let Some(table) = item.as_table_like() else {
                let allowed = format!("[effects.{}]", effect.name);
                self.error(at, format!("the effect `{}` is a table", effect.name), allowed);
                continue;
            };
            let described = Table { name: effect.name, about: effect.about, keys: effect.keys };
            named.extend(self.values(&described, table, at, false).map(|values| Named { effect, values }));
        }
        named
    }

    fn bounds(&mut self, root: &dyn TableLike, metrics: &[&str]) -> Vec<Bound> {
        let mut bounds: Vec<Bound> = Vec::new();
        for (given, place) in self.many(&EXPECT, root) {
            let Some(values) = self.values(&EXPECT, given, place.clone(), false) else { continue };
            let bound = Bound {
                metric: values.text("metric").to_owned(),
                min: values.optional("min"),
                max: values.optional("max"),
                max_per_goal_n: values.optional("max_per_goal_n"),
            };
            let metric = || item_span(given, "metric");
            if !metrics.contains(&bound.metric.as_str()) {
                // Those of each finger are the same again.
                let words = metrics.iter().copied().filter(|metric| !metric.contains('.'));
                self.unknown(&format!("metric `{}`", bound.metric), &bound.metric, metric(), words);
            }
            if bounds.iter().any(|before| before.metric == bound.metric) {
                let message = format!("bounds of `{}` for the second time", bound.metric);
                self.error(metric(), message, "one [[expect]] a metric, with min, max or both".into());
            }
            let by_goal = metrics::BY_GOAL.iter().map(|metric| metric.name);
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
                    self.error(place, format!("`{}` without a bound", bound.metric), "min, max or both".into());
                }
                (Some(min), Some(max)) if min > max => {
                    self.error(
                        item_span(given, "min"),
                        format!("min of {min} is above max of {max}"),
                        "min <= max".into(),
                    );
                }
                _ => {}
            }
            bounds.push(bound);
        }
        bounds
    }
}
