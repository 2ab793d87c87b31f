//! Scene, read and checked, with the setup of its finger and the parameters of its controller; the library of scenes;
//! changes to the text of a scene.

pub(crate) mod reader;
pub mod tables;

pub use crate::scene::reader::{SceneError, SceneErrors, read};

use crate::effects::{Description, NamedEffect};
use crate::events::Event;
use crate::scene::reader::did_you_mean;
use crate::scene::tables::{Value, Values};
use crate::setup::{Array, Setup};
use fingertip::params::Params;
use std::path::{Path, PathBuf};
use std::{fs, io};
use toml_edit::{DocumentMut, Item, Table, Value as TomlValue};

#[derive(Clone, Debug)]
pub struct Scene {
    /// The file's name without its ending.
    pub name: String,
    pub text: String,
    /// Values that the command line replaced, as `TABLE.KEY=VALUE`. `text` has them too.
    pub set: Vec<String>,
    pub about: String,
    pub seed: u64,
    /// Virtual time from the moment at which the finger is tared and its torque enabled.
    pub duration_s: f64,
    /// Values of all [`tables::TABLES`].
    pub tables: Vec<(&'static str, Values)>,
    /// Goals of the host, in order of time.
    pub script: Vec<Goal>,
    /// Events, in order of time.
    pub events: Vec<Event>,
    /// Effects of the scene, in the order of [`crate::effects::all`].
    pub effects: Vec<NamedEffect>,
    pub bounds: Vec<Bound>,
}

impl Scene {
    pub fn table(&self, name: &str) -> &Values {
        let found = self.tables.iter().find(|(known, _)| *known == name);
        &found.unwrap_or_else(|| panic!("no table [{name}] is described")).1
    }

    /// Returns the setup of the finger by the tables. Everything that effects decide is at its ideal value.
    pub fn setup(&self) -> Setup {
        let [tip, array, motor] = ["tip", "array", "motor"].map(|name| self.table(name));
        let [transmission, supply, object] = ["transmission", "supply", "object"].map(|name| self.table(name));
        let mut setup = Setup::default();
        setup.tip.radius_mm = tip.number("radius_mm");
        setup.tip.modulus_kpa = tip.number("modulus_kpa");
        setup.wall.distance_mm = object.number("distance_mm");
        setup.wall.centre_x_mm = object.number("centre_x_mm");
        setup.wall.centre_y_mm = object.number("centre_y_mm");
        let siemens_per_code = setup.array.siemens_per_code();
        setup.array.pitch_mm = array.number("pitch_mm");
        setup.array.preload_siemens = array.number("preload_codes") * siemens_per_code;
        setup.array.siemens_per_kpa = array.number("gain_codes_per_kpa") * siemens_per_code;
        setup.array.row_ohm = 0.0;
        setup.motor.resistance_ohm = motor.number("resistance_ohm");
        setup.motor.torque_nm_per_a = motor.number("torque_mnm_per_a") * 1e-3;
        setup.motor.inertia_kg_m2 = motor.number("inertia_g_cm2") * 1e-7;
        setup.motor.encoder_counts_per_turn = motor.number("encoder_counts_per_turn");
        setup.motor.friction_nm = 0.0;
        setup.transmission.ratio = transmission.number("ratio");
        setup.transmission.drum_radius_mm = transmission.number("drum_radius_mm");
        setup.transmission.efficiency = 1.0;
        setup.supply.source_v = supply.number("source_v");
        setup.supply.source_ohm = 0.0;
        setup.supply.bridge_ohm = supply.number("bridge_ohm");
        setup
    }

    /// Returns the unchecked parameters: of `[controller]`, else by the other tables, else the firmware's defaults.
    pub fn params(&self) -> Params {
        let [tip, array, motor] = ["tip", "array", "motor"].map(|name| self.table(name));
        let [transmission, supply] = ["transmission", "supply"].map(|name| self.table(name));
        let effect = |name: &str, key: &str| {
            let named = self.effects.iter().find(|named| named.effect.name == name);
            named.map_or(0.0, |named| named.values.number(key))
        };
        let siemens_per_code = Array::default().siemens_per_code();
        let known = Params {
            tip_radius_um: whole(tip.number("radius_mm") * 1e3),
            modulus_pa: whole(tip.number("modulus_kpa") * 1e3),
            pitch_um: whole(array.number("pitch_mm") * 1e3),
            codes_per_kpa_milli: whole(array.number("gain_codes_per_kpa") * 1e3),
            row_sag_ppb_per_code: whole(effect("row_sag", "switch_ohm") * siemens_per_code * 1e9),
            torque_constant_unm_per_a: whole(motor.number("torque_mnm_per_a") * 1e3),
            resistance_mohm: whole((motor.number("resistance_ohm") + supply.number("bridge_ohm")) * 1e3),
            inertia_ug_m2: whole(motor.number("inertia_g_cm2") * 1e2),
            friction_unm: whole(effect("dry_friction", "torque_mnm") * 1e3),
            reduction_mrad_per_mm: whole(transmission.number("ratio") / transmission.number("drum_radius_mm") * 1e3),
            encoder_counts_per_turn: whole(motor.number("encoder_counts_per_turn")),
            // The wiring of a simulated finger is known.
            direction_confirmed: 1,
            ..Params::DEFAULT
        };
        let mut values = known.to_array();
        for ((name, ..), value) in Params::RANGES.iter().zip(&mut values) {
            if let Some(given) = self.table("controller").optional(name) {
                *value = whole(given);
            }
        }
        Params::from_array(&values)
    }

    /// Returns the scene without events, for a finger with another host.
    pub fn without_events(&self) -> Self {
        Self { events: Vec::new(), ..self.clone() }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Time from the start.
    pub at_s: f64,
    /// Requested force from then on.
    pub goal_n: f64,
}

/// Bound on a metric. One side may be open.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// Name of the metric, with its unit: `peak_force_n`.
    pub metric: String,
    pub min: Option<f64>,
    pub max: Option<f64>,
    /// Increase of the upper limit per N of the goal, for a metric with a value for each goal.
    pub max_per_goal_n: Option<f64>,
}

fn whole(value: f64) -> i32 {
    (value + 0.5).floor() as i32
}

/// Folder of the scenes of the project.
pub fn library_folder() -> PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/sim/scenes")
}

/// Names of the scenes of the library, sorted.
pub fn library_names() -> io::Result<Vec<String>> {
    names_in(&library_folder())
}

/// Names of the TOML files of a folder, sorted.
fn names_in(folder: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        names.extend(entry?.file_name().to_string_lossy().strip_suffix(".toml").map(str::to_owned));
    }
    names.sort();
    Ok(names)
}

/// Returns path and text of a scene, by its path or its name in the library.
pub fn library_text(scene: &str) -> Result<(PathBuf, String), String> {
    find(&library_folder(), "scene", scene)
}

/// Returns path and text of a file, by its path or its name in a folder. Errors call the file `what`.
pub fn find(folder: &Path, what: &str, name: &str) -> Result<(PathBuf, String), String> {
    let named = folder.join(name).with_extension("toml");
    let path = if Path::new(name).is_file() || !named.is_file() { PathBuf::from(name) } else { named };
    let text = fs::read_to_string(&path).map_err(|error| unknown(folder, what, name, &error))?;
    Ok((path, text))
}

/// Explains that there is no such file, and lists those of the folder.
pub fn unknown(folder: &Path, what: &str, name: &str, error: &io::Error) -> String {
    let names = names_in(folder).unwrap_or_default();
    let meant = did_you_mean(name, names.iter().map(String::as_str));
    format!("no {what} {name}: {error}{meant}\n  those that come with the project: {}", names.join(", "))
}

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

/// Writes the table of an effect with the values at which it changes nothing. Other keys have their defaults.
pub fn zero(effect: &Description) -> String {
    let mut text = format!("[effects.{}]\n", effect.name);
    for (key, idle) in effect.keys.iter().filter_map(|key| Some((key.name, key.idle?))) {
        text += &format!("{key} = {}\n", Value::Number(idle));
    }
    text
}
