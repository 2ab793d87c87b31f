//! The pictures: well-formed, complete, and the same bytes every time.

use fingertip::config::newtons;
use fingertip::params::Params;
use fingertip::shipped::Config;
use host_tests::metrics::Sample;
use host_tests::native::Native;
use host_tests::plant::Setup;
use host_tests::plot::{self, Map, Panel};

/// A touch and a step, natively, with the pressures at its end.
fn run() -> (Vec<Sample>, [[f64; 10]; 10]) {
    let mut board = Native::new(&Setup::default(), &Config::shipped(&Params::DEFAULT).unwrap());
    board.tare_and_enable();
    let mut trace = Vec::new();
    for (goal_mn, frames) in [(200, 4_000), (2_000, 1_000), (5_000, 1_000), (1_000, 1_000)] {
        board.command.goal = newtons(goal_mn);
        for _ in 0..frames {
            let status = board.step();
            trace.push(Sample {
                time_s: board.time_s(),
                goal_n: f64::from(goal_mn) * 1e-3,
                true_force_n: board.world.force_n(),
                sensed_force_n: status.contact.force.0.to_num(),
                travel_mm: board.world.travel_mm(),
                indentation_mm: board.world.indentation_mm(),
                duty: f64::from(status.duty.0) / f64::from(fingertip::units::Duty::FULL),
                mode: status.mode,
            });
        }
    }
    (trace, core::array::from_fn(|row| core::array::from_fn(|column| board.world.pressure_kpa(row, column))))
}

fn pictures() -> [(&'static str, String); 3] {
    let (trace, pressures_kpa) = run();
    let at = trace.iter().find(|sample| sample.goal_n == 2.0).unwrap().time_s;
    let panel = |title: &str, time_optimal_ms| Panel {
        title: title.into(),
        samples: &trace,
        zero_s: at,
        shown_ms: [5.0, 60.0],
        time_optimal_ms,
    };
    let map = |title: &str, radius_mm| Map { title: title.into(), pressures_kpa, centre_mm: [0.0, 0.0], radius_mm };
    [
        ("overview", plot::overview(&trace).unwrap()),
        (
            "steps",
            plot::steps(&[panel("0.2 to 2 N", Some(9.0)), panel("the same", None), panel("again", None)]).unwrap(),
        ),
        ("maps", plot::maps(&[map("1 N", 4.6), map("2 N", 0.0), map("5 N", 6.0)], 1.5).unwrap()),
    ]
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let pictures = pictures();
    assert_eq!(pictures, self::pictures());
    for (name, svg) in &pictures {
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        if let Some(folder) = std::env::var_os("FINGERTIP_PICTURES") {
            std::fs::write(std::path::Path::new(&folder).join(format!("{name}.svg")), svg).unwrap();
        }
    }
}

#[test]
fn axes_have_units() {
    let [(_, overview), (_, steps), (_, maps)] = pictures();
    for unit in ["time, s", "\nN\n", "\nmm\n", "\n%\n"] {
        assert!(overview.contains(unit), "{unit:?}");
    }
    assert!(steps.contains("time, ms"));
    assert_eq!(maps.matches("columns, mm").count(), 3);
    assert!(maps.contains("kPa"));
    // 100 taxels each, the scale of 64, the background.
    assert_eq!(maps.matches("<rect").count(), 3 * 100 + 64 + 1);
}

#[test]
fn nothing_to_draw_is_an_error() {
    assert!(plot::overview(&[]).unwrap_err().to_string().contains("empty"));
    assert!(plot::maps(&[], 1.5).is_err());
}
