//! Reader of scenes: any text gives a scene, or errors with places inside the text; none causes a panic. Also the rules
//! for the keys of the tables and of the effects.

use crate::*;
use fastrand::Rng;
use sim::cli::load;
use sim::events::{EVENT, KINDS};
use sim::scene::tables::{EXPECT, Key, Kind, ROOT, SCRIPT, TABLES};
use sim::scene::{self, SceneErrors, read, set};
use sim::{effects, population};

/// Names and texts of the library.
fn library() -> Vec<(String, String)> {
    let names = scene::library_names().unwrap();
    names.into_iter().map(|name| (name.clone(), scene::library_text(&name).unwrap().1)).collect()
}

fn read_it(text: &str) -> Result<Scene, SceneErrors> {
    read("my.toml", text)
}

/// Scene of a text, preceded by the keys that every scene needs.
fn scene(text: &str) -> Scene {
    read_it(&format!("about = \"\"\nduration_s = 1\n{text}")).unwrap_or_else(|errors| panic!("{errors}"))
}

#[test]
fn a_goal_may_come_as_an_inline_table_and_at_the_same_time_as_another() {
    let scene = scene("script = [{ at_s = 1, goal_n = 1.5 }, { at_s = 1, goal_n = 0 }]\n");
    assert_eq!(scene.script.iter().map(|event| event.goal_n).collect::<Vec<_>>(), [1.5, 0.0]);
    assert_eq!(scene.table("tip").number("radius_mm"), 10.0);
}

#[test]
fn the_controller_knows_the_finger_unless_told_otherwise() {
    let params = |tables: &str| scene(tables).params();
    // The reference finger without effects, and with its direction confirmed.
    let plain = Params { row_sag_ppb_per_code: 0, friction_unm: 0, direction_confirmed: 1, ..Params::DEFAULT };
    assert_eq!(params(""), plain);
    assert_eq!(params("[effects.row_sag]").row_sag_ppb_per_code, Params::DEFAULT.row_sag_ppb_per_code);
    assert_eq!(params("[tip]\nmodulus_kpa = 400.5").modulus_pa, 400_500);
    assert_eq!(params("[tip]\nmodulus_kpa = 400\n[controller]\nmodulus_pa = 250000").modulus_pa, 250_000);
}

#[rustfmt::skip]
const TOKENS: &[&str] = &[
    "about", "duration_s", "seed", "tip", "effects", "effects.noise", "script", "expect", "controller", "object",
    "rms_codes", "at_s", "goal_n", "metric", "min", "max", "radius_mm", "dead", "[", "]", "[[", "]]", "{", "}", "=",
    ".", ",", "\n", "\n", "\n", " ", "\t", "\"", "'", "\"\"\"", "#", "1", "-1", "0.5", "1e308", "1e400", "nan",
    "-inf", "0x10", "true", "1979-05-27", "\"x\"", "peak_force_n", "\u{feff}", "\r\n", "\0", "ü", "\u{1F600}",
    "\\u12", "9223372036854775808",
];

fn answers(text: &str) {
    if let Err(errors) = read_it(text) {
        assert!(!errors.0.is_empty(), "refused without a reason:\n{text}");
        for error in &errors.0 {
            assert!(error.line >= 1 && error.line <= text.lines().count().max(1) + 1, "{}", error.text);
            assert!(error.column >= 1);
        }
        let _ = errors.to_string();
    }
}

/// Up to this number of tokens.
fn tokens(rng: &mut Rng, most: usize) -> String {
    (0..rng.usize(0..most)).map(|_| TOKENS[rng.usize(0..TOKENS.len())]).collect()
}

#[test]
fn any_tokens_any_change_to_a_scene_and_any_setting_are_answered() {
    let (mut rng, scenes) = (Rng::with_seed(1), library());
    (0..20_000).for_each(|_| answers(&tokens(&mut rng, 30)));
    for _ in 0..10_000 {
        let mut text: Vec<char> = scenes[rng.usize(0..scenes.len())].1.chars().collect();
        for _ in 0..rng.usize(1..4) {
            let at = rng.usize(0..text.len());
            match rng.u8(0..3) {
                0 => drop(text.drain(at..(at + rng.usize(1..10)).min(text.len()))),
                1 => text.splice(at..at, TOKENS[rng.usize(0..TOKENS.len())].chars()).for_each(drop),
                _ => text[at] = char::from(rng.u8(0..128)),
            }
        }
        answers(&text.into_iter().collect::<String>());
    }
    for _ in 0..5_000 {
        let (place, value) = (tokens(&mut rng, 5), tokens(&mut rng, 3));
        if let Ok(changed) = scene::set(&scenes[0].1, &place, &value) {
            answers(&changed);
        }
    }
}

/// Plain numbers that have no unit.
#[rustfmt::skip]
const PLAIN: &[&str] = &[
    "seed", "ratio", "efficiency", "bits", "min", "max", "fingers", "share", "chip_share", "left", "still",
    "slipping", "teeth", "grip_friction", "row", "column", "factor", "fit_level",
];

fn described() -> Vec<(&'static str, &'static Key)> {
    let tables =
        TABLES.iter().chain([&ROOT, &SCRIPT, &EVENT, &EXPECT]).chain(&KINDS).map(|table| (table.name, table.keys));
    let effects = effects::all().map(|effect| (effect.name, effect.keys));
    tables.chain(effects).flat_map(|(name, keys)| keys.iter().map(move |key| (name, key))).collect()
}

#[test]
fn every_quantity_ends_with_its_unit() {
    let mut without = Vec::new();
    for (table, key) in described() {
        // Those of the controller are the firmware's, which has its own.
        let quantity = matches!(key.kind, Kind::Number { .. } | Kind::Whole { .. } | Kind::Optional { .. });
        let plain = !quantity || PLAIN.contains(&key.name) || table == "controller";
        without.extend((!plain && output::units::of(key.name).is_none()).then_some((table, key.name)));
    }
    assert!(without.is_empty(), "these have no unit: {without:?}");
}

#[test]
fn every_default_lies_within_its_range_and_every_key_says_what_it_is() {
    for (table, key) in described() {
        assert!(key.about.trim().len() > 3 && key.about.trim().ends_with('.'), "{table}: {}", key.name);
        let fits = match key.kind {
            Kind::Number { min, max, default } => (min..=max).contains(&default.unwrap_or(min)),
            Kind::Whole { min, max, default } => (min..=max).contains(&default.unwrap_or(min)),
            Kind::Word { words, default } => default.is_none_or(|default| words.contains(&default)),
            Kind::Optional { min, max, .. } => min <= max,
            Kind::Text | Kind::Taxels => true,
        };
        assert!(fits, "{table}: {}", key.name);
    }
}

#[test]
fn every_effect_is_described_and_no_name_comes_twice() {
    let distinct = |names: Vec<&str>| BTreeSet::from_iter(names.iter().copied()).len() == names.len();
    assert!(distinct(effects::all().map(|effect| effect.name).collect()));
    for effect in effects::all() {
        assert!(distinct(effect.keys.iter().map(|key| key.name).collect()), "{}", effect.name);
        assert!(!effect.equations.is_empty() && !effect.state.is_empty() && !effect.reference.is_empty());
    }
}

const SCENE: &str = "about = \"a\" # kept\nduration_s = 1.0\n[[script]]\nat_s = 0 # kept too\ngoal_n = 1\n[[script]]\nat_s = 0.5\ngoal_n = 2\n";

#[test]
fn what_is_set_is_read_and_comments_stay() {
    let changes = [("seed", "9"), ("duration_s", "2"), ("effects.noise.rms_codes", "4"), ("tip.modulus_kpa", "300")];
    let text = set(SCENE, "script.1.goal_n", "3.5").unwrap();
    let text = changes.into_iter().fold(text, |text, (place, value)| set(&text, place, value).unwrap());
    assert!(text.contains("about = \"a\" # kept\n") && text.contains("at_s = 0 # kept too\n"), "{text}");
    let scene = read_it(&text).unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!((scene.seed, scene.duration_s, scene.script[1].goal_n), (9, 2.0, 3.5));
    assert_eq!(scene.effects[0].values.number("rms_codes"), 4.0);
    assert_eq!(scene.table("tip").number("modulus_kpa"), 300.0);
}

#[test]
fn what_cannot_be_set_is_told() {
    for (place, value) in
        [("script.2.goal_n", "1"), ("tip.1.x", "1"), ("about.x", "1"), ("", "1"), ("seed", "1 2"), ("seed", "")]
    {
        assert!(set(SCENE, place, value).is_err(), "{place} = {value}");
    }
    let error = |set: &str| load("wall", &[set.into()], None).expect_err("a mistake");
    assert!(error("tip.radius = 3").contains("did you mean `radius_mm`?"));
    assert!(error("tip.radius_mm").contains("TABLE.KEY=VALUE"));
    assert!(load("wal", &[], None).expect_err("no scene").contains("did you mean `wall`?"));
    assert_eq!(load("wall", &[], Some(12)).unwrap().seed, 12);
}

// Messages about mistakes in scenes and populations. The lists hold texts, from line 3 of their files on, and the whole
// message for each; `[...]` in a message stands for any text.

/// Checks the messages of a list for texts that begin with a head.
fn check(list: &str, head: &str, read: impl Fn(&str) -> Result<(), String>) {
    let mut wrong = Vec::new();
    for case in list.split("=== ").skip(1) {
        let (lines, expected) = case.split_once('\n').and_then(|(_, case)| case.split_once("---\n")).expect("a case");
        let message = read(&format!("{head}{lines}")).expect_err(case);
        let (front, end) = expected.trim_end().split_once("[...]").unwrap_or((expected.trim_end(), ""));
        let fits = message
            .strip_prefix(front)
            .is_some_and(|rest| rest == end || expected.contains("[...]") && rest.ends_with(end));
        wrong.extend((!fits).then(|| format!("{case}instead:\n{message}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn mistakes_in_scenes() {
    check(include_str!("mistakes_in_scenes.txt"), "about = \"a test\"\nduration_s = 1\n", |text| {
        scene::read("my.toml", text).map(drop).map_err(|errors| errors.to_string())
    });
}

#[test]
fn mistakes_in_populations() {
    check(include_str!("mistakes_in_populations.txt"), "about = \"a test\"\nduration_s = 0.06\n", |text| {
        population::read("my.toml", text).map(drop).map_err(|errors| errors.to_string())
    });
}

#[test]
fn all_mistakes_come_at_once_in_the_order_of_the_text() {
    let text =
        "about = 3\nseeds = 4\n[tip]\nradius_mm = 100\n[effects.noise]\nrms = 1\n[[expect]]\nmetric = \"x\"\nmin = 1\n";
    let errors = scene::read("my.toml", text).expect_err("six mistakes").0;
    let places: Vec<_> = errors.iter().map(|error| (error.line, error.column)).collect();
    // `duration_s` is missing: reported at the beginning.
    assert_eq!(places, [(1, 1), (1, 9), (2, 1), (4, 13), (6, 1), (8, 10)]);
}
