//! Scene, read and checked, with the setup of its finger and the parameters of its controller.

pub mod library;
pub(crate) mod reader;
pub mod tables;
pub mod text;

pub use crate::scene::reader::{SceneError, SceneErrors, read};

use crate::effects::NamedEffect;
use crate::events::Event;
use crate::scene::tables::Values;
use crate::setup::{Array, Setup};
use fingertip::params::Params;

/// Scene, read and checked.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The file's name without its ending.
    pub name: String,
    pub text: String,
    /// Values that the command line replaced, as `TABLE.KEY=VALUE`. `text` has them too.
    pub set: Vec<String>,
    pub about: String,
    /// Seed of all random numbers.
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
    /// Returns the values of a table.
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
        let siemens_per_code =
            setup.array.reference_v / (setup.array.feedback_ohm * setup.array.drive_v * Array::CODES);
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
        let siemens_per_code = {
            let array = Array::default();
            array.reference_v / (array.feedback_ohm * array.drive_v * Array::CODES)
        };
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
