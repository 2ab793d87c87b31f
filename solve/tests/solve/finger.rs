//! Drawn tips and arrays, pressed by the core onto a simulated plate. Hysteresis, creep and relaxation go on from press to
//! press.

use fingertip::measure::Task;
use sim::effects::Parts;
use sim::native::bench::Bench;
pub use sim::native::calibrated::Place;
use sim::scene::{Scene, read};
use solve::press::Press;
use solve::record;

const ROWS: usize = 10;
const COLUMNS: usize = 10;

#[derive(Clone, Debug, Default)]
pub struct Draw {
    pub seed: u64,
    pub modulus_kpa: f64,
    pub noise_codes: f64,
    pub gains_percent: f64,
    pub creep_percent: f64,
    pub hysteresis_percent: f64,
    pub relaxation: f64,
    pub relaxation_s: f64,
    pub dead: Vec<[usize; 2]>,
    pub extra: String,
}

impl Draw {
    pub fn plain(modulus_kpa: f64) -> Self {
        Self { seed: 1, modulus_kpa, noise_codes: 1.0, relaxation_s: 0.5, ..Self::default() }
    }

    /// Of the ranges that a tip and an array have, by a seed.
    pub fn any(seed: u64, gains_percent: [f64; 2], dead: [usize; 2]) -> Self {
        let mut rng = fastrand::Rng::with_seed(seed);
        let mut broken: Vec<[usize; 2]> = (0..36).map(|taxel| [2 + taxel / 6, 2 + taxel % 6]).collect();
        rng.shuffle(&mut broken);
        broken.truncate(rng.usize(dead[0]..=dead[1]));
        let mut within = |low: f64, high: f64| low + (high - low) * rng.f64();
        Self {
            seed,
            modulus_kpa: 50.0 * 40.0_f64.powf(within(0.0, 1.0)),
            noise_codes: within(0.0, 3.0),
            gains_percent: within(gains_percent[0], gains_percent[1]),
            creep_percent: within(0.5, 4.0),
            hysteresis_percent: within(0.0, 10.0),
            relaxation: within(0.0, 0.15),
            relaxation_s: 0.05 * 40.0_f64.powf(within(0.0, 1.0)),
            dead: broken,
            extra: String::new(),
        }
    }

    /// Factor of each taxel's reading; 0 for a dead one.
    pub fn gains(&self) -> Vec<f64> {
        let alone = Self { creep_percent: 0.0, hysteresis_percent: 0.0, extra: String::new(), ..self.clone() };
        let mut sensor = Parts::of(&alone.scene(&Place::default()), 0).sensor;
        let mut gains = Vec::new();
        for row in 0..ROWS {
            let mut kpa = [100.0; COLUMNS];
            sensor.pressure.each(|part| part(row, 0.0, &mut kpa));
            gains.extend(kpa.map(|kpa| kpa / 100.0));
        }
        self.dead.iter().for_each(|[row, column]| gains[row * COLUMNS + column] = 0.0);
        gains
    }

    fn scene(&self, place: &Place) -> Scene {
        let Self { seed, modulus_kpa, noise_codes, gains_percent, creep_percent, hysteresis_percent, .. } = self;
        let Self { relaxation, relaxation_s, dead, extra, .. } = self;
        let Place { centre_mm: [x_mm, y_mm], tilt_deg: [columns_deg, rows_deg] } = place;
        let text = format!(
            "about = \"a press\"\nduration_s = 1.0\nseed = {seed}\n[tip]\nmodulus_kpa = {modulus_kpa:?}\n\
             [controller]\nmodulus_pa = {}\ncodes_per_kpa_milli = 24000\ndirection_confirmed = 1\n\
             [object]\ndistance_mm = {DISTANCE_MM:?}\ncentre_x_mm = {x_mm:?}\ncentre_y_mm = {y_mm:?}\n\
             [effects.tilted_plane]\nalong_columns_deg = {columns_deg:?}\nalong_rows_deg = {rows_deg:?}\n\
             [effects.noise]\nrms_codes = {noise_codes:?}\n[effects.gain_spread]\nrms_percent = {gains_percent:?}\n\
             [effects.creep]\nrate_percent_per_decade = {creep_percent:?}\n\
             [effects.hysteresis]\nwidth_percent = {hysteresis_percent:?}\n\
             [effects.relaxation]\nshare = {relaxation:?}\ntau_s = {relaxation_s:?}\n\
             [effects.broken_taxels]\ndead = {dead:?}\n{extra}",
            (1e3 * modulus_kpa) as i32
        );
        read("press.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
    }
}

/// A place up to 1.5 mm off the array's middle on both axes, on a plate tilted by up to 2 degrees.
pub fn any_place(rng: &mut fastrand::Rng) -> Place {
    let mut within = |most: f64| most * (2.0 * rng.f64() - 1.0);
    let centre_mm = [within(1.5), within(1.5)];
    let (angle, tilt) = (within(std::f64::consts::PI), within(2.0).abs());
    Place { centre_mm, tilt_deg: [tilt * angle.cos(), tilt * angle.sin()] }
}

pub struct Finger {
    draw: Draw,
    pub bench: Bench,
}

impl Finger {
    /// A finger that never pressed, in the air before the plate.
    pub fn at(place: &Place, draw: &Draw) -> Self {
        Self { draw: draw.clone(), bench: Bench::new(&draw.scene(place)).expect("a finger") }
    }

    /// Waits in the air, tares and presses, while the plate moves.
    pub fn press(&mut self, pause_s: f64, plate_mm_per_s: f64) -> Press {
        self.bench.command().torque = false;
        self.bench.rest(pause_s);
        self.bench.tare();
        self.bench.run(0.05);
        let begun_s = self.bench.time_s();
        self.bench.measure(Task::Press, |bench| {
            let moved_mm = plate_mm_per_s * (bench.time_s() - begun_s);
            bench.place_object(DISTANCE_MM + moved_mm);
        });
        let params = self.draw.scene(&Place::default()).params();
        record::press(self.bench.kept(), &params).unwrap_or_else(|why| panic!("{why} {:?}", self.draw))
    }
}

/// Distance of the plate from the tip at rest.
const DISTANCE_MM: f64 = 5.0;
/// Pause in the air before a tare, s.
const PAUSE_S: f64 = 10.0;

/// Presses at places of a plate, each after a pause and a tare.
pub fn presses(draw: &Draw, count: usize) -> Vec<Press> {
    let mut finger = Finger::at(&Place::default(), draw);
    let mut rng = fastrand::Rng::with_seed(draw.seed ^ 0x5eed);
    let mut press = |_| {
        finger.bench.exchange(&draw.scene(&any_place(&mut rng))).expect("a plate");
        finger.press(PAUSE_S, 0.0)
    };
    (0..count).map(&mut press).collect()
}
