//! Whatever the text, the reader answers: with a scene, or with errors that lie in it.

use crate::{library, read_it};
use fastrand::Rng;
use sim::scene::text;

const TOKENS: &[&str] = &[
    "about",
    "duration_s",
    "seed",
    "tip",
    "effects",
    "effects.noise",
    "script",
    "expect",
    "controller",
    "object",
    "rms_codes",
    "at_s",
    "goal_n",
    "metric",
    "min",
    "max",
    "radius_mm",
    "dead",
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ".",
    ",",
    "\n",
    "\n",
    "\n",
    " ",
    "\t",
    "\"",
    "'",
    "\"\"\"",
    "#",
    "1",
    "-1",
    "0.5",
    "1e308",
    "1e400",
    "nan",
    "-inf",
    "0x10",
    "true",
    "1979-05-27",
    "\"x\"",
    "peak_force_n",
    "\u{feff}",
    "\r\n",
    "\0",
    "ü",
    "\u{1F600}",
    "\\u12",
    "9223372036854775808",
];

fn answers(text: &str) {
    if let Err(errors) = read_it(text) {
        assert!(!errors.0.is_empty(), "refused without a reason:\n{text}");
        for error in &errors.0 {
            assert!(error.line >= 1 && error.line <= text.lines().count().max(1) + 1, "{error}");
            assert!(error.column >= 1);
        }
        let _ = errors.to_string();
    }
}

#[test]
fn any_tokens_are_answered() {
    let mut rng = Rng::with_seed(1);
    for _ in 0..20_000 {
        let text: String = (0..rng.usize(0..30)).map(|_| TOKENS[rng.usize(0..TOKENS.len())]).collect();
        answers(&text);
    }
}

#[test]
fn any_change_to_a_scene_is_answered() {
    let mut rng = Rng::with_seed(2);
    let scenes = library();
    for _ in 0..10_000 {
        let mut text: Vec<char> = scenes[rng.usize(0..scenes.len())].1.chars().collect();
        for _ in 0..rng.usize(1..4) {
            let at = rng.usize(0..text.len());
            match rng.u8(0..3) {
                0 => drop(text.drain(at..(at + rng.usize(1..10)).min(text.len()))),
                1 => {
                    let token = TOKENS[rng.usize(0..TOKENS.len())].chars();
                    text.splice(at..at, token).for_each(drop);
                }
                _ => text[at] = char::from(rng.u8(0..128)),
            }
        }
        answers(&text.into_iter().collect::<String>());
    }
}

#[test]
fn any_setting_is_answered() {
    let mut rng = Rng::with_seed(3);
    let scenes = library();
    for _ in 0..5_000 {
        let mut some = |most| (0..rng.usize(0..most)).map(|_| TOKENS[rng.usize(0..TOKENS.len())]).collect::<String>();
        let (place, value) = (some(5), some(3));
        if let Ok(changed) = text::set(&scenes[0].1, &place, &value) {
            answers(&changed);
        }
    }
}
