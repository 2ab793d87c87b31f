//! The taxels' gains from three presses onto a hard flat plate.

use fingertip::calibrate::{State, UNKNOWN};
use fingertip::pressure::GAIN_ONE;
use fingertip::shipped::{COLUMNS, ROWS};
use sim::effects::set::Named;
use sim::native::bench::Bench;
use sim::scene::{Scene, read};

/// A plate: how far, where, and how it stands.
#[derive(Clone, Copy, Debug)]
pub struct Plate {
    pub centre_mm: [f64; 2],
    pub tilt_deg: [f64; 2],
}

pub fn scene(seed: u64, plate: Plate, tables: &str) -> Scene {
    let Plate { centre_mm: [x, y], tilt_deg: [along_columns, along_rows] } = plate;
    let text = format!(
        "about = \"a plate\"\nseed = {seed}\nduration_s = 1.0\n\
        [object]\ndistance_mm = 2.0\ncentre_x_mm = {x:?}\ncentre_y_mm = {y:?}\n\
        [effects.tilted_plane]\nalong_columns_deg = {along_columns:?}\nalong_rows_deg = {along_rows:?}\n\
        {tables}\n[[script]]\nat_s = 0.0\ngoal_n = 0.0\n"
    );
    read("plate.toml", &text, &[]).unwrap_or_else(|errors| panic!("{errors}\n{text}"))
}

/// Presses once; how the press ended.
pub fn press(bench: &mut Bench<Named>) -> State {
    sim::native::calibrated::press(bench).unwrap_or_else(|error| panic!("{error}"))
}

/// Three presses at these plates.
pub fn three(seed: u64, plates: [Plate; 3], tables: &str) -> Bench<Named> {
    let mut bench = Bench::new(&scene(seed, plates[0], tables)).expect("it runs");
    for (number, plate) in plates.into_iter().enumerate() {
        if number > 0 {
            bench.exchange(&scene(seed, plate, tables)).expect("it runs");
        }
        assert_eq!(press(&mut bench), State::Done, "press {number} of seed {seed}: {plate:?}");
    }
    bench
}

pub const PLATES: [Plate; 3] = [
    Plate { centre_mm: [0.5, -0.4], tilt_deg: [2.0, 0.0] },
    Plate { centre_mm: [-1.5, 1.0], tilt_deg: [0.0, 2.0] },
    Plate { centre_mm: [1.2, 1.3], tilt_deg: [-1.4, -1.4] },
];

/// A proposal against the truth.
pub struct Judged {
    /// Of gain times sensitivity, which should be 1, where a press reached the taxel.
    pub rms: f64,
    /// The same without what all have in common.
    pub rms_apart: f64,
    /// How many taxels.
    pub reached: usize,
    /// How many of those are within two standard uncertainties.
    pub within: usize,
}

pub fn judged(bench: &mut Bench<Named>) -> Judged {
    let truth = bench.sensitivities();
    let proposal = *bench.pipeline().proposal();
    let mut products = Vec::new();
    let mut within = 0;
    for place in 0..ROWS * COLUMNS {
        let (row, column) = (place / COLUMNS, place % COLUMNS);
        let sigma = proposal.sigmas[row][column];
        let gain = f64::from(proposal.gains.get(place)) / f64::from(GAIN_ONE);
        if sigma == UNKNOWN {
            assert_eq!(gain, 1.0, "what no press reached keeps its gain");
            continue;
        }
        let product = gain * truth[row][column];
        products.push(product);
        within += usize::from((product - 1.0).abs() < 2e-3 * f64::from(sigma));
    }
    let reached = products.len();
    let count = reached as f64;
    let mean = products.iter().sum::<f64>() / count;
    let rms = |about: f64| (products.iter().map(|product| (product / about - 1.0).powi(2)).sum::<f64>() / count).sqrt();
    Judged { rms: rms(1.0), rms_apart: rms(mean), reached, within }
}

/// Noise of 2 codes, and plates tilted by 2 degrees each another way, 1 to 2 mm apart.
#[test]
fn three_presses_find_the_gains_to_two_percent() {
    let (mut all, mut sure) = (0, 0);
    for spread_percent in [5.0, 10.0, 20.0] {
        let mut worst = 0.0_f64;
        for seed in 1..=8 {
            let noise = "[effects.noise]\nrms_codes = 2\n";
            let tables = format!("[effects.gain_spread]\nrms_percent = {spread_percent:?}\n{noise}");
            let mut bench = three(seed, PLATES, &tables);
            let Judged { rms, reached, within, .. } = judged(&mut bench);
            println!("{spread_percent} %, seed {seed}: {:.2} % rms of {reached}, {within} within 2 sigma", 100.0 * rms);
            assert!(rms < 0.02, "{spread_percent} %, seed {seed}: {rms}");
            assert!((85..=100).contains(&reached));
            worst = worst.max(rms);
            (all, sure) = (all + reached, sure + within);
        }
        // What is too good would not have been pressed.
        assert!(worst > 0.001);
    }
    println!("{sure} of {all} within two standard uncertainties");
    assert!(10 * sure > 9 * all, "{sure} of {all}");
}
