//! A table's values, each checked by what its key allows.

use super::super::error::alike;
use super::super::tables::Table;
use super::Reader;
use crate::key::{Key, Kind, Value, Values};
use std::ops::Range;
use toml_edit::{Item, TableLike};

impl Reader<'_> {
    /// The checked values of a table; none where one is wrong or missing. `open` leaves what is not described to
    /// others.
    pub(super) fn values(
        &mut self,
        table: &Table,
        given: &dyn TableLike,
        place: Range<usize>,
        open: bool,
    ) -> Option<Values> {
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
                    // What was given under a mistaken name is reported already.
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
        let complete = table
            .keys
            .iter()
            .all(|key| matches!(key.kind, Kind::Optional { .. }) || values.iter().any(|(name, _)| name == key.name));
        (complete && self.errors.len() == errors).then_some(values)
    }

    pub(super) fn unknown_key(&mut self, table: &Table, name: &str, at: Range<usize>) {
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
        self.error(at, message, allowed).suggestion = suggestion.map(str::to_owned);
    }

    fn value(&mut self, key: &Key, item: &Item, at: Range<usize>) -> Option<Value> {
        let name = key.name;
        let number = item.as_float().or_else(|| item.as_integer().map(|whole| whole as f64));
        // -0 is 0 for everybody; adding 0 makes it so.
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
                    let suggestion = alike(given, words.iter().copied()).map(str::to_owned);
                    let message = format!("`{name}` does not know \"{given}\"");
                    self.error(at, message, key.allowed()).suggestion = suggestion;
                    return None;
                }
                given => words.iter().find(|word| Some(**word) == given).map(|word| Value::Word(word)),
            },
            Kind::Pairs { below } => pairs(item, below).map(Value::Pairs),
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

/// Pairs of numbers from 0, each pair once.
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

/// Where a key stands.
pub(crate) fn key_span(table: &dyn TableLike, name: &str) -> Range<usize> {
    table.get_key_value(name).and_then(|(key, _)| key.span()).unwrap_or(0..0)
}

/// Where its value stands.
pub(crate) fn item_span(table: &dyn TableLike, name: &str) -> Range<usize> {
    table.get(name).and_then(Item::span).unwrap_or_else(|| key_span(table, name))
}
