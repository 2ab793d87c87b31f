//! Descriptions of a scene, and the reference page.

use crate::effects::{self, Description, FAMILIES};
use crate::events::{EVENT, KINDS, own_keys};
use crate::metrics;
use crate::scene::tables::{EXPECT, Key, ROOT, SCRIPT, TABLES};
use crate::scene::{self, Scene, read};
use std::fmt::Write as _;

/// Describes the effects of a scene, with the equations and the state of each.
pub fn scene(scene: &Scene) -> String {
    let Scene { name, about, duration_s, seed, .. } = scene;
    let [goals, events, bounds] = [scene.script.len(), scene.events.len(), scene.bounds.len()];
    let mut text = format!("{name}: {about}\n");
    let _ = writeln!(text, "{duration_s} s, {goals} goals, {events} events, {bounds} bounds, seed {seed}");
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
        let about = read(&path.to_string_lossy(), &scene)?.about;
        let _ = writeln!(text, "{name:width$}  {about}");
    }
    Ok(text)
}

/// Returns the reference page, `docs/scenes.md`.
pub fn page() -> String {
    let mut page = format!(
        "# Scenes\n\nGenerated from `host-tests/sim/src` by `cargo xtask docs`: do not edit.\n\n{}\n",
        include_str!("explain/scenes.md").trim().replace("{wall}", include_str!("../scenes/wall.toml"))
    );
    page.push_str("\n## The library\n\nComments in each file of `host-tests/sim/scenes` explain it.\n\n");
    // None without the sources.
    for (name, about) in list().unwrap_or_default().lines().filter_map(|line| line.split_once(' ')) {
        let _ = writeln!(page, "- `{name}`: {}", about.trim());
    }
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
    page.push_str(
        "\n## Effects\n\nEffects of a family act in this order, whatever their order in the scene; `burst` acts before `noise`. \
         Without effects the readout is ideal: equal taxels, a perfect row switch and virtual ground, no settling time, 12 bits \
         rounded down. `cargo xtask sim --explain everything` prints the equations, the state and the sources of all effects; for \
         another scene, those of its effects.\n",
    );
    let [link, sensor, contact, drive] = FAMILIES;
    for family in [contact, drive, sensor, link] {
        let _ = write!(page, "\n### {}\n", family.title);
        for effect in family.effects {
            let _ = write!(page, "\n#### `[effects.{}]`\n\n{}\n\n", effect.name, effect.about);
            keys_on(&mut page, effect.keys, "");
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

fn keys_on(page: &mut String, keys: &[Key], indent: &str) {
    for key in keys {
        let allowed = key.allowed().replace("whole number", "whole").replace("number, ", "");
        let _ = writeln!(page, "{indent}- `{}` ({allowed}): {}", key.name, key.about.trim());
    }
}
