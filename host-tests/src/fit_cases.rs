//! Pictures with a known contact, good and bad, for judging the fit; all simulated, in f64.
//!
//! Good ones are the paper's model averaged over the taxels ([`Object::Plane`]). Bad ones are what the model does not
//! cover: the straight edge of an object, two contacts, an array bent to a cylinder. Each has a drawn range, given at
//! its function.

use core::f64::consts::{PI, TAU};
use fastrand::Rng;
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Config, ROWS, TactileImage};
use images::picture;
use sim::mechanics::pressures::Cell;
use sim::setup::Setup;

/// Radius of the reference tip.
pub const RADIUS_MM: f64 = 10.0;
/// Young's modulus of the reference tip.
pub const MODULUS_KPA: f64 = 250.0;
/// Codes for a kPa on a taxel.
pub const CODES_PER_KPA: f64 = 24.0;
pub const PITCHES_MM: [f64; 3] = [1.27, 1.5, 2.0];
/// Sub-samples of a taxel's side where the pressure has no closed form.
const SAMPLES: usize = 12;

/// Mean pressures on the taxels, kPa, row by row.
pub type Pressures = [[f64; COLUMNS]; ROWS];

/// Object that the tip presses against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Object {
    /// A plane: the paper's case.
    Plane,
    /// A plane that ends at a straight edge.
    Edge {
        /// Distance from the contact's centre to the edge; negative if the centre is beyond the edge.
        offset_mm: f64,
        /// Direction from the centre to the edge.
        angle_rad: f64,
    },
    /// A plane under two tips; each taxel has the pressure of the deeper one.
    Two {
        /// Indentation of the second tip.
        d_mm: f64,
        /// Offset of the second tip from the first, along the columns.
        dx_mm: f64,
        /// Offset of the second tip from the first, along the rows.
        dy_mm: f64,
    },
    /// A plane on an array that is bent to a cylinder about an axis under its middle.
    Bent {
        /// Radius of the bend; negative if the array's sides rise towards the object.
        radius_mm: f64,
        /// Direction across the axis.
        angle_rad: f64,
    },
}

/// A contact and the array under it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scene {
    /// Distance from taxel to taxel.
    pub pitch_mm: f64,
    pub d_mm: f64,
    /// Offset of the contact's centre from the array's middle, along the columns.
    pub x_mm: f64,
    /// Offset of the contact's centre from the array's middle, along the rows.
    pub y_mm: f64,
    /// Object that the tip presses against.
    pub object: Object,
}

pub fn contact_radius_mm(d_mm: f64) -> f64 {
    (d_mm * (2.0 * RADIUS_MM - d_mm)).max(0.0).sqrt()
}

impl Scene {
    /// A plane contact: pitch 1.27, 1.5 or 2 mm, d 0.3 to 5 mm, centre on the array or up to half a contact radius
    /// beyond its edge on each axis.
    pub fn good(rng: &mut Rng) -> Self {
        let mut scene = Self::on_array(rng, 0.3, 5.0);
        let reach = 0.5 * COLUMNS as f64 * scene.pitch_mm + 0.5 * contact_radius_mm(scene.d_mm);
        (scene.x_mm, scene.y_mm) = (between(rng, -reach, reach), between(rng, -reach, reach));
        scene
    }

    /// An edge within 0.6 contact radii of the centre, at any angle; d 0.5 to 5 mm, centre on the array.
    pub fn edge(rng: &mut Rng) -> Self {
        let mut scene = Self::on_array(rng, 0.5, 5.0);
        let offset_mm = between(rng, -0.6, 0.6) * contact_radius_mm(scene.d_mm);
        scene.object = Object::Edge { offset_mm, angle_rad: between(rng, 0.0, TAU) };
        scene
    }

    /// Two contacts, both centred on the array: d 0.5 to 3 mm, the second's 0.5 to 1 times that, centres farther apart
    /// than half the sum of their contact radii.
    pub fn two(rng: &mut Rng) -> Self {
        loop {
            let mut scene = Self::on_array(rng, 0.5, 3.0);
            let other = Self { pitch_mm: scene.pitch_mm, ..Self::on_array(rng, 0.5, 3.0) };
            let half = 0.5 * COLUMNS as f64 * scene.pitch_mm;
            let d_mm = between(rng, 0.5, 1.0) * scene.d_mm;
            let (dx_mm, dy_mm) = (other.x_mm - scene.x_mm, other.y_mm - scene.y_mm);
            let apart = dx_mm.hypot(dy_mm) > 0.5 * (contact_radius_mm(scene.d_mm) + contact_radius_mm(d_mm));
            if apart && other.x_mm.abs().max(other.y_mm.abs()) <= half {
                scene.object = Object::Two { d_mm, dx_mm, dy_mm };
                return scene;
            }
        }
    }

    /// A bent array, either way, radius 20 to 60 mm, axis at any angle; d 0.5 to 4 mm, centre on the array.
    pub fn bent(rng: &mut Rng) -> Self {
        let mut scene = Self::on_array(rng, 0.5, 4.0);
        let radius_mm = between(rng, 20.0, 60.0) * if rng.bool() { 1.0 } else { -1.0 };
        scene.object = Object::Bent { radius_mm, angle_rad: between(rng, 0.0, PI) };
        scene
    }

    /// A plane contact centred on the array.
    fn on_array(rng: &mut Rng, d_min_mm: f64, d_max_mm: f64) -> Self {
        let pitch_mm = PITCHES_MM[rng.usize(..PITCHES_MM.len())];
        let half = 0.5 * COLUMNS as f64 * pitch_mm;
        let d_mm = between(rng, d_min_mm, d_max_mm);
        let (x_mm, y_mm) = (between(rng, -half, half), between(rng, -half, half));
        Self { pitch_mm, d_mm, x_mm, y_mm, object: Object::Plane }
    }

    pub fn force_n(&self) -> f64 {
        PI * MODULUS_KPA * 1e-3 * self.d_mm * self.d_mm
    }

    /// The core's constants for this array.
    pub fn config(&self) -> Config {
        let pitch_um = (self.pitch_mm * 1e3).round() as i32;
        Config::shipped(&Params { pitch_um, ..Params::DEFAULT }).expect("the pitch is in range")
    }

    /// Mean pressure on each taxel.
    pub fn pressures(&self) -> Pressures {
        let mut setup = Setup::default();
        setup.array.pitch_mm = self.pitch_mm;
        (setup.wall.centre_x_mm, setup.wall.centre_y_mm) = (self.x_mm, self.y_mm);
        let tip = setup.tip.flattened(self.d_mm);
        core::array::from_fn(|row| {
            core::array::from_fn(|column| {
                let cell = Cell::of(&setup, row, column);
                if self.object == Object::Plane { cell.mean_kpa(&tip) } else { self.sampled_kpa(&cell) }
            })
        })
    }

    /// The share of the force on the live taxels that an edge takes; None without an edge.
    pub fn cut(&self, pressures: &Pressures, bad: &[u32; ROWS]) -> Option<f64> {
        let Object::Edge { angle_rad, .. } = self.object else { return None };
        // The same samples without the edge.
        let whole = Self { object: Object::Edge { offset_mm: f64::INFINITY, angle_rad }, ..*self }.pressures();
        let seen = |pressures: &Pressures| -> f64 {
            let rows = pressures.iter().zip(bad);
            rows.flat_map(|(row, bad)| row.iter().enumerate().filter(move |(column, _)| bad >> column & 1 == 0))
                .map(|(_, kpa)| kpa)
                .sum()
        };
        let whole = seen(&whole);
        Some(if whole > 0.0 { 1.0 - seen(pressures) / whole } else { 0.0 })
    }

    fn sampled_kpa(&self, cell: &Cell) -> f64 {
        let at = |side: [f64; 2], index: usize| side[0] + (side[1] - side[0]) * (index as f64 + 0.5) / SAMPLES as f64;
        let mut sum = 0.0;
        for i in 0..SAMPLES {
            for j in 0..SAMPLES {
                sum += self.pressure_kpa(at(cell.x_mm, i), at(cell.y_mm, j));
            }
        }
        sum / (SAMPLES * SAMPLES) as f64
    }

    /// Pressure at a place from the contact's centre.
    fn pressure_kpa(&self, x_mm: f64, y_mm: f64) -> f64 {
        match self.object {
            Object::Plane => column_kpa(x_mm, y_mm, self.d_mm),
            Object::Edge { offset_mm, angle_rad } => {
                let beyond = x_mm * angle_rad.cos() + y_mm * angle_rad.sin() > offset_mm;
                if beyond { 0.0 } else { column_kpa(x_mm, y_mm, self.d_mm) }
            }
            Object::Two { d_mm, dx_mm, dy_mm } => {
                column_kpa(x_mm, y_mm, self.d_mm).max(column_kpa(x_mm - dx_mm, y_mm - dy_mm, d_mm))
            }
            Object::Bent { radius_mm, angle_rad } => {
                let across = (x_mm + self.x_mm) * angle_rad.cos() + (y_mm + self.y_mm) * angle_rad.sin();
                column_kpa(x_mm, y_mm, self.d_mm - across * across / (2.0 * radius_mm))
            }
        }
    }
}

/// Pressure of the column at a place when it meets the object as deep as `d_mm` would at the middle; 0 off the tip.
fn column_kpa(x_mm: f64, y_mm: f64, d_mm: f64) -> f64 {
    let length = (RADIUS_MM * RADIUS_MM - x_mm * x_mm - y_mm * y_mm).max(0.0).sqrt();
    let compression = (length - (RADIUS_MM - d_mm)).max(0.0);
    if length > 0.1 * RADIUS_MM { MODULUS_KPA * compression / length } else { 0.0 }
}

fn between(rng: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.f64()
}

fn normal(rng: &mut Rng) -> f64 {
    (-2.0 * (1.0 - rng.f64()).ln()).sqrt() * (TAU * rng.f64()).cos()
}

/// Rounding of the readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Steps {
    /// Codes rounded to 1/16, the resolution of the pipeline.
    Sixteenths,
    /// Down to a whole code, as a 12-bit converter does without noise.
    Codes,
}

/// Disturbances of the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    None,
    /// Each taxel's own reading times this, normally distributed.
    OfReading(f64),
    /// The highest reading times this, normally distributed, on every taxel.
    OfPeak(f64),
}

/// Steps from pressures to a tactile image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    pub steps: Steps,
    pub noise: Noise,
    /// Dead taxels, drawn at random.
    pub dead: usize,
}

impl Reading {
    /// Dead taxels, drawn at random: a bit for each column, for each row.
    pub fn dead(&self, rng: &mut Rng) -> [u32; ROWS] {
        let mut bad = [0_u32; ROWS];
        let mut left = self.dead;
        while left > 0 {
            let (row, column) = (rng.usize(..ROWS), rng.usize(..COLUMNS));
            left -= usize::from(bad[row] >> column & 1 == 0);
            bad[row] |= 1 << column;
        }
        bad
    }

    /// Tactile image of the pressures, without the bad taxels; and number of the other taxels that are in contact, with
    /// a pressure above 0 before noise.
    pub fn picture(&self, pressures: &Pressures, bad: [u32; ROWS], rng: &mut Rng) -> (TactileImage, usize) {
        let peak = pressures.iter().flatten().fold(0.0, |peak: f64, kpa| peak.max(*kpa));
        let mut seen = 0;
        let mut taxels = [[0; COLUMNS]; ROWS];
        for (row, line) in pressures.iter().enumerate() {
            for (column, kpa) in line.iter().enumerate() {
                if bad[row] >> column & 1 != 0 {
                    continue;
                }
                seen += usize::from(*kpa > 0.0);
                let noisy = match self.noise {
                    Noise::None => *kpa,
                    Noise::OfReading(share) => kpa * (1.0 + share * normal(rng)),
                    Noise::OfPeak(share) => kpa + peak * share * normal(rng),
                };
                taxels[row][column] = match self.steps {
                    Steps::Sixteenths => (noisy * CODES_PER_KPA * 16.0).round() as i32,
                    Steps::Codes => (noisy * CODES_PER_KPA).floor() as i32 * 16,
                };
            }
        }
        (picture(&taxels, bad), seen)
    }
}
