//! Descriptions of a scene, of all keys, and the reference page.

use crate::effects::{self, Build, CONTACT, DRIVE, Description, LINK, Part, SENSOR};
use crate::events::{EVENT, KINDS, own_keys};
use crate::metrics;
use crate::scene::tables::{EXPECT, Key, ROOT, SCRIPT, TABLES, Values};
use crate::scene::{self, Scene, read};
use std::fmt::Write as _;

/// Describes the effects of a scene, with the equations and the state of each.
pub fn scene(scene: &Scene) -> String {
    let mut text = format!("{}: {}\n", scene.name, scene.about);
    let _ = writeln!(
        text,
        "{} s, {} goals, {} events, {} bounds, seed {}",
        scene.duration_s,
        scene.script.len(),
        scene.events.len(),
        scene.bounds.len(),
        scene.seed
    );
    if scene.effects.is_empty() {
        text += "\nIt names no effect: a motor without friction presses an ideal tip on a rigid plane, read without error.\n";
    }
    for named in &scene.effects {
        let Description { name, about, equations, state, reference, .. } = named.effect;
        let _ = writeln!(text, "\n{name} ({})\n  {about}", effects::family_of(named.effect));
        equations.iter().for_each(|line| text += &format!("    {line}\n"));
        let _ = writeln!(text, "  state: {state}\n  source: {reference}");
        for (name, value) in named.values.iter() {
            let _ = writeln!(text, "  {name} = {value}");
        }
    }
    text
}

/// Lists the scenes of the library, each with its description.
pub fn list() -> Result<String, Box<dyn std::error::Error + Send + Sync>> {
    let names = scene::library_names()?;
    let width = names.iter().map(String::len).max().unwrap_or(0);
    let mut text = String::new();
    for name in names {
        let (path, scene) = scene::library_text(&name)?;
        let about = read(&path.to_string_lossy(), &scene, &metrics::names())?.about;
        let _ = writeln!(text, "{name:width$}  {about}");
    }
    Ok(text)
}

/// Lists every key, for a terminal.
pub fn keys() -> String {
    let mut text = String::new();
    for table in [&ROOT].into_iter().chain(TABLES).chain([&SCRIPT, &EVENT, &EXPECT]) {
        keys_of(&mut text, &table.title(), table.about, table.keys);
    }
    for kind in &KINDS {
        keys_of(&mut text, &kind.title(), kind.about, own_keys(kind));
    }
    for effect in effects::all() {
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

/// Command that generates the page.
pub const COMMAND: &str = "cargo xtask docs";

/// Returns the reference page, `docs/scenes.md`.
pub fn page() -> String {
    let mut page = format!(
        "# Scenes\n\nGenerated from `host-tests/sim/src` by `{COMMAND}`: do not edit.\n\n{}\n",
        include_str!("explain/scenes.md").trim().replace("{wall}", include_str!("../scenes/wall.toml"))
    );
    library_of(&mut page);
    stages(&mut page);
    page.push_str(
        "\n## Tables\n\nAfter each key: its range, and its default if it has one. A unit is the end of the key's name.\n",
    );
    for table in [&ROOT].into_iter().chain(TABLES).chain([&SCRIPT, &EVENT, &EXPECT]) {
        let title =
            if table.name.is_empty() { "Before the first table".into() } else { format!("`{}`", table.title()) };
        let _ = write!(page, "\n### {title}\n\n{}\n", table.about);
        if table.name == "controller" {
            page.push_str("The keys are the [parameters](control-table.md#parameters), with their ranges.\n");
        } else {
            page.push('\n');
            keys_on(&mut page, table.keys, "");
        }
    }
    page.push_str(
        "\n## Events\n\nKinds of `[[event]]`, with their keys. `for_s` is the duration, 0 to 1000000, required.\n\n",
    );
    for kind in &KINDS {
        let (own, lasts) = match own_keys(kind) {
            [own @ .., last] if last.name == "for_s" => (own, ", `for_s`"),
            own => (own, ""),
        };
        let _ = writeln!(page, "- `{}`{lasts}: {}", kind.name, kind.about);
        keys_on(&mut page, own, "  ");
    }
    page.push_str("\n## Effects\n\nWithin a stage they act in this order, whatever their order in the scene.\n");
    for family in [CONTACT, DRIVE, SENSOR, LINK] {
        let _ = write!(page, "\n### {}\n", family.title);
        for effect in family.effects {
            effect_of(&mut page, effect);
        }
    }
    let _ = write!(
        page,
        "\n## Metrics\n\n`[[expect]]` can bound these. The unit is the end of the name. Of several goals the worst one counts. Of two fingers the one \
         with the largest value counts, unless brackets give another rule; `finger0.` or `finger1.` before a name selects one. *The end \
         of a goal* is its last 200 ms, if it lasted 400 ms. *Defects* are the [events](#events) of encoder, supply, array and host.\n\n{}",
        metrics::page()
    );
    page
}

/// Adds the scenes of the library; none without the sources.
fn library_of(page: &mut String) {
    page.push_str(
        "\n## The library\n\nComments in each file of `host-tests/sim/scenes` explain it. A test runs all scenes against their bounds.\n\n",
    );
    for line in list().unwrap_or_default().lines() {
        if let Some((name, about)) = line.split_once(' ') {
            let _ = writeln!(page, "- `{name}`: {}", about.trim());
        }
    }
}

/// Adds the stages from pressure to codes, with the effects at each.
fn stages(page: &mut String) {
    page.push_str(
        "\n## From pressure to codes\n\nWithout effects the readout is ideal: equal taxels, a perfect row switch and virtual ground, \
         no settling time, 12 bits rounded down. Each row is sampled at its own instant. Stages and effects, in order:\n\n\
         | stage | content | effects |\n| --- | --- | --- |\n",
    );
    for (stage, about) in [
        ("pressure", "kPa of each taxel of the row"),
        ("conductance", "G_0 + alpha p of each taxel, S"),
        ("network", "what each column sees of the driven row, S"),
        ("volts", "at the column amplifiers: V_g + R_f G V_drive"),
        ("codes", "before the converter rounds down: 4096 V / V_ref"),
    ] {
        let effects: Vec<_> = effects::all().filter(|effect| stage_of(effect) == Some(stage)).collect();
        let names: Vec<_> = effects.iter().map(|effect| format!("`{}`", effect.name)).collect();
        let _ = writeln!(page, "| {stage} | {about} | {} |", names.join(", "));
    }
}

/// Returns the stage of the readout at which an effect acts.
fn stage_of(effect: &Description) -> Option<&'static str> {
    let values = Values::defaults(effect.keys);
    match (effect.build)(&Build::new(&values, 0)) {
        Part::Pressure(_) => Some("pressure"),
        Part::Conductance(_) => Some("conductance"),
        Part::Network(_) => Some("network"),
        Part::Volts(_) => Some("volts"),
        Part::Codes(_) => Some("codes"),
        _ => None,
    }
}

fn effect_of(page: &mut String, effect: &Description) {
    let Description { name, about, equations, state, reference, keys, .. } = effect;
    let _ = write!(page, "\n#### `[effects.{name}]`\n\n{about}\n\n");
    keys_on(page, keys, "");
    page.push_str("\n```text\n");
    equations.iter().for_each(|line| *page += &format!("{line}\n"));
    let state = if *state == "none" { String::new() } else { format!("State: {state}. ") };
    let _ = writeln!(page, "```\n\n{state}Source: {reference}.");
}

/// Adds a list of keys to the page.
fn keys_on(page: &mut String, keys: &[Key], indent: &str) {
    for key in keys {
        let allowed = key.allowed().replace("whole number", "whole").replace("number, ", "");
        let _ = writeln!(page, "{indent}- `{}` ({allowed}): {}", key.name, key.about.trim());
    }
}
