//! Messages about mistakes in scenes and populations. The lists hold texts, from line 3 of their files on, and the whole
//! message for each; `[...]` in a message stands for any text.

use sim::{metrics, population, scene};

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
    let names = metrics::names();
    check(include_str!("mistakes_in_scenes.txt"), "about = \"a test\"\nduration_s = 1\n", |text| {
        scene::read("my.toml", text, &names).map(drop).map_err(|errors| errors.to_string())
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
    let errors = scene::read("my.toml", text, &metrics::names()).expect_err("six mistakes").0;
    let places: Vec<_> = errors.iter().map(|error| (error.line, error.column)).collect();
    // `duration_s` is missing: reported at the beginning.
    assert_eq!(places, [(1, 1), (1, 9), (2, 1), (4, 13), (6, 1), (8, 10)]);
}
