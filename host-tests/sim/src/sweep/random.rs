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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry;
    use std::fs;

    /// What an effect's file takes its random numbers from.
    const DRAWN_FROM: &str = "build.seed";

    #[test]
    fn those_that_draw_are_listed() {
        for effect in registry::all() {
            let folder = concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/src/effects");
            let file = format!("{folder}/{}/{}.rs", effect.family.name(), effect.name);
            let text = fs::read_to_string(&file).unwrap_or_else(|error| panic!("{file}: {error}"));
            assert_eq!(text.contains(DRAWN_FROM), EFFECTS.contains(&effect.name), "{}", effect.name);
        }
    }
}
