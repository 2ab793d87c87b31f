//! A population's file, and the one that it extends.

use super::{Population, read};
use crate::scene::library;
use crate::scene::tables::{EXPECT, SCRIPT};
use std::fs;
use std::path::{Path, PathBuf};
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table};

/// Where the populations lie that come with the project.
pub fn folder() -> PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/sim/populations")
}

/// A population by its path or by its name among those that come with the project.
///
/// # Errors
/// There is none, or it is not one; the text is for people.
pub fn load(name: &str) -> Result<Population, String> {
    let (path, text) = library::find(&folder(), "population", name)?;
    let file = path.to_string_lossy();
    let over: DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| format!("{file}: this is not TOML: {error}"))?;
    let Some(base) = over.get("extends") else { return read(&file, &text).map_err(|errors| errors.to_string()) };
    let base = base.as_str().ok_or_else(|| format!("{file}: `extends` names a population, such as \"ordinary\""))?;
    let beside = path.with_file_name(base).with_extension("toml");
    let found = if beside.is_file() { beside } else { folder().join(base).with_extension("toml") };
    let told = |why: String| format!("{file} extends {base}: {why}");
    let unknown = |error| told(library::unknown(&folder(), "population", base, &error));
    let text = fs::read_to_string(&found).map_err(unknown)?;
    let whole: Result<DocumentMut, toml_edit::TomlError> = text.parse();
    if whole.as_ref().is_ok_and(|whole| whole.contains_key("extends")) {
        return Err(told(format!("{base} extends another itself; extend that one, or none")));
    }
    // What is wrong in it is told as it stands there.
    let known = read(&found.to_string_lossy(), &text).map_err(|errors| told(errors.to_string()))?;
    let mut whole = whole.map_err(|error| told(error.to_string()))?;
    overlay(whole.as_table_mut(), over.as_table());
    let label = format!("{file} over {}", known.name);
    let population = read(&label, &whole.to_string()).map_err(|errors| errors.to_string())?;
    Ok(Population { name: stem(&file), ..population })
}

/// Puts what a file says over what it extends: value by value, bounds by their metric, a script as a whole. What is
/// counted is added.
fn overlay(base: &mut Table, over: &Table) {
    for (name, item) in over.iter().filter(|(name, _)| *name != "extends") {
        match (base.get_mut(name), item) {
            (Some(Item::Table(base)), Item::Table(over)) => overlay(base, over),
            (Some(Item::ArrayOfTables(base)), Item::ArrayOfTables(over)) if name == EXPECT.name => bounds(base, over),
            (Some(Item::ArrayOfTables(base)), Item::ArrayOfTables(over)) if name != SCRIPT.name => {
                over.iter().for_each(|table| base.push(table.clone()));
            }
            (Some(known), item) => *known = item.clone(),
            (None, item) => {
                base.insert(name, item.clone());
            }
        }
    }
}

fn bounds(base: &mut ArrayOfTables, over: &ArrayOfTables) {
    let metric = |table: &Table| table.get("metric").and_then(Item::as_str).map(str::to_owned);
    for table in over {
        let place = base.iter().position(|known| metric(known) == metric(table));
        match place.and_then(|place| base.get_mut(place)) {
            Some(known) => table.iter().for_each(|(name, item)| {
                known.insert(name, item.clone());
            }),
            None => base.push(table.clone()),
        }
    }
}

/// A file's name without its ending.
pub fn stem(file: &str) -> String {
    Path::new(file).file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}
