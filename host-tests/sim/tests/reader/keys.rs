//! What the keys of the tables and of the effects keep to.

use crate::read_it;
use sim::key::{Key, Kind};
use sim::registry;
use sim::scene::tables::{EXPECT, ROOT, SCRIPT, TABLES};
use sim::scene::text;

/// Plain numbers that have no unit.
const PLAIN: &[&str] = &[
    "seed",
    "ratio",
    "efficiency",
    "bits",
    "min",
    "max",
    "fingers",
    "share",
    "left",
    "still",
    "slipping",
    "teeth",
    "grip_friction",
];

fn described() -> Vec<(&'static str, &'static Key)> {
    let tables = TABLES.iter().chain([&ROOT, &SCRIPT, &EXPECT]).map(|table| (table.name, table.keys));
    let effects = registry::all().map(|effect| (effect.name, effect.keys));
    tables.chain(effects).flat_map(|(name, keys)| keys.iter().map(move |key| (name, key))).collect()
}

#[test]
fn every_quantity_ends_with_its_unit() {
    let mut without = Vec::new();
    for (table, key) in described() {
        // Those of the controller are the firmware's, which has its own.
        let quantity = matches!(key.kind, Kind::Number { .. } | Kind::Whole { .. } | Kind::Optional { .. });
        let plain = !quantity || PLAIN.contains(&key.name) || table == "controller";
        without.extend((!plain && key.unit().is_none()).then_some((table, key.name)));
    }
    assert!(without.is_empty(), "these have no unit: {without:?}");
}

#[test]
fn every_default_lies_within_its_range_and_every_key_says_what_it_is() {
    for (table, key) in described() {
        assert!(key.about.trim().len() > 3 && key.about.trim().ends_with('.'), "{table}: {}", key.name);
        let fits = match key.kind {
            Kind::Number { min, max, default } => {
                min <= max && default.is_none_or(|default| (min..=max).contains(&default))
            }
            Kind::Whole { min, max, default } => {
                min <= max && default.is_none_or(|default| (min..=max).contains(&default))
            }
            Kind::Word { words, default } => default.is_none_or(|default| words.contains(&default)),
            Kind::Optional { min, max, .. } => min <= max,
            Kind::Text | Kind::Pairs { .. } => true,
        };
        assert!(fits, "{table}: {}", key.name);
    }
}

#[test]
fn no_name_comes_twice() {
    let mut names: Vec<&str> = registry::all().map(|effect| effect.name).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), registry::all().count());
    for effect in registry::all() {
        let mut keys: Vec<&str> = effect.keys.iter().map(|key| key.name).collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), effect.keys.len(), "{}", effect.name);
    }
}

#[test]
fn every_effect_may_be_named_with_an_empty_table_and_without_magnitude() {
    let head = "about = \"\"\nduration_s = 1\n";
    for effect in registry::all() {
        for table in [format!("[effects.{}]\n", effect.name), text::zero(effect)] {
            let scene = read_it(&format!("{head}{table}")).unwrap_or_else(|errors| panic!("{errors}"));
            assert_eq!(scene.effects.len(), 1);
        }
        assert!(!effect.equations.is_empty() && !effect.state.is_empty() && !effect.reference.is_empty());
    }
}
