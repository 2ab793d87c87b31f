//! A simulated finger that presses under its controller. Hysteresis, creep and relaxation go on from press to press.

use fingertip::measure::Task;
use fingertip::shipped::{COLUMNS, ROWS};
use sim::effects::Parts;
use sim::native::bench::Bench;
use sim::native::calibrated::Place;
use sim::scene::{Scene, read};
use solve::press::Press;
use solve::record;

/// Distance of the plate, mm.
pub const DISTANCE_MM: f64 = 5.0;

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

    pub fn scene(&self, place: &Place) -> Scene {
        let dead: Vec<String> = self.dead.iter().map(|[row, column]| format!("[{row}, {column}]")).collect();
        let Self { seed, modulus_kpa, noise_codes, gains_percent, creep_percent, hysteresis_percent, .. } = self;
        let (Self { relaxation, relaxation_s, extra, .. }, dead) = (self, dead.join(", "));
        let Place { centre_mm: [x_mm, y_mm], tilt_deg: [columns_deg, rows_deg] } = place;
        let text = format!(
            "about = \"a press\"\nduration_s = 1.0\nseed = {seed}\n[tip]\nmodulus_kpa = {modulus_kpa:?}\n\
             [object]\ndistance_mm = {DISTANCE_MM:?}\ncentre_x_mm = {x_mm:?}\ncentre_y_mm = {y_mm:?}\n\
             [effects.tilted_plane]\nalong_columns_deg = {columns_deg:?}\nalong_rows_deg = {rows_deg:?}\n\
             [effects.noise]\nrms_codes = {noise_codes:?}\n[effects.gain_spread]\nrms_percent = {gains_percent:?}\n\
             [effects.creep]\nrate_percent_per_decade = {creep_percent:?}\n\
             [effects.hysteresis]\nwidth_percent = {hysteresis_percent:?}\n\
             [effects.relaxation]\nshare = {relaxation:?}\ntau_s = {relaxation_s:?}\n\
             [effects.broken_taxels]\ndead = [{dead}]\n{extra}"
        );
        read("press.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
    }
}

/// A place within these bounds.
pub fn any_place(rng: &mut fastrand::Rng, off_mm: f64, tilt_deg: f64) -> Place {
    let mut within = |most: f64| most * (2.0 * rng.f64() - 1.0);
    let centre_mm = [within(off_mm), within(off_mm)];
    let (angle, tilt) = (within(std::f64::consts::PI), within(tilt_deg).abs());
    Place { centre_mm, tilt_deg: [tilt * angle.cos(), tilt * angle.sin()] }
}

/// Pause in the air after a press, s.
const PAUSE_S: f64 = 10.0;

/// Frames of the zero that the solver is judged with. The controller's tare has 32 of each taxel, whose noise would be the
/// larger part of a soft tip's errors.
const ZERO_FRAMES: u32 = 256;

pub struct Finger {
    draw: Draw,
    pub bench: Bench,
}

impl Finger {
    pub fn new(draw: &Draw) -> Self {
        let bench = Bench::new(&draw.scene(&Place::default())).expect("a world");
        Self { draw: draw.clone(), bench }
    }

    /// Presses at a place of a plate that moves at a speed, after a tare; a pause follows.
    pub fn press(&mut self, place: &Place, mm_per_s: f64) -> Press {
        let Self { draw, bench } = self;
        let scene = draw.scene(place);
        bench.exchange(&scene).expect("a plate");
        bench.tare();
        bench.run(0.02);
        let mut zero = [0.0; ROWS * COLUMNS];
        for _ in 0..ZERO_FRAMES {
            bench.step();
            let codes = bench.pipeline().array().picture().taxels.as_flattened().iter();
            zero.iter_mut()
                .zip(codes)
                .for_each(|(zero, code)| *zero += f64::from(*code) / 16.0 / f64::from(ZERO_FRAMES));
        }
        let begun_s = bench.time_s();
        bench.measure(Task::Press, |bench| bench.place_object(DISTANCE_MM + mm_per_s * (bench.time_s() - begun_s)));
        let mut press = record::press(bench.kept(), &scene.params()).expect("a press");
        let readings = press.steps.iter_mut().flat_map(|step| step.taxels.iter_mut().zip(zero));
        readings.filter(|(taxel, _)| !taxel.bad).for_each(|(taxel, zero)| taxel.mean -= zero);
        bench.run(0.4);
        bench.command().torque = false;
        bench.run(0.05);
        bench.rest(PAUSE_S);
        press
    }
}

/// Presses at places of a plate.
pub fn presses(draw: &Draw, count: usize) -> Vec<Press> {
    let mut finger = Finger::new(draw);
    let mut rng = fastrand::Rng::with_seed(draw.seed ^ 0x5eed);
    (0..count).map(|_| finger.press(&any_place(&mut rng, 1.5, 2.0), 0.0)).collect()
}
