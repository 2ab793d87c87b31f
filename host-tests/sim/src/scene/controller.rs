//! What a scene sets its controller and its finger to.

use super::Scene;
use crate::setup::Array;
use crate::setup::Setup;
use fingertip::params::Params;

/// The finger of a scene, as its tables say; everything that is an effect's to say is at its ideal value.
pub fn setup(scene: &Scene) -> Setup {
    let [tip, array, motor] = ["tip", "array", "motor"].map(|name| scene.table(name));
    let [transmission, supply, object] = ["transmission", "supply", "object"].map(|name| scene.table(name));
    let mut setup = Setup::default();
    setup.tip.radius_mm = tip.number("radius_mm");
    setup.tip.modulus_kpa = tip.number("modulus_kpa");
    setup.wall.distance_mm = object.number("distance_mm");
    setup.wall.centre_x_mm = object.number("centre_x_mm");
    setup.wall.centre_y_mm = object.number("centre_y_mm");
    let siemens_per_code = setup.array.reference_v / (setup.array.feedback_ohm * setup.array.drive_v * Array::CODES);
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

/// The controller's parameters: what `[controller]` gives, what the other tables say, else the firmware's defaults.
/// Unchecked.
pub fn params(scene: &Scene) -> Params {
    let [tip, array, motor] = ["tip", "array", "motor"].map(|name| scene.table(name));
    let [transmission, supply] = ["transmission", "supply"].map(|name| scene.table(name));
    let effect = |name: &str, key: &str| {
        let named = scene.effects.iter().find(|named| named.effect.name == name);
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
        // Whoever simulates a finger knows how it is wired.
        direction_confirmed: 1,
        ..Params::DEFAULT
    };
    let mut values = known.to_array();
    for ((name, ..), value) in Params::RANGES.iter().zip(&mut values) {
        if let Some(given) = scene.table("controller").optional(name) {
            *value = whole(given);
        }
    }
    Params::from_array(&values)
}

fn whole(value: f64) -> i32 {
    (value + 0.5).floor() as i32
}
