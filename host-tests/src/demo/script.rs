//! Which forces are asked for, and for how long.

/// A goal and how long it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Phase {
    /// The force asked for.
    pub goal_mn: i32,
    /// How long.
    pub hold_ms: u64,
    /// Whether its pressures are kept for a map.
    pub map: bool,
}

/// The phases, the first of them a touch, the last a release.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Script(pub Vec<Phase>);

impl Phase {
    /// What is asked for, in words.
    pub fn what(&self) -> String {
        match self.goal_mn {
            0 => "let go".to_owned(),
            _ => format!("hold {} N", self.goal_n()),
        }
    }

    /// The force asked for.
    pub fn goal_n(&self) -> f64 {
        f64::from(self.goal_mn) * 1e-3
    }
}

impl Script {
    /// 10 s: touch, steps, release.
    pub fn whole() -> Self {
        let phase = |goal_mn, hold_ms, map| Phase { goal_mn, hold_ms, map };
        Self(vec![
            phase(1_000, 2_000, true),
            phase(200, 1_500, false),
            phase(2_000, 2_000, true),
            phase(5_000, 2_000, true),
            phase(1_000, 1_500, false),
            phase(0, 1_000, false),
        ])
    }

    /// The same goals, held for 250 ms; 500 ms for the touch.
    pub fn quick() -> Self {
        let Self(mut phases) = Self::whole();
        for phase in &mut phases {
            phase.hold_ms = 250;
        }
        phases[0].hold_ms = 500;
        Self(phases)
    }

    /// Virtual time that its phases take.
    pub fn length_ms(&self) -> u64 {
        self.0.iter().map(|phase| phase.hold_ms).sum()
    }
}
