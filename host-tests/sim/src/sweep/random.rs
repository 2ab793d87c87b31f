//! Whether a scene has anything that its seed decides.

use crate::registry::Named;
use crate::scene::Scene;

/// The effects that draw random numbers.
pub const EFFECTS: [&str; 8] =
    ["noise", "offset", "gain_spread", "tangential", "host_jitter", "lost_packets", "corrupted_packets", "burst"];

/// Whether another seed may give another run.
pub fn is(scene: &Scene) -> bool {
    scene.effects.iter().any(draws)
}

/// Whether an effect draws, and not by a deviation of nothing.
fn draws(named: &Named) -> bool {
    let Named { effect, values } = named;
    let idle = |keys: &[(&str, f64)]| keys.iter().all(|(key, zero)| values.number(key) == *zero);
    EFFECTS.contains(&effect.name)
        && match effect.name {
            "tangential" => !idle(&[("spread_percent", 0.0)]),
            _ => effect.zero.is_empty() || !idle(effect.zero),
        }
}
