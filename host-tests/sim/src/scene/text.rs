//! Changes to the text of a scene, and the text of a scene that was read.

use crate::effects::Description;
use crate::scene::Scene;
use crate::scene::tables::{Value, Values};
use toml_edit::{DocumentMut, Item, Table, Value as TomlValue};

/// Sets `table.key` (`effects.noise.rms_codes`, `script.0.goal_n`, `seed`) of a text to a value in TOML. Comments
/// remain. The reader checks the value later.
pub fn set(text: &str, path: &str, value: &str) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| error.message().to_owned())?;
    let mut value: TomlValue = value.parse().map_err(|_| format!("{path}={value}: `{value}` is not a TOML value"))?;
    let mut names: Vec<&str> = path.split('.').collect();
    let key = names.pop().filter(|key| !key.is_empty()).ok_or_else(|| format!("`{path}` names no key"))?;
    let mut table: &mut dyn toml_edit::TableLike = document.as_table_mut();
    for (place, name) in names.iter().enumerate().filter(|(_, name)| name.parse::<usize>().is_err()) {
        let item = table.entry(name).or_insert_with(|| {
            let mut table = Table::new();
            table.set_implicit(*name == "effects");
            Item::Table(table)
        });
        let index = names.get(place + 1).and_then(|next| next.parse::<usize>().ok());
        table = match (item, index) {
            (Item::ArrayOfTables(tables), Some(index)) => {
                let count = tables.len();
                tables
                    .get_mut(index)
                    .ok_or_else(|| format!("`{path}`: there are {count} [[{name}]], numbered from 0"))?
            }
            (item, None) => item.as_table_like_mut().ok_or_else(|| format!("`{path}`: `{name}` is no table"))?,
            _ => return Err(format!("`{path}`: `{name}` is no list of tables")),
        };
    }
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(present) => {
            *value.decor_mut() = present.decor().clone();
            *present = value;
        }
        None => {
            table.insert(key, Item::Value(value));
        }
    }
    Ok(document.to_string())
}

/// Writes the scene as a text with every key and without comments, which reads as the same scene.
pub fn write(scene: &Scene) -> String {
    let (about, duration_s) = (Value::Text(scene.about.clone()), Value::Number(scene.duration_s));
    let mut text = format!("about = {about}\nduration_s = {duration_s}\nseed = {}\n", scene.seed);
    for (name, values) in &scene.tables {
        section(&mut text, &format!("[{name}]"), values);
    }
    for goal in &scene.script {
        let [at_s, goal_n] = [goal.at_s, goal.goal_n].map(Value::Number);
        text += &format!("\n[[script]]\nat_s = {at_s}\ngoal_n = {goal_n}\n");
    }
    for event in &scene.events {
        section(&mut text, "[[event]]", &event.values);
    }
    for named in &scene.effects {
        section(&mut text, &format!("[effects.{}]", named.effect.name), &named.values);
    }
    for bound in &scene.bounds {
        text += &format!("\n[[expect]]\nmetric = {}\n", Value::Text(bound.metric.clone()));
        for (name, side) in [("min", bound.min), ("max", bound.max), ("max_per_goal_n", bound.max_per_goal_n)] {
            text += &side.map_or(String::new(), |side| format!("{name} = {}\n", Value::Number(side)));
        }
    }
    text
}

fn section(text: &mut String, head: &str, values: &Values) {
    *text += &format!("\n{head}\n");
    for (name, value) in values.iter() {
        *text += &format!("{name} = {value}\n");
    }
}

/// Writes the table of an effect with the values at which it changes nothing. Other keys have their defaults.
pub fn zero(effect: &Description) -> String {
    let mut text = format!("[effects.{}]\n", effect.name);
    for (name, value) in effect.zero {
        text += &format!("{name} = {}\n", Value::Number(*value));
    }
    text
}
