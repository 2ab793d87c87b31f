//! The whole loop: what cycles, frame rate and bits buy in the true force of a population of fingers.

use super::output::Passes;
use super::page::{Point, Studied, figure};
use fingertip::params::Params;
use fingertip::shipped::{CLOCKS, Config, SLOTS};
use output::plot::{Dot, Front, PlotError, front};
use sim::setup::Tip;
use std::fmt::Write as _;

/// Number of goals that the fingers hold.
const GOALS: usize = 4;
pub const PICTURE: &str = "docs/pictures/study-whole-loop.svg";
/// Word lengths that are tried, bits.
const BITS: [u32; 8] = [12, 14, 16, 18, 20, 24, 28, 32];
/// Indentations and distances at which the pressure is taken.
const PLACES: usize = 200;

/// Errors of the true force, root mean squares over the fingers, mN.
type Errors = [f64; GOALS];

/// Results of `budget --whole-loop`.
#[derive(Clone, Debug, Default)]
pub struct WholeLoop {
    /// By fit level: of fingers as they come, and calibrated.
    levels: Vec<[Errors; 2]>,
    /// By frame rate: settle time of a row in ns, longest settling in ms, duty at rest in %, errors, and number of holds
    /// without a fault.
    rates: Vec<(u32, f64, f64, Errors, u32)>,
    fingers: u32,
}

impl WholeLoop {
    /// Reads the output of the program.
    pub fn read(text: &str) -> Result<Self, String> {
        let wrong = |why: &dyn std::fmt::Display| format!("the output of `budget --whole-loop`: {why}");
        let (goals_n, levels, rates, fingers): ([f64; GOALS], _, _, _) =
            serde_json::from_str(text).map_err(|error| wrong(&error))?;
        if goals_n != [0.5, 1.0, 2.0, 5.0] {
            return Err(wrong(&format_args!("goals of {goals_n:?} N")));
        }
        Ok(Self { levels, rates, fingers })
    }

    /// Returns the section that opens the page.
    pub fn markdown(&self) -> Result<String, String> {
        let mut page = format!(
            "\n## The whole loop\n\nError of the **true force** that {} [usual fingers](budget.md) hold, rms over the fingers, against the cycles of \
             `Pipeline::step`; the [README](../README.md#accuracy-and-its-cost) has the table. *Calibrated* fingers were \
             [calibrated](commissioning.md) with a plate and a scale. Simulated; cycles estimated.\n\n\
             ![The whole loop: error at 5 N over cycles](pictures/study-whole-loop.svg)\n\n",
            self.fingers
        );
        page += "Fit levels 3 to 5 refine the contact in 6, 3 and 1 frames instead of 11. The errors do not fall: the taxels limit the force.\n\n\
                 Slower frames (by the settle time): the demonstration's longest settling and its duty at rest, and the errors of uncalibrated \
                 fingers at fit level 2. Why a slower loop has the smaller errors was not examined.\n\n\
                 | settle, ns | frames a second | settling, ms | duty at rest, % | at 0.5 N, mN | 1 N | 2 N | 5 N | holds without a fault |\n\
                 | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
        for (ns, ms, percent, errors, holds) in &self.rates {
            let params = Params { settle_ns: *ns as i32, ..Params::DEFAULT };
            let slot = Config::shipped(&params).map_err(|error| error.to_string())?.timing.slot;
            let hz = f64::from(CLOCKS.timer_hz) / (f64::from(slot.0) * SLOTS as f64);
            let _ = writeln!(page, "| {ns} | {hz:.0} | {ms:.1} | {percent:.2} | {} | {holds} |", cells(errors));
        }
        Ok(page + &formats())
    }

    /// Returns the table of the fit levels, which the README shows.
    pub fn levels_table(&self, studied: &[Studied]) -> Result<String, String> {
        let mut table = String::from(
            "| fit level | cycles, median | with flash | max | as they come: at 0.5 N, mN | 1 N | 2 N | 5 N | calibrated: at 0.5 N, mN | 1 N | 2 N | 5 N |\n\
             | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        );
        for (level, [plain, calibrated]) in self.levels.iter().enumerate() {
            let point = step(studied, level)?;
            let (cycles, Passes { median, max }) = (point.cycles(), point.cost.flash);
            let bold = if level == 2 { "**" } else { "" };
            let (plain, calibrated) = (cells(plain), cells(calibrated));
            let _ = writeln!(table, "| {bold}{level}{bold} | {cycles} | {median} | {max} | {plain} | {calibrated} |");
        }
        Ok(table)
    }

    /// Draws error over cycles.
    pub fn draw(&self, studied: &[Studied]) -> Result<String, String> {
        let mut dots = Vec::new();
        for (level, errors) in self.levels.iter().enumerate().skip(1) {
            for ([.., mn], name) in errors.iter().zip(["", ", calibrated"]) {
                let label = format!("level {level}{name}");
                let x = step(studied, level)?.cycles() as f64;
                dots.push(Dot { x, y: *mn, label, best: level <= 2, own: level == 2 });
            }
        }
        let picture = front(&Front {
            title: "The whole loop: the square is the default fit level",
            x: "estimated cycles of a frame on a Cortex-M4F, median, without wait states",
            y: "error of the true force at 5 N, mN rms",
            dots,
        });
        picture.map_err(|error: PlotError| error.to_string())
    }
}

fn step<'a>(studied: &'a [Studied], level: usize) -> Result<&'a Point, String> {
    let name = if level == 2 { "Pipeline::step".into() } else { format!("Pipeline::step, fit level {level}") };
    let points = studied.iter().filter(|(kernel, _)| kernel.name == "step").flat_map(|(_, points)| points);
    points.into_iter().find(|point| point.name == name).ok_or_else(|| format!("`{name}` was not studied"))
}

fn cells(errors: &Errors) -> String {
    errors.map(|mn| format!("{mn:.0}")).join(" | ")
}

/// The pressure in words of some lengths, against the smallest pressure that the sensor shows.
fn formats() -> String {
    let code_kpa = 1e3 / f64::from(Params::DEFAULT.codes_per_kpa_milli);
    let mut page = format!(
        "\nWord length, for the [pressure](#pressure-at-a-distance-from-the-centre) with every intermediate result rounded to n bits of its range. \
         The sensor resolves one code, {code_kpa:.3} kPa.\n\n\
         | bits | error, codes, max |\n| --- | --- |\n"
    );
    for bits in BITS {
        let kpa = rounded_error_kpa(bits);
        let _ = writeln!(page, "| {bits} | {} |", figure(kpa / code_kpa));
    }
    page
}

/// Largest error of the pressure with words of this length, over indentations to 8 mm and all distances inside.
fn rounded_error_kpa(bits: u32) -> f64 {
    let tip = Tip::default();
    let round = |value: f64, range: f64| {
        let unit = range / 2_f64.powi(bits as i32);
        (value / unit).round() * unit
    };
    let mut worst = 0.0_f64;
    for (i, j) in (1..=PLACES).flat_map(|i| (0..PLACES).map(move |j| (i, j))) {
        let d_mm = 8.0 * i as f64 / PLACES as f64;
        let flattened = tip.flattened(d_mm);
        let r2 = flattened.contact_radius2_mm2 * j as f64 / PLACES as f64;
        let length = round((tip.radius_mm * tip.radius_mm - r2).sqrt(), 16.0);
        let shorter = round(length - round(tip.radius_mm - d_mm, 16.0), 16.0);
        let kpa = round(tip.modulus_kpa * round(shorter / length, 1.0), 256.0);
        worst = worst.max((kpa - flattened.pressure_kpa(r2)).abs());
    }
    worst
}
