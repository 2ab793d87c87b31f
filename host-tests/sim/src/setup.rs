//! Components of the simulated board: plain data in the units of their names.

/// Everything around the microcontroller. The defaults are the reference finger of `docs/board.md`.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    pub tip: Tip,
    pub wall: Wall,
    pub array: Array,
    pub motor: Motor,
    /// Transmission from the shaft of the motor to the tip.
    pub transmission: Transmission,
    pub supply: Supply,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            tip: Tip::default(),
            wall: Wall { distance_mm: 5.0, centre_x_mm: 0.0, centre_y_mm: 0.0 },
            array: Array::default(),
            // The data sheet of the FAULHABER 1331 T 006 SR with an IE2-400.
            motor: Motor {
                resistance_ohm: 2.83,
                torque_nm_per_a: 5.35e-3,
                inertia_kg_m2: 0.71e-7,
                friction_nm: 0.12e-3,
                encoder_counts_per_turn: 1600.0,
            },
            transmission: Transmission { ratio: 43.0, drum_radius_mm: 12.0, efficiency: 0.7 },
            supply: Supply { source_v: 6.0, source_ohm: 0.1, bridge_ohm: 0.7 },
        }
    }
}

/// The hemispherical fingertip of Park, Kim and Hirai (2003).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tip {
    pub radius_mm: f64,
    /// Young's modulus Y.
    pub modulus_kpa: f64,
}

impl Default for Tip {
    fn default() -> Self {
        Self { radius_mm: 10.0, modulus_kpa: 250.0 }
    }
}

/// Rigid plane in front of the tip, and the place of the contact on the array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Travel at which the tip touches.
    pub distance_mm: f64,
    /// Contact centre from the array's middle, along the columns.
    pub centre_x_mm: f64,
    /// Contact centre from the array's middle, along the rows.
    pub centre_y_mm: f64,
}

/// A resistive array read at zero potential: one row driven, each column into a transimpedance amplifier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Array {
    /// Distance from taxel to taxel; the taxels are squares that touch.
    pub pitch_mm: f64,
    /// Conductance of a taxel without pressure (its preload), G_0.
    pub preload_siemens: f64,
    /// Conductance that a kPa adds, alpha.
    pub siemens_per_kpa: f64,
    /// Increase of the pressure per code from none to the full range of the converter; 0 is linear.
    pub growth: f64,
    pub short_siemens: f64,
    /// Row switch and trace, R_on.
    pub row_ohm: f64,
    /// Feedback resistor of the column amplifiers, R_f.
    pub feedback_ohm: f64,
    /// Virtual ground of the columns, V_g, and voltage of the rows that are not driven.
    pub ground_v: f64,
    /// Voltage of a driven row below the virtual ground, V_drive.
    pub drive_v: f64,
    /// Highest voltage of an amplifier and reference of the converter.
    pub reference_v: f64,
    /// Time constant of the settling of a column.
    pub settle_tau_s: f64,
    /// Time from the edge to the sample, for whole frames taken at one instant.
    pub sample_after_s: f64,
}

impl Array {
    /// Number of codes of the 12-bit converter.
    pub const CODES: f64 = 4096.0;
    /// K = R_f V_drive 4096 / V_ref of the reference finger, codes Ohm.
    const CODES_OHM: f64 = 1.8e7;

    /// Returns the conductance for that of the linear characteristic, by solving a parabola.
    pub fn loaded(&self, line: f64) -> f64 {
        if self.growth == 0.0 {
            return line;
        }
        // Conductance at the full range of the converter.
        let range = self.reference_v / (self.feedback_ohm * self.drive_v);
        2.0 * line / (1.0 + (1.0 + 4.0 * self.growth * line / range).sqrt())
    }

    pub fn siemens_per_code(&self) -> f64 {
        self.reference_v / (self.feedback_ohm * self.drive_v * Self::CODES)
    }

    /// Returns the code of a voltage, rounded down, as a successive-approximation converter does.
    pub fn code(&self, volts: f64) -> u16 {
        (volts / self.reference_v * Self::CODES).floor().clamp(0.0, Self::CODES - 1.0) as u16
    }
}

impl Default for Array {
    fn default() -> Self {
        let (drive_v, reference_v) = (0.3, 3.3);
        Self {
            pitch_mm: 1.5,
            preload_siemens: 40.0 / Self::CODES_OHM,
            siemens_per_kpa: 24.0 / Self::CODES_OHM,
            growth: 0.0,
            short_siemens: 0.1,
            row_ohm: 30.0,
            feedback_ohm: Self::CODES_OHM * reference_v / (Self::CODES * drive_v),
            ground_v: 0.3,
            drive_v,
            reference_v,
            settle_tau_s: 0.2e-6,
            sample_after_s: 2.4e-6,
        }
    }
}

/// A brushed motor with its encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    pub resistance_ohm: f64,
    /// Torque constant; also the back-EMF constant in V s/rad.
    pub torque_nm_per_a: f64,
    pub inertia_kg_m2: f64,
    /// Friction torque, independent of speed.
    pub friction_nm: f64,
    pub encoder_counts_per_turn: f64,
}

/// Gearhead, drum and tendon, rigid and without play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// Motor turns for one turn of the drum.
    pub ratio: f64,
    /// Radius on which the tendon winds.
    pub drum_radius_mm: f64,
    /// Share of the torque that arrives when the motor drives the load.
    pub efficiency: f64,
}

impl Transmission {
    pub fn mm_per_rad(&self) -> f64 {
        self.drum_radius_mm / self.ratio
    }

    /// Friction of the gear, as a share of the load.
    pub fn load_share(&self) -> f64 {
        1.0 / self.efficiency - 1.0
    }
}

/// An ideal source behind a resistance, and the bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply {
    /// Voltage without load.
    pub source_v: f64,
    /// Resistance of source, wires and connectors.
    pub source_ohm: f64,
    /// Resistance of the bridge's two switches in the motor's path; 0 where the motor's resistance includes it.
    pub bridge_ohm: f64,
}

impl Supply {
    /// Resistance of the whole circuit at a duty u, in which the motor sees u^2 of the resistance of the source.
    pub fn circuit_ohm(&self, motor: &Motor, duty: f64) -> f64 {
        motor.resistance_ohm + self.bridge_ohm + duty * duty * self.source_ohm
    }
}
