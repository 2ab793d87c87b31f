//! What a scene computes, what it may name, and the page of it all.

use crate::key::Key;
use crate::metrics;
use crate::registry::{self, Description, Family};
use crate::scene::tables::{EXPECT, ROOT, SCRIPT, TABLES, Table};
use crate::scene::{Scene, library, read};
use std::fmt::Write as _;

/// The effects that a scene names, with the equations and the state that each adds.
pub fn scene(scene: &Scene) -> String {
    let mut text = format!("{}: {}\n", scene.name, scene.about);
    let _ = writeln!(
        text,
        "{} s, {} events, {} bounds, seed {}",
        scene.duration_s,
        scene.script.len(),
        scene.bounds.len(),
        scene.seed
    );
    if scene.effects.is_empty() {
        text += "\nIt names no effect: a motor without friction presses an ideal tip on a rigid plane, read without error.\n";
    }
    for named in &scene.effects {
        let Description { name, family, about, equations, state, reference, .. } = named.effect;
        let _ = writeln!(text, "\n{name} ({})\n  {about}", family.name());
        equations.iter().for_each(|line| text += &format!("    {line}\n"));
        let _ = writeln!(text, "  state: {state}\n  source: {reference}");
        for (name, value) in named.values.iter() {
            let _ = writeln!(text, "  {name} = {value}");
        }
    }
    text
}

/// The library's scenes, each with what it shows.
///
/// # Errors
/// The library cannot be read, or a scene of it is broken.
pub fn list() -> Result<String, Box<dyn std::error::Error + Send + Sync>> {
    let names = library::names()?;
    let width = names.iter().map(String::len).max().unwrap_or(0);
    let mut text = String::new();
    for name in names {
        let (path, scene) = library::text(&name)?;
        let about = read(&path.to_string_lossy(), &scene, &metrics::names())?.about;
        let _ = writeln!(text, "{name:width$}  {about}");
    }
    Ok(text)
}

/// Every key, for a terminal.
pub fn keys() -> String {
    let mut text = String::new();
    for table in [&ROOT].into_iter().chain(TABLES).chain([&SCRIPT, &EXPECT]) {
        keys_of(&mut text, &table.title(), table.about, table.keys);
    }
    for effect in registry::all() {
        keys_of(&mut text, &format!("[effects.{}]", effect.name), effect.about, effect.keys);
    }
    text
}

fn keys_of(text: &mut String, title: &str, about: &str, keys: &[Key]) {
    let _ = writeln!(text, "{}  # {about}", title);
    for key in keys {
        let _ = writeln!(text, "  {}: {}", key.name, key.allowed());
        let _ = writeln!(text, "      {}", key.about.trim());
    }
    text.push('\n');
}

/// How the page is made anew.
pub const COMMAND: &str = "cargo xtask docs";

/// The reference page, `docs/scenes.md`.
pub fn page() -> String {
    let mut page = format!(
        "# Scenes\n\nGenerated from `host-tests/sim/src` by `{COMMAND}`: do not edit.\n\n{}\n",
        include_str!("explain/scenes.md").trim()
    );
    page.push_str("\n## Tables\n");
    for table in [&ROOT].into_iter().chain(TABLES).chain([&SCRIPT, &EXPECT]) {
        let title =
            if table.name.is_empty() { "Before the first table".into() } else { format!("`{}`", table.title()) };
        let _ = write!(page, "\n### {title}\n\n{}\n\n", table.about);
        table_of(&mut page, table);
    }
    page.push_str("\n## Effects\n\nThey act in this order within a stage, whatever the order in the scene.\n");
    for family in [Family::Contact, Family::Drive, Family::Sensor, Family::Link] {
        let _ = write!(page, "\n### {}\n", family.title());
        for effect in registry::all().filter(|effect| effect.family == family) {
            effect_of(&mut page, effect);
        }
    }
    let _ = write!(
        page,
        "\n## Metrics\n\nWhat `[[expect]]` may bound. With two fingers, `finger0.` and `finger1.` before a name ask for one of them.\n\n{}",
        metrics::page()
    );
    page
}

fn effect_of(page: &mut String, effect: &Description) {
    let Description { name, about, equations, state, reference, keys, .. } = effect;
    let _ = write!(page, "\n#### `[effects.{name}]`\n\n{about}\n\n");
    table_of(page, &Table { name, about, keys });
    page.push_str("\n```text\n");
    equations.iter().for_each(|line| *page += &format!("{line}\n"));
    let _ = writeln!(page, "```\n\nState: {state}. Source: {reference}.");
}

fn table_of(page: &mut String, table: &Table) {
    page.push_str("| key | unit | allowed | what it is |\n| --- | --- | --- | --- |\n");
    for key in table.keys {
        let unit = key.unit().unwrap_or("");
        let _ = writeln!(page, "| `{}` | {unit} | {} | {} |", key.name, key.allowed(), key.about.trim());
    }
}
